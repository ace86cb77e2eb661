"""Limits of a drive: what a plain loop refuses is refused, and nothing else."""

import numpy as np
import pytest

from rapi_jax import Drive, DriveLimits, LimitError
from rapi_jax._limits import closing_step


def drive(value, rate=10.0, **fields):
    size = np.size(value)
    return Drive(np.arange(size) / (size * rate), value, rate, "triangle", **fields)


TRIANGLE = 3.0 + 2.0 * (1.0 - 2.0 * np.abs(1.0 - 2.0 * np.arange(1000) / 1000))


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        (DriveLimits(1.5, 7.0, 1e3), r"125 sample\(s\) beyond `low_v` = 1.5 V.*sample 0: 1 V"),
        (DriveLimits(0.0, 4.5, 1e3), r"beyond `high_v` = 4.5 V.*worst at sample 500: 5 V"),
        (DriveLimits(0.0, 7.0, 79.9), r"after sample \d+ is 80 V/s, but `slew_v_per_s` is 79.9"),
        (DriveLimits(0.0, 7.0, 1e3, 0.0079), r"after sample \d+ is 0.008 V, but `step_v`"),
        (DriveLimits(0.0, 7.0, 1e3, 1.0, 9.0), r"scan rate is 10 Hz, but `max_frequency_hz` is 9"),
    ],
)
def test_every_limit_refuses_with_sample_value_and_limit(limits, message):
    with pytest.raises(LimitError, match=message):
        limits.check(drive(TRIANGLE))


def test_limits_let_what_touches_them_pass():
    DriveLimits(1.0, 5.0, 80.0, 0.008, 10.0).check(drive(TRIANGLE))


def test_the_step_that_closes_the_period_is_checked():
    ramp = np.linspace(1.0, 5.0, 1000)
    with pytest.raises(LimitError, match="that closes the period is 4 V"):
        DriveLimits(0.0, 7.0, 1e6, 0.1).check(drive(ramp))
    DriveLimits(0.0, 7.0, 1e6, 0.1).check(Drive(np.arange(1000) / 1e4, ramp, None))


@pytest.mark.parametrize("seed", range(5))
def test_random_drives_pass_exactly_when_every_sample_and_step_does(seed):
    """A plain loop decides 400 random drives a seed."""
    rng = np.random.default_rng(seed)
    seen = set()
    for _ in range(400):
        value = (
            3.0
            + rng.uniform(0.1, 3.2) * np.cos(2 * np.pi * (np.arange(64) / 64 + rng.random()))
            + rng.normal(0, rng.choice([0.0, 0.01, 0.2]), 64)
        )
        limits = DriveLimits(0.0, 6.0, float(rng.uniform(50, 800)), float(rng.uniform(0.1, 1.0)))
        step_s = 1 / 640.0
        steps = [abs(value[(i + 1) % 64] - value[i]) for i in range(64)]
        legal = all(0.0 <= v <= 6.0 for v in value) and all(
            s <= limits.step_v and s <= limits.slew_v_per_s * step_s for s in steps
        )
        try:
            limits.check(drive(value))
            assert legal
        except LimitError:
            assert not legal
        seen.add(legal)
    assert seen == {True, False}


@pytest.mark.parametrize(
    "wrong",
    [
        (5.0, 1.0, 10.0),
        (0.0, np.inf, 10.0),
        (0.0, 1.0, 0.0),
        (0.0, 1.0, -5.0),
        (np.nan, 1.0, 10.0),
        (0.0, 1.0, np.nan),
    ],
)
def test_limits_that_are_none_are_refused(wrong):
    with pytest.raises(ValueError, match="imits|low_v|slew"):
        DriveLimits(*wrong)


FALL = np.r_[1.0, np.linspace(1.0, 5.0, 97), 3.0, 1.0]  # rises slowly, falls by 2 V a sample
EARLY = np.r_[1.0, 3.0, np.full(97, 3.0), 1.5]  # the first step is the largest


@pytest.mark.fault(name="a drive a little beyond one limit", promise="refused whole")
@pytest.mark.parametrize(
    ("value", "rate", "limits", "message"),
    [
        (TRIANGLE, 10.0, DriveLimits(0.0, 4.998, 1e3), "high_v"),
        (TRIANGLE, 10.0, DriveLimits(1.002, 6.0, 1e3), "low_v"),
        (TRIANGLE, 10.0, DriveLimits(0.0, 7.0, 1e3, 1.0, 9.9), "max_frequency_hz"),
        (FALL, 10.0, DriveLimits(0.0, 7.0, 1e6, 1.9), "step_v"),
        (FALL, 10.0, DriveLimits(0.0, 7.0, 1.9e3), "slew_v_per_s"),
        (EARLY, 10.0, DriveLimits(0.0, 7.0, 1e6, 1.9), "after sample 0"),
    ],
)
def test_a_little_beyond_one_limit_is_refused(value, rate, limits, message):
    with pytest.raises(LimitError, match=message):
        limits.check(drive(value, rate))


def test_a_record_that_ends_within_a_period_closes_where_the_next_sample_falls():
    """Ten and a half periods of a sine at 21 samples for two: the next one lies half-way."""
    step_s = 2.0 / 21.0 / 10.0
    time = np.arange(110) * step_s
    record = Drive(time, 3.0 + np.sin(2 * np.pi * 10.0 * time), 10.0, "sine")
    cycles = 110 * 2.0 / 21.0
    expected = np.interp(cycles % 1.0 / 10.0, time, record.value) - record.value[-1]
    assert closing_step(record) == pytest.approx(expected, abs=1e-12)
    assert abs(closing_step(record) - (record.value[0] - record.value[-1])) > 0.1
