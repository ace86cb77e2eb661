"""An effect made stronger or weaker changes in one parameter, from where it changes nothing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from worlds import TRUTHS, answers, drives

from fitting.diagnosis.detectability._scaled_effect import ScaledEffect
from rapi_jax._precision import float64
from rapi_jax.effects import ALL, AbstractEffect, Delay, ResidualSummary

SESSION = drives(rates=(10.0, 40.0), amplitudes=(2.0, 3.0), periods=2, samples=100)


@pytest.fixture(scope="module")
def clean() -> list[np.ndarray]:
    return answers(SESSION)


@pytest.fixture(scope="module")
def summary(clean) -> ResidualSummary:
    parts = [
        [d.time + d.start_s for d in SESSION],
        [d.value for d in SESSION],
        clean,
        [0.01 * np.sin(40.0 * d.time) for d in SESSION],
        [np.full(d.size, k) for k, d in enumerate(SESSION)],
    ]
    flat = [np.concatenate(part) for part in parts]
    return ResidualSummary(
        *flat,
        rates=tuple(d.rate for d in SESSION),
        u_pp=tuple(d.u_pp for d in SESSION),
        step_s=min(d.step_s for d in SESSION),
        noise=0.01,
        span=float(np.ptp(flat[2])),
    )


@float64
def changed(effect: AbstractEffect, clean: list[np.ndarray]) -> float:
    """By how much the response changes at most, GHz."""
    on_device = jax.tree_util.tree_map(jnp.asarray, effect)
    pairs = zip(answers(SESSION, (on_device,)), clean, strict=True)
    return max(float(np.abs(a - b).max()) for a, b in pairs)


@pytest.mark.parametrize("cls", ALL, ids=lambda cls: cls.name)
def test_without_strength_nothing_changes_and_half_is_in_between(cls, summary, clean):
    guesses = cls.initial_guesses(summary) or [TRUTHS[cls.name]]
    rays = ScaledEffect.along(guesses[0], summary)
    assert rays
    for ray in rays:
        none, half, whole = (ray.at(strength) for strength in (0.0, 0.5, 1.0))
        assert none is not None and half is not None and whole is not None
        name = ray.name
        assert changed(none, clean) < 1e-9
        assert float(getattr(half, name)) == pytest.approx(
            (float(getattr(none, name)) + float(getattr(whole, name))) / 2
        )
        assert ray.value(1.0) == pytest.approx(float(getattr(whole, name)))
        kind = [p for p in ("hertz", "spacing", "damping") if hasattr(whole, p)]
        assert all(float(getattr(none, p)) == float(getattr(whole, p)) for p in kind)


def test_an_effect_beyond_its_bounds_is_none(summary):
    (ray,) = ScaledEffect.along(TRUTHS["delay"], summary)
    assert ray.at(1e6) is None and ray.at(-1.0) is None


def test_each_end_of_a_saturation_is_a_ray_of_its_own(summary):
    cut = TRUTHS["saturation"]
    guess = type(cut).at(low=1.7, high=4.2, knee=0.02)
    rays = {ray.name: ray for ray in ScaledEffect.along(guess, summary)}
    assert set(rays) == {"high", "low", "knee"}
    high = rays["high"].at(1.0)
    assert (float(high.high), float(high.low), float(high.knee)) == (4.2, 1.5, 0.0)


def test_an_effect_of_ones_own_is_scaled_by_its_first_parameter(summary):
    class Own(Delay):
        name = "own"

    (ray,) = ScaledEffect.along(Own.at(tau=1e-4), summary)
    assert (ray.name, ray.value(0.5), Own.mechanism) == ("tau", 5e-5, "own")
