"""The page of a batch, as a parser and as a browser see it: words, links, escaping, sizes."""

import os
import re
from pathlib import Path
from urllib.parse import unquote

import batch_results as made
import diagnoses
import numpy as np
import pytest
from parsed_page import Page

from fitting.batch.table import write_page, write_table
from fitting.batch.table._read import read_result
from fitting.batch.table._summary import summarise
from fitting.report.batch import _figures, _page
from fitting.report.batch._text import cut_at_words
from fitting.report.charts._marks import Areas, Boxes, Dots


def page(records, folder: Path) -> Page:
    return Page(write_page(records, folder).read_text(encoding="utf-8"))


def spoiled(folder: Path, count: int = 40):
    """A batch with one outlier, a drift, two failures and an untrusted fit."""
    values = made.scattered(count, seed=2)
    values[:, 1] += 10 * made.STDERR[1] * np.linspace(-0.5, 0.5, count)
    values[7, 2] += 30 * made.STDERR[2]
    records = made.fits(folder, values)
    records += [made.write_job(folder, f"lost{i}", {}) for i in range(2)]
    records.append(
        made.write_job(folder, "doubt", {"model.json": made.model(trusted=False)}, exit_code=4)
    )
    return records


def test_the_first_screen_counts_and_names(tmp_path):
    read = page(spoiled(tmp_path), tmp_path)
    assert read.texts[0] == (
        "h1",
        "40 of 43 recordings have a trusted result; 1 is not to be trusted and 2 failed.",
    )
    text = read.text
    assert re.search(r"Standing out\. rec0007: lam is \d+\.\d standard deviations above", text)
    assert re.search(r"Drift\. zeta rises by .* V/Hz over 9\.75 h \(p (=|<) 0\.00\d\)", text)
    facts = dict(re.findall(r"(Recordings|Done|Trusted|Failed|Stand out) (\d+)", text))
    assert facts == {
        "Recordings": "43", "Done": "41", "Trusted": "40", "Failed": "2", "Stand out": "1",
    }  # fmt: skip
    assert "too few periods to tell" in text
    assert text.count("run00: 3 samples are NaN, the first at 17.") == 2


def test_nothing_to_say_is_said(tmp_path):
    values = made.CENTRE + made.STDERR * np.random.default_rng(3).standard_normal((30, 4))
    read = page(made.fits(tmp_path, values, correlation=np.eye(4), hours=False), tmp_path)
    assert read.texts[0][1] == "All 30 recordings have a trusted result."
    assert "No recording differs from the others by more than chance." in read.text
    assert "Growth of the hysteresis with scan rate. Median " in read.text
    assert "No parameter has a trend beyond chance." in read.text
    assert "recording, in the order given" in read.text


@pytest.mark.parametrize("count", [0, 1, 3, 6])
def test_small_batches(tmp_path, count):
    read = page(made.fits(tmp_path, made.scattered(count)), tmp_path)
    assert "Fewer than 10 trusted recordings have the same parameters" in read.text
    assert ("so no trend is tested" in read.text) == (count < 6)


def test_links_lead_to_each_recordings_own_files(tmp_path):
    records = spoiled(tmp_path, 12)
    records.append(made.write_job(tmp_path, "a b#c?d%", {"model.json": made.model()}))
    write_table(records, tmp_path)
    read = page(records, tmp_path)
    links = {str(a["href"]) for a in read.all("a")}
    files = {link for link in links if not link.startswith("#")}
    assert all(link.startswith("./") for link in files)
    assert all((tmp_path / unquote(link)).is_file() for link in files)
    assert len(files) == 14 + 2  # with a result, and the two tables


def test_a_page_of_its_own_is_linked_first(tmp_path):
    files = {"diagnosis.json": diagnoses.creep(), "report.html": "<!doctype html>"}
    record = made.write_job(tmp_path, "a", files, task="diagnose")
    read = page([record], tmp_path)
    assert "./a/report.html" in {a["href"] for a in read.all("a")}
    assert (
        "creep" in read.text
        and read.texts[0][1] == "1 of 1 recording has a trusted result."
        or (read.texts[0][1] == "All 1 recordings have a trusted result.")
    )


