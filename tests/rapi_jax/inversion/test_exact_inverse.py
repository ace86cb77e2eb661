"""The exact inverse: against a plain bisection, its derivatives, and what it refuses."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import PI, exact_inverse
from rapi_jax.examples import paper_device

FREQ = jnp.asarray(20.0)
WITHIN = (0.0, 7.0)


def target(samples=400, span=70.0, start=20.0):
    x = np.arange(samples) / samples
    return jnp.asarray(start + span * (1.0 - np.abs(1.0 - 2.0 * x)))


def by_bisection(operator, y, freq, u_pp, u_min):
    """One sample after another, by halving: the definition, in Python."""
    plays = operator.plays(jnp.asarray(u_pp), jnp.asarray(freq))
    r, lam, eta, p = (np.asarray(x) for x in (plays.r, plays.lam, plays.eta, plays.p))
    powers = [*np.asarray(operator.d)[::-1], float(operator.d_0)]
    state = np.maximum(u_min - r, lam * u_min + eta * r)
    out = []
    for wanted in np.asarray(y):
        low, high = -1.0, 8.0
        for _ in range(60):
            u = (low + high) / 2
            new = np.maximum(u - r, np.minimum(lam * u + eta * r, state))
            low, high = (low, u) if new @ p + np.polyval(powers, u) > wanted else (u, high)
        state = np.maximum(u - r, np.minimum(lam * u + eta * r, state))
        out.append(u)
    return np.array(out)


def test_agrees_with_bisection():
    operator = paper_device().operator
    y = target()
    u = np.asarray(exact_inverse(operator, y, FREQ, within=WITHIN))
    assert np.abs(u - by_bisection(operator, y, 20.0, np.ptp(u), u.min())).max() < 1e-12


def test_period_closes():
    operator = paper_device().operator
    once = target(512)
    u = exact_inverse(operator, jnp.concatenate([once, once, once]), FREQ, within=WITHIN)
    first, second, third = np.split(np.asarray(u), 3)
    assert np.abs(second - first).max() < 1e-12 and np.abs(third - first).max() < 1e-12


def test_derivative_is_that_of_finite_steps():
    """By the implicit function theorem, in every parameter, forward and in reverse."""
    operator = paper_device().operator
    y = target(300)
    at = 211

    def drive(operator, y):
        return exact_inverse(operator, y, FREQ, within=WITHIN)

    gradient = jax.grad(lambda o, y: drive(o, y)[at], argnums=(0, 1))(operator, y)
    for name in ("alpha", "zeta", "lam", "eta", "a", "b", "d_0"):
        value = getattr(operator, name)
        step = 1e-5 * jnp.maximum(jnp.abs(value), 1e-2)
        ends = [
            drive(eqx.tree_at(lambda o: getattr(o, name), operator, value + s), y)[at]  # noqa: B023
            for s in (step, -step)
        ]
        assert float(getattr(gradient[0], name)) == pytest.approx(
            float((ends[0] - ends[1]) / (2 * step)), rel=2e-5, abs=1e-9
        )
        tangent = jax.tree_util.tree_map(jnp.zeros_like, operator)
        tangent = eqx.tree_at(lambda o: getattr(o, name), tangent, jnp.ones_like(value))  # noqa: B023
        _, forward = jax.jvp(lambda o: drive(o, y)[at], (operator,), (tangent,))
        assert float(forward) == pytest.approx(float(getattr(gradient[0], name)), rel=1e-9)
    bump = jnp.zeros_like(y).at[90].set(1e-4)
    ends = [drive(operator, y + s)[at] for s in (bump, -bump)]
    assert float(gradient[1][90]) == pytest.approx(float((ends[0] - ends[1]) / 2e-4), abs=1e-6)


@pytest.mark.slow
def test_works_under_vmap():
    operator = paper_device().operator
    y = target(200)
    freqs = jnp.asarray([10.0, 25.0, 40.0])
    got = jax.vmap(lambda f: exact_inverse(operator, y, f, within=WITHIN))(freqs)
    for row, freq in zip(got, freqs, strict=True):
        alone = exact_inverse(operator, y, freq, within=WITHIN)
        assert float(jnp.abs(row - alone).max()) < 1e-12


def test_agrees_with_the_closed_form_of_the_classical_operator():
    forward = PI(r=(0.2, 0.5, 0.9), p=(1.5, 0.7, 0.4), d=(4.0,), d_0=0.3)
    u = jnp.asarray(2.0 - np.cos(np.linspace(0, 12, 600)) * np.linspace(1.5, 0.4, 600))
    y = forward(u, FREQ)
    closed = forward.inverse()(y, FREQ)
    exact = exact_inverse(forward, y, FREQ, within=(-1.0, 5.0))
    assert float(jnp.abs(closed - exact).max()) < 1e-12


def test_a_response_out_of_reach_is_an_error():
    with pytest.raises(RuntimeError, match="does not reach"):
        exact_inverse(paper_device().operator, target(span=200.0), FREQ, within=WITHIN)


def test_float64_whatever_the_host_says():
    with jax.enable_x64(False):
        u = exact_inverse(paper_device().operator, np.asarray(target()), 20.0, within=WITHIN)
        assert u.dtype == np.float64
        assert not jax.config.jax_enable_x64
