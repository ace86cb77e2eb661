"""Recordings with faults that are fitted: everything is written, and the verdict says why not.

Figures of detection are in `tests/README.md`.
"""

import pytest
from bad_input import FAST, clipped, constant, data, entry, hopped, put, scale, unrelated
from bad_rows import MASK, Row, check_row

NAN, INF = float("nan"), float("inf")


ROWS = (
    Row("NaN in readings, masked", data(put(1, 2, slice(57, 60), NAN)), 0, (), MASK),
    Row("Inf in readings, masked", data(put(0, 2, [9, 150], INF)), 0, (), MASK),
    Row(
        "constant drive",
        data(constant(1, 3.0)),
        4,
        ("unidentifiable", "lam", "d_1", "no drive", "run00", "rests at 3"),
    ),
    Row(
        "constant reading", data(constant(2, 3.0)), 4, ("no signal", "no reading", "run00", "cable")
    ),
    Row(
        "one reading constant",
        data(put(0, 2, slice(None), 3.0)),
        4,
        ("no reading", "run00", "rests at 3", "cable"),
        FAST,
        ((0, 199),),
    ),
    Row(
        "clock in ms",
        data(scale(0, 1e3)),
        4,
        ("wrong period", "run00", "10 Hz", "factor of 1000", "`time_s` must be in s"),
    ),
    Row(
        "clipped above",
        data(clipped(None, 0.9)),
        4,
        ("clipped", "run00", "samples", "input range"),
        FAST,
        (),
    ),
    Row(
        "clipped below", data(clipped(0.1, None)), 4, ("clipped", "run00", "input range"), FAST, ()
    ),
    Row(
        "clipped on both sides",
        data(clipped(0.1, 0.9)),
        4,
        ("clipped", "run00", " and at "),
        FAST,
        (),
    ),
    Row(
        "mode hop",
        data(hopped(2.0, 130)),
        4,
        ("mode hop", "run00", "sample 130", "bias or current"),
        FAST,
        ((130, 130),),
    ),
    Row(
        "mode hop and back",
        data(hopped(-3.0, 60, 75)),
        4,
        ("mode hop", "run00", "samples 60, 75"),
        FAST,
        ((60, 60), (75, 75)),
    ),
    Row(
        "rate said 1.25 times too high",
        data(entry(excitation_hz=12.5)),
        4,
        ("wrong period", "run00", "12.5 Hz", "repeats at about 10 Hz"),
        FAST,
        ((0, 199),),
    ),
    Row(
        "rate said half",
        data(entry(excitation_hz=5.0)),
        4,
        ("wrong period", "run00", "about 10 Hz"),
        FAST,
        ((0, 199),),
    ),
    Row(
        "rate said double",
        data(entry(excitation_hz=20.0)),
        4,
        ("wrong period", "run00", "about 10 Hz"),
        FAST,
        ((0, 199),),
    ),
    Row(
        "rate in mHz",
        data(entry(excitation_hz=10_000.0)),
        4,
        ("wrong period", "run00", "10000 Hz", "factor of 1000"),
        FAST,
        ((0, 199),),
    ),
    Row("readings are noise", data(unrelated("noise")), 4, ("nothing explained", "wiring")),
    Row(
        "readings follow something else",
        data(unrelated("sine")),
        4,
        ("nothing explained", "wiring"),
    ),
    Row(
        "one start only",
        data(lambda r: None),
        4,
        ("one start only", "local minimum"),
        ("--each", "none", "--starts", "1", "--no-plots"),
    ),
)


@pytest.mark.fault(
    name=lambda row: row.name,
    promise=lambda row: f"exit {row.code}, everything written, the reason: " + ", ".join(row.words),
    seed=7,
)
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_recording(row, rapi, tmp_path):
    check_row(row, rapi, tmp_path)
