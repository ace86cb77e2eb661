"""Joint refits: to the truth and never uphill, within bounds, priors and what is held."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from edge_worlds import NOISE, drives, off, record

from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._effect_vector import effect_values, free_parameters
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import parameters
from rapi_jax.effects import AmplifierLowpass, Creep, Etalon, ModeHop, Resonance
from rapi_jax.examples import paper_device

WHITE = Spectrum.of_white(NOISE**2)


def refit_of(recording, operator=None, **options) -> Refit:
    whitened = WhitenedModel.of(recording)
    base = BaseModel.of(whitened, operator or off(0.03))
    return Refit(whitened, whitened.make_whitener(WHITE), base.with_fixed("b"), **options)


@pytest.fixture(scope="module")
def plain() -> Refit:
    return refit_of(record(drives()))


@pytest.fixture(scope="module")
def etalon() -> Refit:
    return refit_of(record(drives(), Etalon(amplitude=0.3, spacing=20.0, phase=0.4)))


def test_three_percent_off_comes_back_to_noise(plain):
    """Chi-square a line within four of its standard errors, sqrt(2 / n), of 1."""
    start = plain.evaluate(plain.base.prior_mean, ())
    end = plain.minimise(start, 40)
    lines = end.errors.synchronous.size
    assert start.synchronous > 100 * lines
    assert abs(end.synchronous / lines - 1.0) < 4.0 * np.sqrt(2.0 / lines)
    base = BaseModel.of(plain.whitened, paper_device().operator)
    assert end.cost < dataclasses.replace(plain, base=base).evaluate(base.prior_mean, ()).cost


def test_steps_never_go_uphill_nor_out_of_bounds(plain):
    rng = np.random.default_rng(0)
    for _ in range(3):
        values = plain.base.prior_mean * (1 + 0.1 * rng.standard_normal(plain.base.prior_mean.size))
        state = plain.evaluate(np.clip(values, plain.base.lower, plain.base.upper), ())
        for _ in range(4):
            new = plain.minimise(state, 1)
            assert new.cost <= state.cost
            assert np.all((new.values >= plain.base.lower) & (new.values <= plain.base.upper))
            state = new


def test_what_is_held_does_not_move(plain):
    names = [p.name for p in parameters(plain.base.operator) for _ in range(p.size)]
    held = dataclasses.replace(plain, base=plain.base.with_fixed("eta", "d"))
    end = held.minimise(held.evaluate(held.base.prior_mean, ()), 5)
    still = np.array([n in ("eta", "d", "b") for n in names])
    np.testing.assert_array_equal(end.values[still], held.base.prior_mean[still])
    assert np.all(end.values[np.array([n in ("lam", "a") for n in names])] != 0)
    assert not np.array_equal(end.values, held.base.prior_mean)


def test_a_narrow_prior_holds_and_a_wide_one_does_not(plain):
    """The prior adds its squares to the cost; 1e-9 of a value outweighs these data."""
    base = plain.base
    tight = dataclasses.replace(base, prior_std=1e-9 * np.maximum(np.abs(base.prior_mean), 1e-3))
    kept = dataclasses.replace(plain, base=tight)
    end = kept.minimise(kept.evaluate(base.prior_mean, ()), 5)
    np.testing.assert_allclose(end.values, base.prior_mean, rtol=1e-5, atol=1e-8)
    wide = dataclasses.replace(
        plain, base=dataclasses.replace(base, prior_std=tight.prior_std * 1e15)
    )
    free = plain.minimise(plain.evaluate(base.prior_mean, ()), 15)
    same = wide.minimise(wide.evaluate(base.prior_mean, ()), 15)
    assert same.synchronous == pytest.approx(free.synchronous, rel=1e-6)
    off_ = wide.evaluate(base.prior_mean + tight.prior_std * 1e15, ())
    assert off_.prior_cost == pytest.approx(base.prior_mean.size)


def test_an_effect_and_the_operator_are_refitted_together(etalon):
    """From half the amplitude: it to 5 %, the spacing to 1 %."""
    start = etalon.evaluate(
        etalon.base.prior_mean, (Etalon(amplitude=0.15, spacing=19.5, phase=0.3),)
    )
    end = etalon.minimise(start, 40)
    lines = end.errors.synchronous.size
    assert abs(end.synchronous / lines - 1.0) < 4.0 * np.sqrt(2.0 / lines)
    (found,) = end.effects
    assert float(found.amplitude) == pytest.approx(0.3, rel=0.05)
    assert float(found.spacing) == pytest.approx(20.0, rel=0.01)


def test_what_jumps_stays_where_it_is_but_for_its_size(etalon):
    still = dataclasses.replace(etalon, freeze_jumps=True)
    hop = ModeHop.at(size=0.2, threshold=70.0, width=1.0, settle_s=1e-9)
    start = still.evaluate(
        still.base.prior_mean, (hop, Etalon(amplitude=0.15, spacing=19.0, phase=0.3))
    )
    end = still.minimise(start, 4)
    before, after = (effect_values(s.effects) for s in (start, end))
    names = [p.path[-1] for effect in start.effects for p in free_parameters(effect)]
    moved = dict(zip(names, after != before, strict=True))
    assert {k for k, v in moved.items() if not v} == {"threshold", "width", "settle_s"}
    columns = still.jacobian_effects(end)
    assert columns[:, 0].any() and not columns[:, 1:4].any()


def test_reach_and_bounds_of_effects_are_kept(etalon):
    ranges = {("etalon", ("spacing",)): (18.9, 19.3), ("etalon", ("amplitude",)): (0.0, 0.2)}
    near = dataclasses.replace(etalon, search_ranges=ranges)
    effect = Etalon(amplitude=0.15, spacing=19.0)
    low, high = near.bounds((effect,))
    state = near.evaluate(near.base.prior_mean, (effect,))
    for _ in range(6):
        state = near.minimise(state, 2)
        now = effect_values(state.effects)
        assert np.all((now >= low) & (now <= high))


@pytest.mark.parametrize(
    ("true", "guess", "bound"),
    [
        (Creep.at(gain=0.03), Creep.at(gain=0.005, fastest_s=4e-3), ("gain", 0.015)),
        (
            Resonance.at(hertz=900.0, damping=0.3, share=0.8),
            Resonance.at(hertz=900.0, damping=0.2, share=0.3),
            ("share", 0.5),
        ),
    ],
    ids=["creep", "resonance"],
)
def test_beside_a_parameter_at_its_bound_the_others_reach_their_minimum(true, guess, bound):
    """As if it were held there; and nothing is tried but steps that lower the cost."""
    name, greatest = bound
    free = refit_of(record(drives(), true))
    near, held = (
        dataclasses.replace(free, search_ranges={(true.name, (name,)): (low, greatest)})
        for low in (0.0, greatest)
    )
    there = dataclasses.replace(guess, **{name: jnp.asarray(greatest)})
    least = held.minimise(held.evaluate(held.base.prior_mean, (there,)), 40).cost
    tried = []

    def take_step(state, step):
        tried.append(step)
        return Refit.take_step(near, state, step)

    object.__setattr__(near, "take_step", take_step)
    end = near.minimise(near.evaluate(near.base.prior_mean, (guess,)), 12)
    assert float(getattr(end.effects[0], name)) == pytest.approx(greatest, rel=1e-3)
    assert end.cost < 1.01 * least
    assert len(tried) <= 12


def test_a_lag_that_is_not_there_goes_towards_zero_and_not_beyond(plain):
    """What is positive by its meaning stays so."""
    start = plain.evaluate(plain.base.prior_mean, (AmplifierLowpass(tau=1e-4),))
    end = plain.minimise(start, 20)
    tau = float(end.effects[0].tau)
    assert 0.0 <= tau < 1e-4


def test_a_refit_at_its_end_stays(plain):
    end = plain.minimise(plain.evaluate(plain.base.prior_mean, ()), 60)
    again = plain.minimise(end, 10)
    assert end.cost - again.cost < 0.5


def test_a_response_in_whose_rounding_the_readings_are_lost_has_no_finite_cost(plain):
    """With an origin of its own a run takes the mean away, and what was lost would fit exactly."""
    recording = dataclasses.replace(record(drives()), response_origin="run")
    refit = refit_of(recording)
    values = refit.base.prior_mean.copy()
    assert np.isfinite(refit.evaluate(values, ()).cost)
    constant = int(np.flatnonzero(values == np.asarray(refit.base.operator.d_0))[0])
    values[constant] = 1e24
    assert refit.evaluate(values, ()).cost == np.inf
