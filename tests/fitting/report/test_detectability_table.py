"""What a recording would have shown, on the page and on a terminal."""

import diagnoses

from fitting.report.diagnosis._detectability import tabulate_detectability
from fitting.report.diagnosis._numbers import Scale
from fitting.report.diagnosis._page import render_page
from fitting.report.diagnosis._terminal import render_text
from fitting.report.diagnosis._text import packaged_labels

SIZES = [
    {"effect": "delay", "parameter": "tau", "value": 2.1e-6, "unit": "s", "others": {}},
    {
        "effect": "etalon",
        "parameter": "amplitude",
        "value": 0.003,
        "unit": "GHz",
        "others": {
            "phase": {"value": 1.0, "unit": "rad"},
            "spacing": {"value": 4.2, "unit": "GHz"},
            "sharpness": {"value": 0.0, "unit": "1"},
        },
    },
    {"effect": "amplitude_law", "parameter": "gain", "value": None, "unit": "1", "others": {}},
]


def test_a_row_an_effect_with_the_kind_it_is_for():
    scale = Scale.of("GHz", [0.02])
    table = tabulate_detectability({"detectability": SIZES}, packaged_labels(), scale)
    assert table is not None
    rows = {
        row[0].partition(" ")[0]: [cell.replace("\xa0", " ") for cell in row] for row in table.rows
    }
    assert len(table.rows) == 3
    assert "An etalon in the light path" in {row[0] for row in table.rows}
    assert any(row[1:] == ["amplitude 3.00 MHz", "spacing 4200 MHz"] for row in rows.values())
    assert any(row[1:] == ["not detectable at any size", "–"] for row in rows.values())


def test_page_and_terminal_show_it_where_it_is_known():
    found = diagnoses.creep()
    assert "detectable" not in render_page(found) + render_text(found)
    found["detectability"] = SIZES
    page, text = render_page(found), render_text(found)
    assert "What this recording could have shown" in page and "spacing" in page
    shown = " ".join(text.replace("\xa0", " ").split())
    assert "delay between drive and reading (tau 2.10" in shown
    assert "dependence on amplitude" not in shown  # not detectable at any size


def test_runs_that_carry_the_verdict_are_listed_the_largest_first():
    found = diagnoses.creep()
    assert "Evidence by run" not in render_page(found)
    run = {"excitation_hz": 10.0, "amplitude": 3.0, "before": 0.1, "after": 0.02, "share": 0.8}
    other = {"excitation_hz": 40.0, "amplitude": 3.0, "before": 0.05, "after": 0.02, "share": 0.2}
    found["shrinkage"]["by_run"] = [run, other]
    page = render_page(found)
    assert "Evidence by run: the run at 10\xa0Hz, 3\xa0V gives 80\xa0% of it" in page


def test_a_pair_shows_the_share_of_each():
    found = diagnoses.creep()
    found["hypotheses"][2]["shares"] = {"creep": 0.7, "drift": 0.3}
    assert "share of the gap, drift of the optical frequency" in render_page(found)
