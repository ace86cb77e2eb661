"""Single readings far from their neighbours are left out and listed; nothing else is."""

import numpy as np
import pytest

from fitting import fit
from fitting.identification._posed import Posed
from fitting.identification.data_checks._outliers import find_outliers
from rapi_jax import predict
from tests.support.spoiled import WAYS, healthy


def residual(columns):
    """The problem, and the residual of the true device."""
    recording = columns.recording()
    posed = Posed.of(columns.device, recording, None, "uniform", history=True, drift=None)
    problem = posed.problem
    error = np.zeros(problem.data.y.shape)
    for row, run in enumerate(recording.runs):
        there = problem.data.sample[row] >= 0
        clean = np.asarray(predict(columns.device, run.drive))
        error[row, there] = (clean - run.response)[problem.data.sample[row, there]]
    return problem, error


def places(columns):
    found = find_outliers(*residual(columns))
    return [np.flatnonzero(out).tolist() for out in found]


@pytest.mark.parametrize("seed", range(4))
def test_noise_has_none(seed):
    assert places(healthy(seed)) == [[], [], [], []]


def test_spikes_are_found_where_they_are():
    columns = healthy(41)
    columns.response[0][[7, 555]] += [3.0, -2.0]
    columns.response[2][[600, 601]] += 5.0  # two in a row
    assert places(columns) == [[7, 555], [], [600, 601], []]


def test_a_jump_is_no_outlier():
    columns = healthy(42)
    columns.response[1][500:] += 2.0
    assert places(columns) == [[], [], [], []]


def test_a_longer_excursion_is_no_outlier():
    columns = healthy(43)
    columns.response[1][500:503] += 2.0
    assert places(columns) == [[], [], [], []]


def test_what_comes_back_in_each_period_is_no_outlier():
    columns = healthy(44)
    columns.response[1][[100, 500, 900]] += 2.0  # periods of 400 samples
    assert places(columns) == [[], [], [], []]


@pytest.mark.parametrize("at", [[100, 500], [100, 901]])
def test_two_at_one_phase_by_accident_are_outliers(at):
    columns = healthy(44)  # three periods: what they have in common comes back twice
    columns.response[1][at] += 2.0
    assert places(columns) == [[], at, [], []]


@pytest.mark.parametrize("way", ["one spike", "ten spikes"])
def test_a_fit_without_them_is_that_of_the_healthy_recording(way):
    clean, columns = healthy(45), healthy(45)
    WAYS[way](columns)
    good, found = (fit(c.device, c.recording(), starts=2, guess=False) for c in (clean, columns))
    assert found.verdict.trusted and good.verdict.trusted
    faults = [fault for fault in found.faults if fault.kind == "outliers"]
    assert len(faults) == 1 and faults[0].left_out and faults[0].run == "run02"
    assert any(note.startswith("outliers:") for note in found.verdict.notes)
    count = {"one spike": 1, "ten spikes": 10}[way]
    assert sum(last - first + 1 for first, last in faults[0].samples) == count
    assert found.rmse == pytest.approx(good.rmse, rel=5e-3)
    for one, other in zip(found.parameters, good.parameters, strict=True):
        # A fit ends where less than 0.05 of chi-square is left to gain: 0.22 standard errors each.
        assert abs(one.value - other.value) < 0.5 * max(other.stderr, 1e-12) or one.held
    assert sum(not used.all() for used in found.used) == 1  # left out, and said so
    assert found.recording.runs[2].valid.all()  # the recording itself is as it was


def test_many_are_a_fault_of_the_readout():
    columns = healthy(46)
    rng = np.random.default_rng(0)
    at = rng.choice(columns.time[2].size, 40, replace=False)
    columns.response[2][at] += rng.choice([-1.0, 1.0], 40) * 8.0
    result = fit(columns.device, columns.recording(), starts=2, guess=False, throw=False)
    assert not result.verdict.trusted
    assert any("no accident" in reason for reason in result.verdict.reasons)