def test_tasks_and_operators_are_compared_apart(tmp_path):
    records = made.fits(tmp_path, made.scattered(12))
    for i, row in enumerate(made.scattered(11, seed=1)):
        one = {"model.json": made.model(row + 100 * made.STDERR, operator="ClassicPI")}
        records.append(made.write_job(tmp_path, f"other{i}", one))
    records.append(made.write_job(tmp_path, "r", {"range.json": made.ranging()}, task="range"))
    read = page(records, tmp_path)
    heads = [text for tag, text in read.texts if tag == "h3"]
    assert "RAPI: 12 recordings" in heads and "ClassicPI: 11 recordings" in heads
    assert "distance and velocity: 1 recording" in heads
    assert "No recording differs from the others by more than chance." in read.text


def test_hostile_text_stays_text(tmp_path):
    records = []
    for i in range(12):
        text = made.HOSTILE[i % len(made.HOSTILE)]
        model = made.model(made.scattered(1, seed=i)[0], names=(made.HOSTILE[-1], "b", "c", "d"))
        model |= {"operator": made.HOSTILE[-1], "unit": text}
        model["verdict"] |= {"trusted": i % 5 > 0, "reasons": [text]}
        records.append(
            made.write_job(
                tmp_path, f"{i}<b onclick=x>&amp; javascript:x", {"model.json": model}, message=text
            )
        )  # fmt: skip
        records.append(made.write_job(tmp_path, f"lost{i}", {}, message=text))
    read = page(records, tmp_path)
    assert not read.all("script")
    assert all(not attributes for attributes in read.all("b"))
    assert not any("\x1b" in text or "\x07" in text for _, text in read.texts)
    assert "fetch('http://evil.example/')" in read.text
    for _, attributes in read.tags:
        assert not any(name.startswith("on") for name in attributes)


def test_nothing_leaves_the_page(tmp_path):
    text = write_page(spoiled(tmp_path, 12), tmp_path).read_text(encoding="utf-8")
    read = Page(text)
    assert len(text.encode()) < 1_000_000
    for tag, attributes in read.tags:
        for name in ("src", "srcset", "action", "data", "poster"):
            assert name not in attributes, (tag, attributes)
    policy = next(a["content"] for a in read.all("meta") if "http-equiv" in a)
    assert policy is not None and policy.startswith("default-src 'none'")
    plots = [str(a["id"]) for a in read.all("div") if str(a.get("id")).startswith("plot-")]
    # A parameter has its values over time and, beside them, their distribution.
    assert plots == [f"plot-0-{k}{part}" for k in range(4) for part in ("", "-histogram")]


def test_values_far_off_are_drawn_at_the_edge(tmp_path):
    values = made.scattered(30)
    values[3, 0] = 1e6
    content = summarise([read_result(r, tmp_path) for r in made.fits(tmp_path, values)])
    (group,) = content["groups"]
    names = [row["name"] for row in content["rows"]]
    points, counts = _figures.draw_parameter(group["parameters"][0], group, names, {3}, "k").panels
    (marked,) = (m for m in points.marks if isinstance(m, Dots) and m.radius > 3)
    assert [place[1::2] for place in marked.places] == [("0", "up")]
    assert points.y.low < made.CENTRE[0] < points.y.high < 0.4
    (bars,) = counts.marks
    assert isinstance(bars, Boxes)
    assert sum(int(place[5].split()[0]) for place in bars.places) == 30


@pytest.mark.parametrize("count", [2, 3, 4, 9, 40])
def test_recordings_without_a_time_are_numbered_by_whole_ones(tmp_path, count):
    """Not 1.5 of two recordings; the axis reaches from the first to the last all the same."""
    records = made.fits(tmp_path, made.scattered(count, seed=2), hours=False)
    group = summarise([read_result(record, tmp_path) for record in records])["groups"][0]
    names = [record.name for record in records]
    for parameter in group["parameters"]:
        figure = _figures.draw_parameter(parameter, group, names, set(), "key")
        axis = figure.panels[0].x
        ticks = [value for value, _ in axis.ticks]
        assert 2 <= len(ticks) <= 7 and set(ticks) <= set(range(1, count + 1))
        assert [text for _, text in axis.ticks] == [f"{value:.0f}" for value in ticks]
        assert len(axis.places) == len(ticks) and axis.low < 1.0 and axis.high > count


