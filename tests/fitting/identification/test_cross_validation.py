"""What each scheme of cross-validation leaves out, sample by sample."""

import numpy as np
import pytest

from fitting.identification.assessment._cross_validation import last_third, schemes
from fitting.identification.problem._problem import Problem
from rapi_jax import Drive, Recording, triangle
from rapi_jax.examples import paper_device

SAMPLES = 60  # a period


def problem_of(drives):
    recording = Recording.of(drives, [drive.value for drive in drives])
    return Problem.of(paper_device(), recording, lambda ecdl: ecdl.operator)


def left_out(problem, left):
    """For each run, the samples of its own that are left out."""
    return [
        set(sample[row].tolist()) for sample, row in zip(problem.data.sample, left, strict=True)
    ]


@pytest.mark.parametrize(("periods", "last"), [(2, 1), (3, 1), (4, 1), (5, 2), (6, 2), (7, 2)])
def test_the_last_third_is_that_of_whole_periods(periods, last):
    (drive,) = triangle(20.0, amplitude=4.0, bias=3.0, samples=periods * SAMPLES, periods=periods)
    problem = problem_of([drive])
    first = (periods - last) * SAMPLES
    assert left_out(problem, last_third(problem.recording, problem)) == [
        set(range(first, periods * SAMPLES))
    ]


def test_without_periods_it_is_that_of_the_samples():
    time = np.arange(90) * 1e-3
    drive = Drive(time, 3.0 + np.sin(30.0 * time) + 20.0 * time, None, "other")
    problem = problem_of([drive])
    assert left_out(problem, last_third(problem.recording, problem)) == [set(range(60, 90))]


def test_rates_and_amplitudes_are_left_out_whole():
    drives = [
        triangle(rate, amplitude=amplitude, bias=3.0, samples=3 * SAMPLES, periods=3)[0]
        for amplitude in (2.0, 4.0)
        for rate in (10.0, 40.0)
    ]
    problem = problem_of(drives)
    whole = set(range(3 * SAMPLES))
    found = {
        name: [k for k, run in enumerate(left_out(problem, left)) if run]
        for name, left, _ in schemes(problem.recording, problem)
    }
    assert found == {
        "last third": [0, 1, 2, 3],
        "rate 10 Hz": [0, 2],
        "rate 40 Hz": [1, 3],
        "swing 2 V": [0, 1],
        "swing 4 V": [2, 3],
        **{f"run run0{i}": [i] for i in range(4)},
    }
    for name, left, _ in schemes(problem.recording, problem):
        for run in left_out(problem, left):
            assert name == "last third" or run in (set(), whole)
