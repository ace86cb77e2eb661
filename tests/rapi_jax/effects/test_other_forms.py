"""Functions that an effect's mechanism may add in another form than its equation."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

from rapi_jax.effects import (
    ALL,
    Contribution,
    Drift,
    Etalon,
    GainDrift,
    Law,
    Pickup,
    Quantisation,
    RateLaw,
)
from rapi_jax.effects.base._random_walk import random_walk

TIME = np.arange(4000) / 5000.0  # s
DRIVE = 3.0 - 2.0 * np.cos(2.0 * np.pi * 10.0 * TIME)  # V
RESPONSE = 12.0 * DRIVE + 2.0 * np.sin(2.0 * np.pi * 10.0 * TIME)  # GHz
RUN = np.repeat([0, 1], TIME.size // 2)


def contribution(added, beside=lambda effect: np.zeros(TIME.size), rates=(10.0, 10.0)):
    """Of an effect that adds `added` to `RESPONSE`, in two runs."""
    return Contribution(TIME, DRIVE, added, RESPONSE, RUN, np.array(rates), beside)


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
    sets = list(found.other_forms(contribution(added)))
    assert left(sets[harmonic - 1], pulses) < 1e-6
    assert harmonic == 1 or left(sets[0], pulses) > 0.1


def test_what_is_slower_than_any_line_has_no_harmonics():
    """Else a drift over the session would be a pickup."""
    slow = Pickup.at(amplitude=0.1, hertz=1.5)
    assert not slow.other_forms(contribution(np.sin(9.4 * TIME)))


def test_the_series_of_a_wiener_process_has_its_covariance():
    """That of two times is the earlier one."""
    time = np.linspace(2.0, 6.0, 41)
    functions = random_walk(time, 4000)
    covariance = 2.0 / np.pi**2 * functions.T @ functions
    share = (time - 2.0) / 4.0
    np.testing.assert_allclose(covariance, np.minimum.outer(share, share), atol=1e-4)


def test_a_gain_may_change_in_any_way_that_is_slower_than_a_run():
    """With a cycle of the room's temperature, but not from scan to scan."""
    about = 36.0  # GHz: 12 GHz/V at 3 V, about which the loop is symmetrical
    drifting = GainDrift.at(rate=0.01)
    added = 0.01 * TIME * (RESPONSE - about)
    functions = next(iter(drifting.other_forms(contribution(added))))

    def of_the_gain(gain):
        return left(np.vstack([functions, RESPONSE - about]), gain * (RESPONSE - about))

    assert of_the_gain(np.sin(2.0 * np.pi * TIME / 0.7 + 1.0)) < 0.1
    assert of_the_gain(np.sin(2.0 * np.pi * 10.0 * TIME)) > 0.9


def test_a_drift_may_be_any_walk_in_the_session():
    """Simulated step by step; but it does not follow a tone of the mains, within the runs."""
    here = contribution(np.ones(TIME.size))
    walk, _, smooth = Drift.at(amplitude=0.1).other_forms(here)
    steps = np.random.default_rng(0).standard_normal(TIME.size).cumsum()
    assert left(walk, steps - steps[0]) < 0.1
    assert left(smooth, steps.cumsum()) < 1e-3
    assert left(walk, np.sin(2.0 * np.pi * 400.0 * TIME)) > 0.9


def test_noise_about_one_frequency_is_told_from_a_walk():
    """The likelier of the two by the marginal likelihood, of noise that SciPy's resonator made."""
    drift = Drift.at(amplitude=0.1)
    numerator, denominator = signal.iirpeak(30.0, 3.0, fs=5000.0)
    noise = np.random.default_rng(1).standard_normal((3, TIME.size + 20_000))
    hunting = signal.lfilter(numerator, denominator, noise[0])[20_000:]
    walk = noise[1].cumsum()[: TIME.size]

    def likelier_by(wave):
        """Twice the logarithm, a walk against the likeliest of its rivals."""
        wave = wave / np.std(wave) + 0.1 * noise[2, : TIME.size]
        wave -= wave.mean()
        here = contribution(np.ones(TIME.size))
        forms, rivals = drift.other_forms(here), drift.rival_forms(here)
        least = [min(minus_twice_log(f, wave) for f in sets) for sets in (forms, rivals)]
        return least[1] - least[0]

    def minus_twice_log(functions, wave):
        """Of the functions' sizes, at the likeliest of their scales, beside noise of a tenth."""
        functions = functions - functions.mean(axis=1, keepdims=True)
        power, turn = np.linalg.eigh(functions @ functions.T / 0.01)
        along = turn.T @ (functions @ wave) / 0.01
        scales = np.geomspace(1e-6, 1e2, 60)[:, None]
        spread = scales * np.maximum(power, 0.0)
        costs = np.log1p(spread) - scales * along**2 / (1.0 + spread)
        return costs.sum(axis=1).min()

    assert likelier_by(hunting) < -10.0
    assert likelier_by(walk) > 10.0


