"""Levels: on the instrument's grid, outward, and legal at every step between two pairs."""

import math

import hypothesis.strategies as st
import pytest
from hypothesis import given

from hardware import DriveLimits
from hardware.generator._levels import (
    Levels,
    ceil_level,
    enclosing_levels,
    floor_level,
    park_levels,
    ramp_levels,
    settable_limits,
    setting_order,
)
from hardware.generator._thresholds import THRESHOLDS
from rapi_jax import LimitError

volts = st.floats(-10.0, 10.0)


def settable(value):
    """Whether `value` has at most 4 digits and no more than 0.1 mV."""
    return float(f"{value:.4g}") == value and round(value, 4) == value


@st.composite
def pairs(draw):
    low = floor_level(draw(st.floats(-9.9, 9.9)))
    high = ceil_level(min(10.0, low + THRESHOLDS.park_pp_v + draw(st.floats(0.0, 20.0))))
    return Levels(low, high)


@given(volts)
def test_levels_are_settable_and_enclose(value):
    low, high = floor_level(value), ceil_level(value)
    assert settable(low)
    assert settable(high)
    assert low <= value + 1e-8
    assert high >= value - 1e-8
    assert high - low <= max(1.001e-4, 1.01e-3 * max(abs(value), abs(low), abs(high)))
    assert (math.copysign(1, low), math.copysign(1, high)) == (
        math.copysign(1, low or 1.0),
        math.copysign(1, high or 1.0),
    )


@given(volts, volts)
def test_levels_around_a_drive_stay_within_the_limits(a, b):
    limits = settable_limits(DriveLimits(-10.0, 10.0, 1.0, 1.0, 1.0), 10.0)
    levels = enclosing_levels(min(a, b), max(a, b), limits)
    assert limits.low_v <= levels.low_v <= min(a, b) + 1e-8
    assert limits.high_v >= levels.high_v >= max(a, b) - 1e-8
    assert levels.pp >= THRESHOLDS.park_pp_v - 1e-9


@given(pairs(), pairs())
def test_no_illegal_pair_is_passed(now, then):
    pair = {"low": now.low_v, "high": now.high_v}
    for which in setting_order(now, then):
        pair[which] = then.low_v if which == "low" else then.high_v
        assert pair["high"] - pair["low"] >= 0.002 - 1e-9
    assert pair == {"low": then.low_v, "high": then.high_v}


@given(pairs(), pairs(), st.floats(0.002, 1.0))
def test_a_path_takes_small_legal_steps_between_its_ends(now, then, step_v):
    low, high = min(now.low_v, then.low_v), max(now.high_v, then.high_v)
    before = now
    for levels in ramp_levels(now, then, step_v):
        assert all(settable(level) for level in levels)
        assert low - 1e-12 <= levels.low_v < levels.high_v <= high + 1e-12
        assert levels.pp >= 0.002 - 1e-9
        for old, new in zip(before, levels, strict=True):
            assert abs(new - old) <= step_v + 1.01e-3
        before = levels
    assert before == then


@given(st.floats(-9.0, 9.0), st.floats(0.01, 1.0), volts)
def test_parked_as_near_as_the_limits_allow(low, width, park):
    limits = settable_limits(DriveLimits(low, low + width, 1.0, 1.0, 1.0), 10.0)
    levels = park_levels(park, limits)
    nearest = min(max(park, limits.low_v), limits.high_v)
    assert limits.low_v <= levels.low_v < levels.high_v <= limits.high_v
    assert max(abs(level - nearest) for level in levels) <= 2 * THRESHOLDS.park_pp_v + 2e-3


@pytest.mark.fault(name="a limit is missing", promise="refused by name")
@pytest.mark.parametrize("name", ["slew_v_per_s", "step_v", "max_frequency_hz"])
def test_a_missing_limit_is_refused(name):
    limits = {"slew_v_per_s": 1.0, "step_v": 1.0, "max_frequency_hz": 1.0} | {name: math.inf}
    with pytest.raises(LimitError, match=name):
        settable_limits(DriveLimits(0.0, 5.0, **limits), 10.0)


@pytest.mark.fault(name="limits beyond the instrument", promise="refused")
def test_limits_beyond_the_instrument_are_refused():
    with pytest.raises(LimitError, match="5 V of either sign"):
        settable_limits(DriveLimits(0.0, 7.5, 1.0, 1.0, 1.0), 5.0)


def test_limits_are_rounded_inward_to_what_can_be_set():
    limits = settable_limits(DriveLimits(-0.00005, 4.99996, 1.0, 1.0, 1.0), 10.0)
    assert (limits.low_v, limits.high_v) == (0.0, 4.999)
    limits = settable_limits(DriveLimits(0.00005, 0.99996, 1.0, 1.0, 1.0), 10.0)
    assert (limits.low_v, limits.high_v) == (0.0001, 0.9999)


@pytest.mark.fault(name="a drive that touches its limits but for rounding", promise="within them")
@pytest.mark.parametrize("beyond", [0.0, 1e-7, 1e-5])
def test_levels_of_a_drive_that_touches_its_limits_are_the_limits(beyond):
    limits = DriveLimits(0.5, 4.5, 1.0, 1.0, 1.0)
    levels = enclosing_levels(0.5 - beyond, 4.5 + beyond, limits)
    assert levels == Levels(0.5, 4.5)
