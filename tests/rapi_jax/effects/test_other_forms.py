"""Functions that an effect's mechanism may add in another form than its equation."""

import numpy as np
import pytest

from rapi_jax.effects import ALL, Contribution, Pickup

TIME = np.arange(4000) / 5000.0  # s
DRIVE = 3.0 - 2.0 * np.cos(2.0 * np.pi * 10.0 * TIME)  # V


def left(functions: np.ndarray, wanted: np.ndarray) -> float:
    """The part of `wanted` that no sum of `functions` has, rms over rms."""
    sizes = np.linalg.lstsq(functions.T, wanted, rcond=None)[0]
    return float(np.linalg.norm(wanted - sizes @ functions) / np.linalg.norm(wanted))


@pytest.mark.parametrize("harmonic", [1, 2, 3])
def test_harmonics_of_whichever_line_was_found(harmonic):
    """Pulses of 2 ms twice a cycle of 50 Hz: found as the line itself, or as a harmonic of it."""
    number = np.round((TIME - 0.003) / 0.01)
    pulses = np.exp(-(((TIME - 0.003 - 0.01 * number) / 1e-3) ** 2)) * np.where(number % 2, -1, 1)
    found = Pickup.at(amplitude=0.1, hertz=50.0 * harmonic)
    added = 0.1 * np.sin(2.0 * np.pi * 50.0 * harmonic * TIME)
    sets = found.other_forms(Contribution(TIME, DRIVE, added))
    assert left(sets[harmonic - 1], pulses) < 1e-6
    assert harmonic == 1 or left(sets[0], pulses) > 0.1


def test_what_is_slower_than_any_line_has_no_harmonics():
    """Else a drift over the session would be a pickup."""
    slow = Pickup.at(amplitude=0.1, hertz=1.5)
    assert not slow.other_forms(Contribution(TIME, DRIVE, np.sin(9.4 * TIME)))


@pytest.mark.parametrize("cls", ALL, ids=lambda cls: cls.name)
def test_every_effect_says_which_or_none(cls):
    sets = cls.at().other_forms(Contribution(TIME, DRIVE, np.ones(TIME.size)))
    assert all(functions.shape[1] == TIME.size for functions in sets)
    assert bool(sets) == (cls.name == "pickup")