def test_fringes_of_a_second_cavity():
    """A quarter longer than the one that was found; a line of absorption is none."""
    etalon = Etalon.at(amplitude=0.1, spacing=4.0, phase=0.4)
    added = 0.1 * np.sin(2.0 * np.pi * RESPONSE / 4.0 + 0.4)
    sets = list(etalon.other_forms(contribution(added)))
    second = np.sin(2.0 * np.pi * 1.26 * RESPONSE / 4.0 + 2.0)
    assert min(left(functions, added + 0.08 * second) for functions in sets) < 0.05
    x = (RESPONSE - 37.0) / 1.0
    assert min(left(functions, x / (1.0 + x**2)) for functions in sets) > 0.5


def test_an_error_of_each_level_of_a_converter():
    """Each is asked for beside the rounding, on its own level and on no other."""
    asked = []

    def beside(effect):
        moved = np.asarray(effect(jnp.asarray(TIME), jnp.asarray(rounded))) - rounded
        asked.append(moved)
        return 12.0 * moved

    coarse = Quantisation.at(step=0.25, origin=0.1)
    rounded = np.asarray(coarse(jnp.asarray(TIME), jnp.asarray(DRIVE)))
    (functions,) = coarse.other_forms(contribution(12.0 * (rounded - DRIVE), beside))
    assert len(asked) == len(functions) == np.unique(rounded).size
    np.testing.assert_allclose(np.sum(asked, axis=0), 0.25 * 0.25)
    errors = np.random.default_rng(0).standard_normal(200)
    assert left(functions, errors[np.round((rounded - 0.1) / 0.25).astype(int)]) < 1e-9


def test_too_many_levels_have_no_errors_of_their_own():
    ramp = dataclasses.replace(contribution(0.01 * DRIVE), drive=5.0 * TIME)
    assert not Quantisation.at(step=0.001).other_forms(ramp)
    assert not Quantisation.at(step=0.0).other_forms(contribution(0.0 * DRIVE))


def test_a_threshold_of_its_own_at_each_rate():
    """Each shifts one rate, as the law found leaves it, and no other."""
    law = RateLaw.at(exponent=0.7)
    rates = jnp.array([10.0, 20.0, 40.0])
    moved = []

    def beside(effect):
        change = [
            float(effect(here, jnp.array(3.0)).freq - here.freq)
            for here in (law(Law.of(rate, jnp.array(4.0)), jnp.array(3.0)) for rate in rates)
        ]
        moved.append(change)
        return change[0] * np.sin(TIME) + change[1] * TIME + change[2]

    (functions,) = law.other_forms(contribution(0.1 * DRIVE, beside, rates))
    grown = 10.0 * (np.asarray(rates) / 10.0) ** 0.7
    np.testing.assert_allclose(moved, np.diag(0.1 * grown), rtol=1e-6)
    assert functions.shape == (3, TIME.size)


def test_at_two_rates_the_power_law_is_any_law():
    assert not RateLaw.at(exponent=0.7).other_forms(contribution(0.1 * DRIVE, rates=(10.0, 40.0)))


HAVE_FORMS = {"pickup", "drift", "gain_drift", "etalon", "rate_law", "quantisation"}


@pytest.mark.parametrize("cls", ALL, ids=lambda cls: cls.name)
def test_every_effect_says_which_or_none(cls):
    effect = cls.at(step=0.25) if cls is Quantisation else cls.at()
    here = contribution(np.ones(TIME.size), beside=lambda effect: DRIVE, rates=(10.0, 20.0, 40.0))
    sets = list(effect.other_forms(here))
    assert all(functions.shape[1] == TIME.size for functions in sets)
    assert bool(sets) == (cls.name in HAVE_FORMS)


def test_what_begins_anew_with_each_run_is_told_from_a_drift_of_the_gain():
    """Levels, or what fades in each run; a cycle over runs is neither."""
    shape = RESPONSE - 36.0
    rivals = list(GainDrift.at().rival_forms(contribution(np.ones(TIME.size))))
    since = TIME - np.where(RUN == 0, 0.0, 0.4)

    def least(gain):
        return min(left(rival, gain * shape) for rival in rivals)

    assert least(np.where(RUN == 0, 1.0, -0.5)) < 1e-9
    assert least(np.where(RUN == 0, 1.0, -0.5) * np.exp(-since / 0.2)) < 0.05
    assert least(np.sin(2.0 * np.pi * TIME / 0.3)) > 0.5
