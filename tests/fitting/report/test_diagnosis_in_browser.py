"""The page of a diagnosis in headless Chromium: requests, errors, width, themes, keyboard."""

from pathlib import Path

import diagnoses
import pytest

from fitting.report.diagnosis._page import render_page

NAMES = tuple(diagnoses.ALL)
PAPER = 717  # CSS pixels between the margins of A4
INSIDE = ("file:", "data:", "blob:", "about:")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """All pages as files."""
    made = tmp_path_factory.mktemp("pages")
    for name, make in diagnoses.ALL.items():
        (made / f"{name}.html").write_text(render_page(make()), encoding="utf-8")
    return made


def test_the_browser_sees_what_the_others_look_for(browser, tmp_path):
    bad = tmp_path / "bad.html"
    bad.write_text(
        "<!doctype html><div style='width:3000px'>x</div><img src='http://127.0.0.1:9/x.png'>"
        "<script>console.error('here')</script>"
    )
    browser.open(bad, width=1400, dark=False)
    assert any(url.startswith("http:") for url in browser.requests)
    assert any("here" in text for text in browser.complaints)
    assert browser.evaluate("document.documentElement.scrollWidth > innerWidth")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [400, 1400])
@pytest.mark.parametrize("name", NAMES)
def test_page(browser, folder, name, width, dark):
    browser.open(folder / f"{name}.html", width=width, dark=dark)
    assert [url for url in browser.requests if not url.startswith(INSIDE)] == []
    assert browser.complaints == []
    assert browser.evaluate("innerWidth") == width
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    heads = browser.evaluate(
        "[...document.querySelectorAll('h1, h2, h3')].map("
        "h => [Number(h.tagName[1]), h.getBoundingClientRect().top])"
    )
    tops = [top for _, top in heads]
    assert tops == sorted(tops) and len(set(tops)) == len(tops)
    levels = [level for level, _ in heads]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after - before <= 1 for before, after in zip(levels, levels[1:], strict=False))
    plots = browser.evaluate(
        "[...document.querySelectorAll('.plot')].map("
        "p => p.querySelectorAll('path.line, circle, rect').length)"
    )
    assert all(count > 0 for count in plots)
    assert bool(plots) == ("maps" in diagnoses.ALL[name]())


@pytest.mark.parametrize("name", [name for name in NAMES if name != "hostile"])
def test_first_screen_of_a_phone_holds_verdict_and_advice(browser, folder, name):
    browser.open(folder / f"{name}.html", width=400, height=800, dark=False)
    for part in ("h1", ".advice", ".facts"):
        box = f"document.querySelector('{part}').getBoundingClientRect()"
        assert 0 <= browser.evaluate(f"{box}.top") < browser.evaluate(f"{box}.bottom") <= 800, part


def test_figures_follow_the_scheme(browser, folder):
    browser.open(folder / "creep.html", width=1400, dark=False)
    ink = "getComputedStyle(document.querySelector('#plot-session ~ .xs span')).color"
    soft = "getComputedStyle(document.querySelector('dt')).color"
    light = browser.evaluate(ink)
    assert light == browser.evaluate(soft)
    browser.theme(dark=True)
    browser.settle()
    dark = browser.evaluate(ink)
    assert dark == browser.evaluate(soft) and dark != light
    assert browser.complaints == []


def test_keyboard_reaches_and_opens_every_table(browser, folder):
    browser.open(folder / "creep.html", width=1400, dark=False)
    count = browser.evaluate("document.querySelectorAll('summary').length")
    opened = set()
    for _ in range(6 * count):
        browser.press("Tab", 9)
        if browser.evaluate("document.activeElement.tagName") == "SUMMARY":
            browser.press("Enter", 13, "\r")
            opened.add(browser.evaluate("document.activeElement.textContent"))
        if len(opened) == count:
            break
    assert browser.evaluate("document.querySelectorAll('details[open]').length") == count >= 6
    assert browser.evaluate("document.documentElement.scrollWidth") <= 1400
    assert browser.evaluate(
        "[...document.querySelectorAll('details .scroll')].every(s => s.tabIndex === 0)"
    )


@pytest.mark.parametrize("width", [400, 1400])
def test_without_scripts_the_page_still_tells(browser, folder, width):
    browser.open(folder / "creep.html", width=width, dark=False, script=False)
    try:
        assert browser.evaluate(
            "[...document.querySelectorAll('.plot')].every(p => p.offsetHeight > 0)"
        )
        shown = browser.evaluate("document.body.innerText")
        assert shown.startswith("Creep of the piezo causes the gap")
        assert browser.evaluate("document.querySelector('summary').offsetHeight") > 0
        assert browser.evaluate("document.documentElement.scrollWidth") <= width
    finally:
        browser.send("Emulation.setScriptExecutionDisabled", value=False)


def test_on_paper_every_table_is_shown_and_fits(browser, folder):
    browser.open(folder / "creep.html", width=PAPER, dark=False)
    seen = (
        "[...document.querySelectorAll('details .scroll')]"
        ".map(t => t.checkVisibility({contentVisibilityAuto: true}))"
    )
    assert len(browser.evaluate(seen)) >= 6 and not any(browser.evaluate(seen))
    browser.medium("print")
    try:
        assert all(browser.evaluate(seen))
        rights = "[...document.querySelectorAll('table')].map(t => t.getBoundingClientRect().right)"
        assert max(browser.evaluate(rights)) <= PAPER
        hidden = (
            "[...document.querySelectorAll('.scroll')].map(s => s.scrollHeight - s.clientHeight)"
        )
        assert max(browser.evaluate(hidden)) <= 1  # nothing to scroll to
    finally:
        browser.medium("")
