"""The table of how often answers were right: shares with their intervals, and what is left out."""

import pytest

from fitting.report.diagnosis._reliability import tabulate_reliability


def test_a_row_a_bin_with_the_interval_of_its_share():
    parts = [
        {"n": 20, "confidence": 0.62, "right": 0.7},
        {"n": 100, "confidence": 0.985, "right": 0.98},
    ]
    table = tabulate_reliability({"calibration": {"reliability": parts}})
    assert table is not None and len(table.rows) == 2
    # Wilson's interval of 98 in 100, by its formula.
    p, n, z = 0.98, 100, 1.959964
    middle, half = p + z**2 / (2 * n), z * (p * (1 - p) / n + z**2 / (4 * n**2)) ** 0.5
    low, high = ((middle + sign * half) / (1 + z**2 / n) for sign in (-1, 1))
    assert table.rows[1] == ["98.5 %", "100", "98 %", f"{100 * low:.0f} to {100 * high:.0f} %"]


@pytest.mark.parametrize(
    "calibration", [None, {}, {"reliability": []}, {"reliability": [{"n": 0}, "x", {"n": 3}]}]
)
def test_none_where_the_file_has_none(calibration):
    assert tabulate_reliability({"calibration": calibration}) is None
