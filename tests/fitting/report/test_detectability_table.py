"""What a recording would have shown, on the page and on a terminal."""

import diagnoses

from fitting.report.diagnosis._detectability import tabulate_detectability
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
    table = tabulate_detectability({"detectability": SIZES}, packaged_labels())
    assert table is not None
    rows = {
        row[0].partition(" ")[0]: [cell.replace("\xa0", " ") for cell in row] for row in table.rows
    }
    assert len(table.rows) == 3
    assert "An etalon in the light path" in {row[0] for row in table.rows}
    assert any(row[1:] == ["amplitude 0.00300 GHz", "spacing 4.20 GHz"] for row in rows.values())
    assert any(row[1:] == ["none shows", "–"] for row in rows.values())


def test_page_and_terminal_show_it_where_it_is_known():
    found = diagnoses.creep()
    assert "would have shown" not in render_page(found) + render_text(found)
    found["detectability"] = SIZES
    page, text = render_page(found), render_text(found)
    assert "What this recording would have shown" in page and "spacing" in page
    assert "delay (tau 2.10" in text.replace("\xa0", " ") and "amplitude_law" not in text
