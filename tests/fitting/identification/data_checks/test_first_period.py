"""A first period from rest is named; settled, drifting and noisy recordings are not."""

import dataclasses

import numpy as np
import pytest

from fitting.identification.data_checks._data_checks import find_faults
from fitting.identification.data_checks._first_period import first_period_miss
from rapi_jax import Recording, Run, predict, triangle
from rapi_jax.examples import paper_device

SAMPLES = 300


def run(periods: int, noise: float = 0.02, seed: int = 0) -> Run:
    """A triangle of the paper's device, which begins settled, from its minimum on."""
    (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=SAMPLES * periods, periods=periods)
    rng = np.random.default_rng(seed)
    clean = np.asarray(predict(paper_device(), drive))
    return Run(drive, clean + noise * rng.standard_normal(drive.size))


def from_rest(settled: Run, share: float) -> Run:
    """The response begins `share` of its span high and comes down within the first period."""
    offset = share * settled.span * np.exp(-np.arange(settled.drive.size) / (0.2 * SAMPLES))
    return Run(settled.drive, settled.response + offset)


@pytest.mark.parametrize("periods", [1, 2, 5])
def test_a_start_from_rest_is_named_with_its_size(periods):
    rest = from_rest(run(periods), 0.1)
    faults = [f for f in find_faults(Recording((rest,))) if f.kind == "unsettled start"]
    (fault,) = faults
    # A record of one period ends a sample before the next begins, which is allowed for.
    size = "9.8 % of its span" if periods > 1 else " % of its span"
    assert size in fault.message
    assert ("cut the first one off" in fault.message) == (periods > 1)
    assert ("the reading drifts" in fault.message) == (periods == 1)
    np.testing.assert_allclose(
        abs(first_period_miss(rest)), 0.098 * rest.span, rtol=0.01 if periods > 1 else 0.15
    )
    assert fault.samples == ((0, SAMPLES - 1),)


def test_a_period_shorter_than_a_sample_has_no_first_one():
    settled = run(3)
    drive = dataclasses.replace(settled.drive, time=1e3 * settled.drive.time)
    assert first_period_miss(Run(drive, settled.response)) == 0.0


@pytest.mark.parametrize("noise", [0.0, 0.02, 1.0])
@pytest.mark.parametrize("periods", [1, 2, 5])
def test_settled_runs_are_not_accused(periods, noise):
    for seed in range(20):
        assert first_period_miss(run(periods, noise, seed)) == 0.0


@pytest.mark.parametrize("periods", [1, 3])
def test_one_step_of_a_converter_is_no_start_and_several_are_one(periods):
    """A converter of 20 steps over the span, of which one is 5 % of it."""
    settled = run(periods, 0.0)
    step = settled.span / 20.0
    read = step * np.floor(settled.response / step)
    last = read[min(SAMPLES, read.size - 1)]
    read[0] = last - step
    assert first_period_miss(Run(settled.drive, read)) == 0.0
    read[0] = last - 3.0 * step
    np.testing.assert_allclose(first_period_miss(Run(settled.drive, read)), 3.0 * step)
    faults = find_faults(Recording((Run(settled.drive, read),)))
    assert "unsettled start" in [fault.kind for fault in faults]


def test_a_drift_that_goes_on_is_no_start():
    settled = run(4)
    drift = 0.03 * settled.span * np.arange(settled.drive.size) / SAMPLES
    assert first_period_miss(Run(settled.drive, settled.response + drift)) == 0.0


@pytest.mark.parametrize("missing", [5, 3 * SAMPLES // 2, 3 * SAMPLES - 1])
def test_a_reading_that_is_missing_elsewhere_hides_no_start(missing):
    rest = from_rest(run(3), 0.1)
    masked = rest.response.copy()
    masked[missing] = np.nan
    found = first_period_miss(Run(rest.drive, masked))
    np.testing.assert_allclose(found, first_period_miss(rest), rtol=1e-3)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("count", [1, 5, 20, 100])
def test_readings_that_are_missing_at_a_period_s_ends_accuse_no_settled_run(count, seed):
    settled = run(3, 0.02, seed)
    for place in (0, SAMPLES - count // 2):
        masked = settled.response.copy()
        masked[place : place + count] = np.nan
        assert first_period_miss(Run(settled.drive, masked)) == 0.0


def test_measured_periods_are_settled(shared_data):
    from rapi_jax.io import read_recording

    (identify,) = read_recording(shared_data / "picma_1hz").runs
    assert first_period_miss(identify) == 0.0
