"""The scores as Markdown."""

import re

from blind_entries import answer, prediction

from fitting.blind.scoring._scores import score
from fitting.blind.scoring.tables._table import markdown

BANK = [
    (answer("n1", "null", size=0.0), prediction("none", random="none")),
    (
        answer("a", "listed", "creep", size=5.0, misfit=True),
        prediction("creep", sure=0.9, survival=0.3, closed=0.95, random="drift"),
    ),
    (
        answer("b", "unlisted", "unlisted:ripple", size=6.0),
        prediction("delay", "delay", "unlisted", sure=0.7, random="unlisted"),
    ),
    (answer("c", "listed", "drift", size=9.0), {"error": "Value|Error: a\nb"}),
    (answer("d", "listed", "delay", size=8.0), prediction("unlisted", withheld="delay")),
]


def rows_of(text):
    """Cells of every table row, spaces taken off."""
    return [
        [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        for line in text.splitlines()
        if line.startswith("| ")
    ]


def test_key_lines():
    follow = [(BANK[1][0], *(p for _, p in [BANK[1]] * 3))] * 2
    text = markdown(score([(a, p, None) for a, p in BANK], follow=follow))
    rows = rows_of(text)
    for expected in (
        ["measure", "target", "seen", "met"],
        ["detection, 2 sigma or more", ">= 98 %", "2 of 3 (66.7 %; 20.8 to 93.9 %)", "NO"],
        ["false alarms on nulls", "<= 3 %", "0 of 1 (0 %; 0 to 79.3 %)", "yes"],
        ["top-1, separable effects, 4 sigma or more", ">= 95 %", "1 of 2 (50 %; 9.45 to 90.5 %)",
         "NO"],
        ["closed fraction, cause rightly named", ">= 0.9", "median 0.95; 1 of 1 reach it", "yes"],
        ["left out: called unlisted", ">= 90 %", "1 of 1 (100 %; 20.7 to 100 %)", "yes"],
        ["shrinkage holds on unseen scans", ">= 90 %", "-", ""],
        ["names left, advised scan against random", "fewer, p < 0.05",
         "1 against 1 of 1 (2 devices: 0 better, 0 worse, p = 1)", "NO"],
        ["4 to 8", "1 of 2 (50 %; 9.45 to 90.5 %)", "1/1", "-", "-", "0/1"],
        ["diagnosis", "66.7 % (2/3)", "0 % (0/1)", "50 % (1/2)", "0 % (0/1)", "50 % (1/2)"],
        ["random", "100 % (2/2)", "0 % (0/1)", "0 % (0/1)", "100 % (1/1)", "0 % (0/1)"],
        ["drift", "1", "error 1"],
        ["unlisted:ripple", "1", "delay 1"],
        ["b", "unlisted:ripple", "6", "exact", "delay", "70 %", "delay, unlisted", "unlisted"],
        ["a", "creep", "FileNotFoundError: the prediction left no folder with models"],
    ):  # fmt: skip
        assert expected in [row[: len(expected)] for row in rows], expected


def test_rows_of_a_table_have_as_many_cells_as_its_head():
    """Also where a message holds a bar or a line break."""
    text = markdown(score([(a, p, None) for a, p in BANK]))
    for table in re.findall(r"(?:^\|.*\n)+", text, re.M):
        assert len({len(row) for row in rows_of(table)}) == 1
        assert len({len(line) for line in table.splitlines()}) == 1
    assert r"error: Value\|Error: a b" in text


def test_an_empty_bank_is_a_table_too():
    text = markdown(score([]))
    assert "nan" not in text.lower().split()
    assert "None." in text
