"""What is missing where no scan separates: the limit that helps, and periods at the least."""

import types

import numpy as np
import pytest
from bare import bare

from fitting.diagnosis.next_scan._rated_scan import RatedScan
from fitting.diagnosis.next_scan._rival_set import RivalSet
from fitting.diagnosis.next_scan._wider_limits import (
    Remedy,
    best_remedy,
    describe_needs,
    doubled_limits,
)
from fitting.diagnosis.which.evidence._tempering import Tempering
from rapi_jax import DriveLimits

LIMITS = DriveLimits(1.0, 5.0, 400.0, max_frequency_hz=50.0)


def rated(log_odds):
    return [types.SimpleNamespace(least_first_log_odds=lambda: log_odds)]


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


def best_scan(power, stake, tempering):
    """A scan of one pair, of which nothing was at stake before."""
    return bare(
        RatedScan,
        rivals=RivalSet([], [], tempering, [], {}, {}),
        first={(0, 1): power, (1, 0): 3.0 * power},
        stake={(0, 1): stake, (1, 0): stake},
        checked={},
    )


EXACT, INEXACT = Tempering(), Tempering(form=0.01)
NONE = "Neither twice the limits nor thousands of periods separate them"


@pytest.mark.parametrize(
    ("power", "stake", "tempering", "remedy", "said"),
    [
        # log odds of ln 19 take a chi-square of 5.89
        (2.95, 0.0, EXACT, None, "At least 10 periods in place of 5 would separate them"),
        (2.95, 1e3, EXACT, None, "At least 10 periods in place of 5 would separate them"),
        (
            2.95,
            0.0,
            EXACT,
            Remedy("slopes up to 800 V/s", np.log(49.0)),
            "With slopes up to 800 V/s the wrong hypothesis would keep about 2 %; "
            "at least 10 periods in place of 5 would separate them",
        ),
        (2.95, 1e3, INEXACT, None, "More periods would not separate them"),
        (1e-6, 0.0, EXACT, None, NONE),
        (0.0, 0.0, EXACT, None, "More periods would not separate them"),
    ],
)
def test_what_it_would_take(power, stake, tempering, remedy, said):
    assert describe_needs(best_scan(power, stake, tempering), 5, remedy) == said
