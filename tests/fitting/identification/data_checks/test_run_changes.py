"""Runs that do not belong: the change is named with its runs and its size, and only where it is."""

import numpy as np
import pytest

from fitting.identification._options import solver_options
from fitting.identification._posed import Posed
from fitting.identification.data_checks.runs._change import Change, undo
from fitting.identification.data_checks.runs._change_fault import (
    DIFFERS_WITH_RATE,
    DIFFERS_WITH_TIME,
    runs_apart_in_time,
)
from fitting.identification.data_checks.runs._run_changes import find_changed_runs
from rapi_jax import ECDL, RAPI, predict, triangle
from rapi_jax.internal import float64
from tests.support.spoiled import WAYS, Columns, answers, healthy

OPTIONS = solver_options(120)


@float64
def ended(columns: Columns):
    """The problem of a recording, its weights, and its fit."""
    recording = columns.recording()
    posed = Posed.of(columns.device, recording, None, "hysteresis", history=True, drift=None)
    end = posed.problem.solve(posed.problem.start(columns.device), posed.weight, OPTIONS)
    return posed.problem, posed.weight, end


def solved(problem, start, weight):
    return problem.solve(start, weight, OPTIONS)


def refined(problem, start, weight):
    return problem.refine(start, weight, 60)


@float64
def faults(columns: Columns, fit=solved):
    return find_changed_runs(*ended(columns), fit)


def spoiled(way: str, seed: int = 11) -> Columns:
    columns = healthy(seed)
    WAYS[way](columns)
    return columns


@pytest.mark.parametrize("fit", [solved, refined])
@pytest.mark.parametrize(
    ("way", "runs", "words"),
    [
        ("one run times 1.02", ("run02",), "1.02 times"),
        ("one run times 1.1", ("run02",), "1.1 times"),
        ("sign flipped, one run", ("run02",), "-1 times"),
        ("two devices, 5 % apart", ("run01", "run03"), "1.05 times"),
        ("bias wrong in half of the runs", ("run00", "run02"), "0.3 V"),
        ("one clock wrong", ("run02",), "+25 %"),
    ],
)
def test_the_change_is_named_with_its_runs_and_its_size(way, runs, words, fit):
    (fault,) = faults(spoiled(way), fit)
    assert fault.kind == "run does not belong"
    named = fault.message.split(":")[0]
    assert all((name in named) == (name in runs) for name in ("run00", "run01", "run02", "run03"))
    text = fault.message.replace("0.301", "0.3").replace("0.299", "0.3")
    assert words in text
    assert len(fault.samples) == len(runs)


def test_an_offset_of_one_run_is_named():
    columns = healthy(12)
    columns.response[1] = columns.response[1] + 5.0
    (fault,) = faults(columns)
    assert "'run01'" in fault.message and "+5 GHz" in fault.message
    assert 'response_origin = "run"' in fault.message


@pytest.mark.parametrize("fit", [solved, refined])
@pytest.mark.parametrize("seed", [12, 13])
@pytest.mark.parametrize("row", [0, 3])
def test_an_offset_of_the_first_or_last_run_may_be_a_drift(row, seed, fit):
    columns = healthy(seed)
    columns.response[row] = columns.response[row] + 5.0
    (fault,) = faults(columns, fit)
    assert fault.kind == DIFFERS_WITH_TIME and "a device that drifts" in fault.message
    assert "+5 GHz" in fault.message
    assert runs_apart_in_time(columns.recording(), fault) == [row]


@pytest.mark.parametrize("fit", [solved, refined])
def test_runs_of_which_each_has_its_own_origin(fit):
    """No offset of some runs explains the others': all are said, with how far they lie apart."""
    columns = healthy(12)
    for row, offset in enumerate((0.0, 5.0, 10.0, 15.0)):
        columns.response[row] = columns.response[row] + offset
    (fault,) = faults(columns, fit)
    assert fault.kind == DIFFERS_WITH_TIME and "15 GHz apart" in fault.message
    assert 'response_origin = "run"' in fault.message
    assert runs_apart_in_time(columns.recording(), fault) == [1, 2, 3]


def test_a_late_run_is_named_with_its_lag():
    columns = healthy(13)
    time, y = columns.time[3], columns.response[3]
    columns.response[3] = np.interp(time - 4e-4, time, y, period=1.0 / columns.rates[3])
    (fault,) = faults(columns)
    assert "'run03'" in fault.message and "0.406 ms late" in fault.message  # 0.4, interpolated


