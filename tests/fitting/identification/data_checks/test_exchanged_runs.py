"""Readings copied from one run to another, or exchanged between runs."""

import numpy as np
import pytest

from fitting.identification._options import solver_options
from fitting.identification._posed import Posed
from fitting.identification.data_checks.runs._exchanged_runs import (
    find_copied_readings,
    find_exchanged_runs,
)
from rapi_jax import ECDL, RAPI
from rapi_jax.internal import float64
from tests.support.spoiled import WAYS, healthy

OPTIONS = solver_options(120)


def solved(problem, start, weight):
    return problem.solve(start, weight, OPTIONS)


def refined(problem, start, weight):
    return problem.refine(start, weight, 60)


@float64
def exchanged(columns, fit=solved):
    recording = columns.recording()
    model = ECDL(RAPI.guess(recording))
    posed = Posed.of(model, recording, None, "hysteresis", history=True, drift=None)
    end = posed.problem.solve(posed.problem.start(model), posed.weight, OPTIONS)
    return find_exchanged_runs(posed.problem, posed.weight, end, fit)


@pytest.mark.parametrize("fit", [solved, refined])
def test_responses_in_the_reverse_order_are_put_right(fit):
    columns = healthy(31)
    WAYS["responses in another order"](columns)
    (fault,) = exchanged(columns, fit)
    assert fault.kind == "exchanged runs"
    for one, other in (("run00", "run03"), ("run01", "run02")):
        assert f"run '{one}' has the readings of '{other}'" in fault.message
        assert f"run '{other}' has the readings of '{one}'" in fault.message


def test_one_pair_is_found():
    columns = healthy(32)
    columns.response[1], columns.response[3] = columns.response[3], columns.response[1]
    (fault,) = exchanged(columns)
    assert (
        "run 'run01' has the readings of 'run03'" in fault.message
        and "'run00'" not in fault.message
    )


@pytest.mark.parametrize("seed", [33, 34])
def test_a_healthy_recording_is_left_in_its_order(seed):
    assert exchanged(healthy(seed)) == []


def test_copied_readings_are_named_by_their_runs():
    columns = healthy(35)
    columns.response[3] = columns.response[0].copy()
    (fault,) = find_copied_readings(columns.recording())
    assert "'run00' and 'run03'" in fault.message and fault.run == "run03"


def test_equal_readings_under_equal_drives_are_repeats():
    columns = healthy(36, noise=0.0)
    for values in (columns.time, columns.drive, columns.response, columns.rates):
        values[3] = values[0] if isinstance(values[0], float) else values[0].copy()
    assert find_copied_readings(columns.recording()) == []


def test_masked_readings_of_copies_are_equal():
    columns = healthy(37)
    columns.response[0][5] = np.nan
    columns.response[3] = columns.response[0].copy()
    assert len(find_copied_readings(columns.recording())) == 1
