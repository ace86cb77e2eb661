"""What counts as inside what a model was identified from."""

import numpy as np
import pytest

from rapi_jax import (
    ECDL,
    RAPI,
    Drive,
    Identified,
    ModelError,
    NotInvertible,
    Recording,
    compensate,
    linear_scan,
    predict,
    triangle,
)
from rapi_jax.examples import paper_device, paper_recording

SEEN = Identified(0.0, 6.0, 500.0, (10.0, 40.0), (2.0, 5.0))


def drive(swing: float, hz: float = 20.0) -> Drive:
    """A triangle about 3 V."""
    (made,) = triangle(hz, amplitude=swing, bias=3.0, samples=200)
    return made


@pytest.mark.parametrize("swing, inside", [(1.0, False), (1.3, True), (2.4, True), (5.0, True)])
def test_swings_below_what_was_recorded_are_outside(swing: float, inside: bool):
    assert (SEEN.outside(drive(swing)) == []) == inside


@pytest.mark.parametrize(
    "swing, inside", [(1.0, False), (1.3, True), (2.0, True), (2.4, False), (3.2, True)]
)
def test_swings_between_are_outside_where_one_did_not_predict_the_other(swing, inside):
    apart = Identified(0.0, 6.0, 500.0, (10.0, 40.0), (2.0, 5.0), swings_joined=False)
    found = apart.outside(drive(swing))
    assert (found == []) == inside
    if swing == 2.4:
        assert "did not predict the other" in found[0] and "near 2.4" in found[0]


@pytest.mark.parametrize("swing", [0.2, 2.4, 5.0])
def test_no_swing_is_outside_where_none_is_to_be_looked_at(swing):
    without = Identified(0.0, 6.0, 500.0, (10.0, 40.0), (), swings_joined=False)
    assert without.outside(drive(swing)) == []


def test_files_keep_it():
    apart = Identified(0.0, 6.0, 500.0, (10.0, 40.0), (2.0, 5.0), swings_joined=False)
    assert Identified.from_dict(apart.to_dict()) == apart
    older = apart.to_dict()
    del older["swings_joined"], older["drive_unit"]
    assert Identified.from_dict(older) == SEEN


def test_its_unit_is_that_of_the_limits_it_gives():
    servo = Identified(0.0, 6.0, 500.0, (10.0, 40.0), (2.0, 5.0), drive_unit="um")
    assert Identified.from_dict(servo.to_dict()).limits().unit == "um"
    assert SEEN.limits().unit == "V"


def test_rates_beyond_are_outside():
    assert "60 Hz" in SEEN.outside(drive(3.0, 60.0))[0]


@pytest.mark.parametrize("hz", [0.1, 20.0, 5000.0])
def test_any_rate_is_beyond_a_recording_that_has_none(hz):
    without = Identified(0.0, 6.0, 500.0, (), (5.0,))
    assert without.outside(drive(5.0, hz)) == [
        f"the scan rate is {hz:g} Hz, the model was identified at none"
    ]


@pytest.mark.parametrize("bias, inside", [(3.0, True), (3.9, False), (2.1, False), (3.25, True)])
def test_a_drive_beyond_one_end_of_the_range_is_outside(bias, inside):
    """A twentieth of the range more is let through at either end."""
    (moved,) = triangle(20.0, amplitude=5.0, bias=bias, samples=200)
    found = Identified(0.5, 5.5, 500.0, (10.0, 40.0), (5.0,)).outside(moved)
    assert (found == []) == inside
    assert inside or "the model was identified from 0.5 to 5.5" in found[0]


@pytest.mark.parametrize("extrapolate", [False, True])
def test_a_drive_that_only_its_own_smallness_makes_work_is_refused(extrapolate):
    """Plays of 4.1 less a line of 3.1: at the recorded swing the response falls after each turn.

    Drives of some millivolts, at which all thresholds are below zero, answer any span.
    """
    operator = RAPI(
        alpha=1.428, zeta=-0.00211, lam=1.0, eta=1.0, a=4.12, b=14.5, d=(-3.12, 0.01, 0.31),
        plays=10,
    )  # fmt: skip
    (recorded,) = triangle([50.0], amplitude=1.6, bias=0.0, samples=400)
    device = ECDL(operator)
    seen = Identified.of(Recording.of([recorded], [np.asarray(predict(device, recorded))]))
    (target,) = linear_scan(50.0, span=1.0, samples=512)
    with pytest.raises(NotInvertible, match=r"at 1.6 V peak to peak.*slope down to -3.12"):
        compensate(device, target, identified=seen, extrapolate=extrapolate)
    own, _ = paper_recording(samples=100)  # an inverse at all thresholds: too small, and said so
    (small,) = linear_scan(20.0, span=10.0, samples=512)
    with pytest.raises(ModelError, match="the drive swings by"):
        compensate(paper_device(), small, identified=Identified.of(own))
