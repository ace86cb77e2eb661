"""The page of drives, from hand-written content: units, digits, and what is zero."""

import re

from parsed_page import Page

from fitting.report._pages import PagePicture
from fitting.report.compensation._page import describe_expected, render_page


def drive(rate: float, bent: tuple[float, float]) -> dict:
    return {
        "excitation_hz": rate,
        "span": 5.0,
        "inverse": "exact",
        "drive_min": -1.4254,
        "drive_max": 4.5751,
        "slew_max": 1058.31,
        "certificate": {"slope_min": 0.95441, "slope_at": 4.5751},
        "nonlinearity": dict(zip(("up", "down"), bent, strict=True)),
        "file": f"drive_{rate:g}Hz.csv",
    }


def content() -> dict:
    expected = {
        "high": 5.82e-4,
        "unit": "um",
        "part": "the middle 80 % of each branch",
        "swings_beside": [],
    }
    return {
        "drives": [drive(10.0, (1e-15, 2e-15)), drive(20.0, (1e-15, 0.00212))],
        "unit": "um",
        "drive_unit": "V",
        "expected": expected,
        "notes": ["The drive reaches -1.4254 V, at 20 Hz: slope 0.0031 um/V^2."],
        "left_out": [],
        "limits_from": "file",
        "limits": {"low_v": -2.0, "slew_v_per_s": 2000.0},
        "versions": {"numpy": "2.4.6"},
        "schema": "rapi.compensation/1",
        "data_sha256": "8e6c",
    }


def test_errors_of_a_scan_are_in_one_unit_and_rounding_is_none():
    text = Page(render_page(content(), PagePicture("", ""))).text
    assert "at most 0.582 nm rms" in text and "0, to rounding; 2.12 nm" in text
    assert "pm" not in text.split() and "5 μm at 10, 20 Hz" in text
    assert describe_expected(content()).startswith("at most 0.582 nm rms")


def test_a_page_has_proper_letters_and_keeps_a_number_with_its_unit():
    page = render_page(content(), PagePicture("", "")).partition("</style>")[2]
    shown = re.sub(r"<code>.*?</code>", "", page)
    assert not re.search(r"\bu[mVs]\b|\^|\de[-+]\d", shown)
    assert not re.search(r"\d (?:V|um|μm|nm|Hz|%)(?!\w)", shown)
    assert "−1.4254\N{NO-BREAK SPACE}V" in shown and "0.0031\N{NO-BREAK SPACE}μm/V²" in shown
    assert "(μm/V)" in shown
