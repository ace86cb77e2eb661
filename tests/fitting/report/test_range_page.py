"""The page and lines of ranging, from hand-written content: what they show, and how safely."""

import html.parser
import io
import re

import pytest
from rich.console import Console

from fitting.report._pages import PagePicture
from fitting.report.ranging import _words as words
from fitting.report.ranging._files import range_csv
from fitting.report.ranging._page import render_page
from fitting.report.ranging._terminal import render_summary
from fitting.report.ranging._words import fold

SCAN = {
    "time_s": 0.1,
    "direction": "up",
    "distance": 0.7,
    "stderr": 2e-6,
    "span_hz": 6e10,
    "apparent": 0.7,
    "apparent_stderr": 1e-7,
    "nonlinearity_hz": 4e8,
    "problem": "",
}
LOST = SCAN | {"time_s": 0.15, "direction": "down", "distance": None, "stderr": None}
STATE = {
    "time_s": 0.1,
    "distance": 0.7,
    "distance_stderr": 2e-6,
    "velocity": 0.005,
    "velocity_stderr": 1e-7,
    "gated": False,
}


def content(**changes):
    return {
        "schema": "rapi.range/1",
        "unit": "m",
        "name": "records",
        "air_index": 1.00027,
        "air_index_stderr": 1e-7,
        "air_phase_index": 1.00026,
        "method": "resample-phase",
        "summary": {
            "distance": 0.7,
            "stderr": 2e-6,
            "scatter": 3e-6,
            "velocity": 0.005,
            "velocity_stderr": 1e-7,
            "scans": 2,
            "counted": 1,
        },
        "scans": [SCAN, LOST | {"problem": "fringes lost"}],
        "track": [STATE],
        "budget": [{"source": "scale", "stderr": 1e-6, "note": "of the cavity"}],
        "faults": ["1 of 2 scans (first at 0.15 s): fringes lost"],
        "scale": {
            "told_by": "cavity",
            "delay_s": 2.448e-8,
            "stderr": 1e-14,
            "path_m": 7.34,
            "comb_hz": 1e5,
        },
        "set_up": {
            "records": 1,
            "sample_hz": 1e6,
            "excitation_hz": 10.0,
            "wavelength_m": 780e-9,
            "interferometer_path_m": 7.34,
            "cavity_spacing_hz": 1.5e9,
        },
        "expected_m": None,
        "seconds": 1.0,
        "versions": {"numpy": "2"},
    } | changes


NOTHING = dict.fromkeys(("distance", "stderr", "scatter", "velocity", "velocity_stderr"))


