"""Plays over monotone stretches: equal to a loop over samples, and so are their derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax.plays._monotone_stretches import (
    Stretches,
    find_stretches,
    stretches_on_device,
    turning_places,
)
from rapi_jax.plays._play import memory

CASES = range(12)


def loop(u, r, lam, eta, p, start, bow=0.0, u_0=0.0):
    """The recursion of Eq. 9, a sample at a time; `max` outermost."""
    value, out = np.array(start, float), np.zeros(u.size)
    for n, x in enumerate(u):
        value = np.maximum(x - r, np.minimum(lam * x + eta * r + bow * (x - u_0) ** 2, value))
        out[n] = p @ value
    return out


def case(seed):
    """A drive of few turns and operators with ordinary, crossed and flat bands, bent or not."""
    rng = np.random.default_rng(seed)
    size, turns = int(rng.integers(300, 900)), int(rng.integers(1, 15))
    knots = np.r_[0, np.sort(rng.choice(np.arange(1, size - 1), turns, replace=False)), size - 1]
    u = np.interp(np.arange(size), knots, rng.uniform(-1.0, 5.0, knots.size))
    u = np.round(u, 1) if seed % 3 == 0 else u  # with many equal samples in a row
    count = int(rng.integers(1, 40))
    sizes = [
        (-0.5, 1.5),
        (0.0, 2.0),
        (-1.0, 2.0),
        (-2.0, 2.0),
        (-3.0, 3.0),
    ]  # r, lam, eta, p, start
    operator = [rng.uniform(*between, count) for between in sizes]
    return u, operator + ([0.02, -2.0] if seed % 4 == 0 else [])


def stretches_of(u):
    found = stretches_on_device(u[None, :])
    assert found is not None
    return Stretches(found.turn[0], found.index[0])


@pytest.mark.parametrize("seed", CASES)
def test_the_sum_of_plays_is_that_of_the_loop(seed):
    u, operator = case(seed)
    given = [jnp.asarray(x) for x in (u, *operator)]
    got = memory(*given, stretches=stretches_of(u))
    expected = loop(u, *operator)
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("transform", [jax.jacfwd, jax.jacrev])
@pytest.mark.parametrize("seed", CASES[:4])
def test_derivatives_are_those_of_the_recursion_over_samples(seed, transform):
    u, operator = case(seed)
    given, places = [jnp.asarray(x) for x in (u, *operator)], tuple(range(1, 1 + len(operator)))

    def by(stretches):
        return jax.jit(transform(lambda *x: memory(*x, stretches=stretches), argnums=places))

    for one, other in zip(by(stretches_of(u))(*given), by(None)(*given), strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * (1 + np.abs(other).max()))


@pytest.mark.parametrize("seed", [1, 4])
def test_the_derivative_along_a_drive_is_that_of_the_recursion_over_samples(seed):
    """In a direction that no sample at rest can tell: cases without equal samples."""
    u, operator = case(seed)
    given, along = jnp.asarray(u), jnp.cos(jnp.arange(u.size, dtype=float) * 0.3)
    rest = [jnp.asarray(x) for x in operator]

    def slope(stretches):
        return jax.jvp(lambda u: memory(u, *rest, stretches=stretches), (given,), (along,))[1]

    one, other = slope(stretches_of(u)), slope(None)
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * (1 + np.abs(other).max()))


def test_where_a_falling_bound_falls_nothing_is_said():
    u, operator = case(1)
    operator[1][0] = -0.1
    given = [jnp.asarray(x) for x in (u, *operator)]
    assert np.isnan(memory(*given, stretches=stretches_of(u))).all()
    bent = [*(jnp.asarray(x) for x in case(1)[1]), jnp.asarray(-5.0), jnp.asarray(0.0)]
    assert np.isnan(memory(given[0], *bent, stretches=stretches_of(u))).all()


def test_turns_are_the_last_of_equal_samples():
    u = np.array([0.0, 1, 2, 2, 1, 0, 0, 0, 3, 3, 4, 1, 1])
    np.testing.assert_array_equal(turning_places(u), [3, 7, 10])
    assert turning_places(np.ones(5)).size == 0
    assert turning_places(np.arange(5.0)).size == 0


def test_rows_with_few_turns_repeat_their_last():
    ramp, wave = np.linspace(0, 1, 400), np.cos(np.arange(400) / 25)
    found = find_stretches(np.stack([ramp, wave]))
    assert found is not None
    turn, index = found
    assert turn.shape == (2, 8)
    assert (turn[0] == 0).all() and (index[0] == 0).all()
    assert (np.diff(index[1]) >= 0).all() and index[1, -1] == 5
    np.testing.assert_array_equal(turn[1, 1:6], turning_places(wave))
    assert (turn[1, 6:] == turn[1, 5]).all()


def test_a_noisy_drive_has_no_stretches_worth_finding():
    assert find_stretches(np.random.default_rng(0).normal(size=(2, 500))) is None


def test_turning_places_of_drives_with_level_pieces():
    """The last of equal samples at a turn; a pause on the way is none."""
    for drive, expected in (
        ([0.0, 1.0, 2.0, 1.0, 0.0, 3.0], [2, 4]),
        ([0.0, 1.0, 1.0, 2.0], []),
        ([0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0], [3, 5]),
        ([2.0, 2.0, 1.0, 1.0, 3.0], [3]),
        ([1.0, 1.0, 1.0], []),
        ([1.0], []),
    ):
        assert turning_places(np.array(drive)).tolist() == expected
