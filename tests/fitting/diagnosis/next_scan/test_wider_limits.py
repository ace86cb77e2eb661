"""What is missing where no scan separates: the limit that helps, and periods at the least."""

import types

import pytest

from fitting.diagnosis.next_scan._wider_limits import (
    Remedy,
    best_remedy,
    describe_needs,
    doubled_limits,
)
from rapi_jax import DriveLimits

LIMITS = DriveLimits(1.0, 5.0, 400.0, max_frequency_hz=50.0)


def rated(power):
    return [types.SimpleNamespace(first={(0, 1): power, (1, 0): 3.0 * power})]


def test_one_limit_at_a_time_is_doubled():
    found = dict(doubled_limits(LIMITS))
    assert list(found) == [
        "a range from -1 to 7 V", "slopes up to 800 V/s", "scan rates up to 100 Hz",
    ]  # fmt: skip
    for words, wider in found.items():
        same = [getattr(wider, f) == getattr(LIMITS, f) for f in ("high_v", "slew_v_per_s")]
        assert same == ["range" not in words, "slopes" not in words]


def test_the_limit_that_helps_most_is_named():
    def rate(limits):
        return rated(2.0 if limits.high_v > 5.0 else 7.0 if limits.slew_v_per_s > 400.0 else 1.0)

    assert best_remedy(LIMITS, rate, 1.0) == Remedy("slopes up to 800 V/s", 7.0)
    assert best_remedy(LIMITS, rate, 5.0) is None
    assert best_remedy(LIMITS, lambda limits: [], 1.0) is None


@pytest.mark.parametrize(
    ("power", "remedy", "said"),
    [
        (4.5, None, "10 periods in place of 5 are the least"),
        (
            4.5,
            Remedy("slopes up to 800 V/s", 16.0),
            "slopes up to 800 V/s would make it some 4; 10 periods in place of 5 are the least",
        ),
        (1e-6, None, "neither twice the limits nor thousands of periods separate them"),
        (0.0, None, "neither twice the limits nor thousands of periods separate them"),
    ],
)
def test_what_it_would_take(power, remedy, said):
    assert describe_needs(power, 5, remedy) == said