class Tags(html.parser.HTMLParser):
    """Elements that open and close, and what is asked for from elsewhere."""

    VOID = {"meta", "link", "img", "br", "source"}

    def __init__(self):
        super().__init__()
        self.open, self.asked = [], []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)
        self.asked += [v for k, v in attrs if k in ("src", "href") and not v.startswith("data:")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def text_of(group) -> str:
    out = io.StringIO()
    Console(file=out, width=200).print(group)
    return out.getvalue()


def test_the_page_is_whole_and_asks_for_nothing():
    page = render_page(content(), PagePicture("d2lkZQ==", "bmFycm93"))
    tags = Tags()
    tags.feed(page)
    assert (tags.open, tags.asked) == ([], [])
    assert "<script" not in page
    for part in ("700.0000", "1 of 2 scans", "fringes lost", "of the cavity", "1.00 μm", "5.000"):
        assert part in page.replace("\N{NO-BREAK SPACE}", " "), part
    wide, narrow = "data:image/png;base64,d2lkZQ==", "data:image/png;base64,bmFycm93"
    assert f'<source media="(max-width: 44rem)" srcset="{narrow}"><img src="{wide}"' in page


def test_air_that_is_not_known_stands_beside_the_distance():
    """0.7 m are 0.19 mm too long in air whose index is taken as 1: a hundred times the error."""
    vacuum = content(air_index=1.0, air_index_stderr=None)
    for shown in (render_page(vacuum), text_of(render_summary(vacuum))):
        assert re.search(r"in ordinary air 189 .m less", shown.replace("\N{NO-BREAK SPACE}", " "))
    assert "ordinary air" not in render_page(content()) + text_of(render_summary(content()))


def test_text_in_it_is_text():
    page = render_page(content(name="<b>x</b>", faults=["<script>alert(1)</script>"]))
    assert "<b>x" not in page and "<script>alert" not in page


def test_without_a_distance():
    none = content(summary=NOTHING | {"scans": 2, "counted": 0}, track=[], scans=[LOST, LOST])
    for text in (render_page(none), text_of(render_summary(none))):
        assert "no scan could be read" in text
        assert "nan " not in text.lower() and "None" not in text


def test_without_budget_air_cavity_or_track():
    plain = content(
        budget=[],
        track=[],
        air_index_stderr=None,
        summary=content()["summary"] | {"velocity": None, "velocity_stderr": None},
    )
    plain["scale"] = plain["scale"] | {"told_by": "interferometer_path_m", "stderr": None}
    said = text_of(render_summary(plain))
    for part in ("taken as 1", "not estimated", "no cavity tells it"):
        assert part in said and part in render_page(plain)


def test_a_missing_number_is_an_empty_cell():
    lines = range_csv(content()).splitlines()
    assert lines[2].split(",")[2:4] == ["", ""] and lines[2].endswith("fringes lost")
    assert len({line.count(",") for line in lines}) == 1


@pytest.mark.parametrize(
    ("value", "text"),
    [(12.0, "12.0 m"), (0.0123, "12.3 mm"), (4.5e-6, "4.50 μm"), (3e-9, "3.00 nm"), (0.0, "0 nm")],
)
def test_lengths(value, text):
    assert words.length(value).replace("\N{NO-BREAK SPACE}", " ") == text


def test_distances_have_the_digits_of_their_error():
    plain = words.distance(0.69999581, 4.8e-6).replace("\N{NO-BREAK SPACE}", " ")
    assert plain == "699.9958 ± 0.0048 mm"
    assert words.distance(23.4567891, 1.2e-4).endswith("m")
    assert "mm/s" in words.speed(0.005, 1e-7) and "μm/s" in words.speed(1e-7, 1e-8)


def test_a_size_that_nothing_tells_is_no_nought():
    air = {"source": "air", "stderr": 0.0, "note": "the state of the air is not given"}
    assert words.budget_size(air) == "not known"
    for known in (air | {"note": ""}, air | {"source": "vibration"}, air | {"stderr": 2e-7}):
        assert words.budget_size(known) == words.length(known["stderr"])


def test_what_is_said_of_several_scans_is_said_once():
    """With the first and the last of them; what is said of one scan, or of all, stays as it is."""
    faults = [
        "scan at 1.364 s: cavity peaks: 2 missed; the span is right",
        "the state of the air is not given",
        "scan at 1.389 s: cavity peaks: 3 missed; the span is right",
        "scan at 2.5 s: no light",
        "scan at 6.264 s: cavity peaks: 12 missed; the span is right",
    ]
    assert fold(faults) == [
        "scan at 1.364 s, and alike 2 others up to 6.264 s: cavity peaks: 2 missed; the span is "
        "right",
        "the state of the air is not given",
        "scan at 2.5 s: no light",
    ]
    assert fold(faults[:3])[0].startswith("scan at 1.364 s, and alike another up to 1.389 s: ")


@pytest.mark.parametrize("width", [420, 1400])
def test_the_picture_begins_where_the_text_does(browser, tmp_path, width):
    page = tmp_path / "range.html"
    page.write_text(render_page(content(), PagePicture("d2lkZQ==", "bmFycm93")), encoding="utf-8")
    browser.open(page, width=width, dark=False)
    box = "document.querySelector('{}').getBoundingClientRect()"
    head, picture = box.format("#time h2"), box.format("#time figure")
    for side in ("left", "right"):
        assert browser.evaluate(f"{picture}.{side}") == browser.evaluate(f"{head}.{side}")
