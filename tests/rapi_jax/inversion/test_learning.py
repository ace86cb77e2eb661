"""Learning control on the paper's device, by its model: from nothing to the noise."""

import numpy as np
import pytest

from rapi_jax import DataError, Drive, DriveLimits, LimitError, Run, linear_scan, predict, triangle
from rapi_jax.examples import paper_device
from rapi_jax.inversion._learning import learn

LIMITS = DriveLimits(0.0, 7.5, 2000.0)
NOISE = 2e-3  # GHz
(TARGET,) = linear_scan(10.0, span=75.0, samples=4096)
(START,) = triangle(10.0, amplitude=4.5, bias=3.0)


def device(noise=NOISE, lag_s=0.0, seed=0):
    """A measurement: the model's response, late by `lag_s`, with white noise."""
    rng = np.random.default_rng(seed)
    ecdl = paper_device()

    def measure(drive):
        nu = np.asarray(predict(ecdl, drive))
        at = np.arange(nu.size) - lag_s * drive.rate * nu.size
        late = np.interp(at, np.arange(nu.size), nu, period=nu.size)
        return Run(drive, late + noise * rng.standard_normal(nu.size))

    return measure


def test_it_learns_down_to_the_noise():
    course = learn(device(), TARGET, START, limits=LIMITS, iterations=12, bandwidth_hz=2000.0)
    assert course.stopped == "done"
    assert len(course.runs) == 13
    first, last = course.rms_ghz[0], course.rms_ghz[course.best]
    assert first[0] > 0.4
    assert first[1] > 3.0
    assert last.max() < 1.5 * NOISE
    assert np.all(np.diff(course.rms_ghz[:6], axis=0) < 0)
    assert course.error_ghz[course.best] < 0.02 * course.error_ghz[0]
    assert course.drive is course.runs[course.best].drive
    LIMITS.check(course.drive)


def test_the_default_bandwidth_reaches_what_lies_within_it():
    course = learn(device(), TARGET, START, limits=LIMITS, iterations=12)
    assert course.rms_ghz[course.best].max() < 5e-3


def test_a_good_start_is_kept_and_improved():
    better = learn(device(), TARGET, START, limits=LIMITS, iterations=4, bandwidth_hz=1000.0)
    again = learn(
        device(seed=1), TARGET, better.drive, limits=LIMITS, iterations=4, bandwidth_hz=1000.0
    )
    assert again.rms_ghz[0].max() < 0.05
    assert again.rms_ghz[again.best].max() < 0.2 * again.rms_ghz[0].max()


@pytest.mark.parametrize("lag", [1e-4, 1e-3])
def test_a_lag_is_seen_and_allowed_for(lag):
    course = learn(device(lag_s=lag), TARGET, START, limits=LIMITS, iterations=12)
    assert course.lead_s == pytest.approx(lag, abs=2e-5)
    assert course.rms_ghz[course.best].max() < 8e-3


def test_a_gain_too_large_is_noticed_and_the_best_kept():
    wide = DriveLimits(-20.0, 30.0, 1e6)  # else the drive is refused before it is seen to diverge
    course = learn(device(), TARGET, START, limits=wide, iterations=30, gain=2.6)
    assert course.stopped == "diverged"
    assert "nonlinearity" in course.reason
    assert len(course.runs) < 31
    both = np.hypot(*course.rms_ghz.T)
    assert course.best == np.argmin(both)
    assert both[-1] > 1.5 * both[course.best]


def test_a_drive_beyond_the_limits_is_never_played():
    tight = DriveLimits(0.7, 5.3, 2000.0)  # the triangle fits, its straight scan does not
    played = []

    def measure(drive):
        played.append(drive)
        return device()(drive)

    (wide,) = linear_scan(10.0, span=85.0, samples=4096)
    course = learn(measure, wide, START, limits=tight, iterations=20)
    assert course.stopped == "limits"
    assert "refused" in course.reason
    assert len(played) == len(course.runs)
    for drive in played:
        tight.check(drive)
    with pytest.raises(LimitError, match="high_v"):
        learn(measure, wide, START, limits=DriveLimits(0.7, 5.0, 2000.0))


def test_masked_readings_are_bridged():
    def measure(drive):
        run = device()(drive)
        holes = run.response.copy()
        holes[500:520] = np.nan
        return Run(drive, holes)

    course = learn(measure, TARGET, START, limits=LIMITS, iterations=8)
    assert course.rms_ghz[course.best].max() < 0.02


def test_refusals():
    (other,) = triangle(20.0, amplitude=4.5, bias=3.0)
    with pytest.raises(DataError, match="20 Hz"):
        learn(device(), TARGET, other, limits=LIMITS)
    with pytest.raises(DataError, match="repeats"):
        learn(device(), TARGET, Drive(START.time, START.value), limits=LIMITS)
    with pytest.raises(DataError, match="samples"):
        learn(lambda d: device()(START), TARGET, START, limits=LIMITS)
    with pytest.raises(ValueError, match="bandwidth_hz"):
        learn(device(), TARGET, START, limits=LIMITS, bandwidth_hz=0.0)