@pytest.mark.parametrize("seed", range(20, 26))
def test_a_healthy_recording_has_none(seed):
    assert faults(healthy(seed)) == []


@pytest.mark.parametrize("way", ["drift of 10 GHz", "a lag of 1 ms not stated", "clipped softly"])
def test_what_happens_in_all_runs_is_no_change_of_some(way):
    assert faults(spoiled(way)) == []


def test_runs_of_one_swing_are_left_to_an_amplitude_law():
    columns = healthy(16)
    for row, swing in enumerate((4.5, 3.0, 4.5, 3.0)):
        drive = columns.drive[row]
        columns.drive[row] = 3.0 + (drive - 3.0) * swing / 4.5
        columns.response[row] = answers(columns.device, columns, row)
    for row in (1, 3):
        columns.response[row] = 1.02 * columns.response[row]
    assert faults(columns) == []
    columns.response[1] = columns.response[1] / 1.02  # one of them alone is no law
    (fault,) = faults(columns)
    assert "'run03'" in fault.message and "1.02 times" in fault.message


@pytest.mark.parametrize(("row", "change"), [(0, 1.25), (3, 1.25), (3, 0.8)])
def test_a_run_alone_at_the_end_of_the_rates_may_show_a_law_of_the_device(row, change):
    columns = healthy(17)
    columns.time[row] = columns.time[row] * change
    columns.rates[row] /= change
    (fault,) = faults(columns)
    assert fault.kind == DIFFERS_WITH_RATE and f"'run0{row}'" in fault.message
    assert "as if its rate differed by" in fault.message and "record another" in fault.message


@pytest.mark.parametrize(
    ("gain", "lawful"), [(1.1, True), (0.9, True), (10.0, False), (-1.0, False)]
)
def test_no_law_of_a_device_is_a_wrong_unit_or_sign(gain, lawful):
    columns = healthy(19)
    columns.response[3] = gain * columns.response[3]
    (fault,) = faults(columns)
    assert "'run03'" in fault.message
    assert fault.kind == (DIFFERS_WITH_RATE if lawful else "run does not belong")


def test_one_of_two_runs_at_the_fastest_rate_is_no_law():
    columns = healthy(18)
    columns.time[2], columns.drive[2] = columns.time[3].copy(), columns.drive[3].copy()
    columns.rates[2] = columns.rates[3]
    columns.response[2] = answers(columns.device, columns, 2)
    columns.response[3] = 1.02 * columns.response[3]
    (fault,) = faults(columns)
    assert fault.kind == "run does not belong" and "'run03'" in fault.message


def test_a_gap_that_is_smaller_than_the_noise_asks_for_no_change():
    columns = healthy(14)
    columns.response[2] = columns.response[2] * 1.0002
    assert faults(columns) == []


@pytest.mark.parametrize(
    ("kind", "size"), [("gain", 0.1), ("offset", 3.0), ("bias", 0.2), ("rate", 0.25)]
)
def test_a_change_taken_back_gives_the_healthy_recording(kind, size):
    """What `undo` takes back is what a device would have shown."""
    operator = dict(alpha=0.3, zeta=7e-3, lam=1.5, eta=1.0, a=0.6, b=0.1, d=(18.0, -1.0))
    device = ECDL(RAPI(**operator, plays=10))
    rate = 20.0
    (drive,) = triangle((rate,), amplitude=4.5, bias=3.0, samples=400)
    columns = healthy(15, samples=400, periods=1, noise=0.0)
    columns.time[1], columns.drive[1] = drive.time.copy(), drive.value.copy()
    true = np.asarray(predict(device, drive))
    columns.response[1] = true.copy()
    if kind == "gain":
        columns.response[1] = true * (1.0 + size)
    elif kind == "offset":
        columns.response[1] = true + size
    elif kind == "bias":
        columns.drive[1] = columns.drive[1] - size
    else:
        columns.time[1] = columns.time[1] * (1.0 + size)
        columns.rates[1] = rate / (1.0 + size)
    back = undo(columns.recording(), Change(kind, (1,), size, 1.0)).runs[1]
    np.testing.assert_allclose(back.response, true, rtol=1e-12)
    np.testing.assert_allclose(back.drive.value, drive.value, rtol=1e-12)
    np.testing.assert_allclose(back.drive.time, drive.time, rtol=1e-12)
    assert back.drive.rate == pytest.approx(rate)