@pytest.mark.parametrize("count", [2, 7, 8])
def test_few_recordings_are_listed_and_their_errors_drawn_whole(tmp_path, count):
    records = made.fits(tmp_path, made.scattered(count, seed=2), hours=False)
    group = summarise([read_result(record, tmp_path) for record in records])["groups"][0]
    parameter = dict(group["parameters"][0])
    middle = parameter["median"]
    parameter["stderr"] = [0.3 * middle] * count  # far above their scatter
    names = [record.name for record in records]
    figure = _figures.draw_parameter(parameter, group, names, set(), "key")
    assert len(figure.panels) == (1 if count < 8 else 2)
    assert ("On the right" in figure.reading) == (count >= 8)
    listed = [row[0] for row in figure.table.rows]
    assert (listed == names) == (count < 8)
    axis = figure.panels[0].y
    ends = [v + sign * 0.3 * middle for v in parameter["values"] for sign in (-1, 1)]
    assert count == 8 or axis.low < min(ends) < max(ends) < axis.high


def test_many_recordings_are_drawn_as_a_density(tmp_path):
    records = made.fits(tmp_path, made.scattered(60))
    content = summarise([read_result(record, tmp_path) for record in records])
    (group,) = content["groups"]
    names = [row["name"] for row in content["rows"]]
    one = group["parameters"][0]
    points, _ = _figures.draw_parameter(one, group, names, {3}, "k", points=20).panels
    (density,) = (m for m in points.marks if isinstance(m, Areas))
    assert 10 < sum(path.count("z") for _, path in density.paths) <= 60
    assert points.scale is not None and points.scale.high.endswith("recordings")
    # Those that stand out are still points with a name.
    dots = [place for m in points.marks if isinstance(m, Dots) for place in m.places]
    assert len(dots) == 1 and "rec0003" in dots[0][2]


def test_a_large_batch_is_cut_on_the_page_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(_page, "_MOST", 10)
    read = page(made.fits(tmp_path, made.scattered(25)), tmp_path)
    assert "15 more are in the files." in read.text
    # A point of a figure bears its name, too.
    listed = {text for tag, text in read.texts if tag != "title"}
    assert "rec0009" in listed and "rec0010" not in listed


INSIDE = ("file:", "data:", "blob:", "about:")


@pytest.fixture(scope="module")
def rendered(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("batch")
    return write_page(spoiled(folder), folder)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [400, 1400])
def test_in_a_browser(browser, rendered, width, dark):
    browser.open(rendered, width=width, height=900, dark=dark)
    assert [url for url in browser.requests if not url.startswith(INSIDE)] == []
    assert browser.complaints == []
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    plots = browser.evaluate(
        "[...document.querySelectorAll('.plot')].map("
        "p => p.querySelectorAll('.line, circle, rect').length)"
    )
    assert len(plots) == 8 and all(count >= 2 for count in plots)
    # How many, who, what: without scrolling.
    for part in ("h1", ".advice", ".advice + .advice"):
        box = f"document.querySelector('{part}').getBoundingClientRect()"
        assert 0 <= browser.evaluate(f"{box}.top") < browser.evaluate(f"{box}.bottom") <= 900
    if os.environ.get("RAPI_PAGES"):
        browser.screenshot(Path(os.environ["RAPI_PAGES"]) / f"batch-{width}-{dark}.png")


def test_without_scripts_the_page_still_tells(browser, rendered):
    browser.open(rendered, width=400, dark=False, script=False)
    try:
        shown = browser.evaluate("document.body.innerText")
        assert " ".join(shown.split()).startswith("40 of 43 recordings have a trusted result")
        assert browser.evaluate("document.querySelector('.plot').offsetHeight") > 0
    finally:
        browser.send("Emulation.setScriptExecutionDisabled", value=False)


def test_a_long_reason_is_cut_between_words():
    reason = " ".join(f"word{k:03d}" for k in range(200))
    cut = cut_at_words(reason, 400)
    assert len(cut) <= 400 and "word000" in cut and cut.endswith("word199")
    assert set(cut.split()) - {"\N{HORIZONTAL ELLIPSIS}"} <= set(reason.split())
    assert cut_at_words("short", 400) == "short"
    assert len(cut_at_words("x" * 1000, 400)) <= 400
