"""The exact inverse over monotone stretches: the same drive as sample by sample, and its slopes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import RAPI, exact_inverse
from rapi_jax.examples import paper_device
from rapi_jax.inversion._exact_inverse import extremes, scan_inverse, target_stretches

RATE = 20.0


def loop(operator, u, u_pp, u_min):
    """The response to `u`, a sample at a time, with the thresholds of this swing (Eqs. 9 to 16)."""
    r = np.asarray(operator.thresholds(jnp.asarray(u_pp), jnp.asarray(RATE)))
    lam, eta = (np.broadcast_to(np.asarray(x), r.shape) for x in (operator.lam, operator.eta))
    p = np.asarray(operator.a) * np.exp(-float(operator.b) * r)
    value, out = np.maximum(u_min - r, lam * u_min + eta * r), np.zeros(u.size)
    for n, x in enumerate(u):
        value = np.maximum(x - r, np.minimum(lam * x + eta * r, value))
        out[n] = p @ value + np.polyval([*np.asarray(operator.d)[::-1], float(operator.d_0)], x)
    return out


def operators():
    paper = paper_device().operator
    spread = eqx.tree_at(lambda o: o.lam, paper, jnp.linspace(1.9, 0.6, 10))  # some bands cross
    line = eqx.tree_at(lambda o: o.d, paper, jnp.asarray([17.0]))
    high = eqx.tree_at(lambda o: o.d, paper, jnp.asarray([18.0, -1.0, 0.01, 5e-3, -4e-4]))
    fields = dict(alpha=0.3, zeta=6e-3, lam=1.3, eta=0.9, a=0.5, b=0.1, d=(18.0, -1.0), plays=1)
    return {"paper": paper, "crossed": spread, "line": line, "order 5": high, "one": RAPI(**fields)}


def targets():
    """Scans as fractions of a span: triangle, from the middle down, nested turns, with rests."""
    up = np.linspace(0.0, 1.0, 700)
    knots = np.array([0.0, 1.0, 0.3, 0.8, 0.1, 0.95, 0.0])
    walk = np.interp(np.arange(1400), np.linspace(0, 1399, 7), knots)
    return {
        "triangle": np.concatenate([up, up[::-1]]),
        "shifted": np.roll(np.concatenate([up, up[::-1]]), 350),
        "walk": walk,
        "rests": np.round(walk, 1),
        "rising": up,
    }


# Each operator and each target, and nested turns where bands cross: each case compiles for 10 s.
CASES = [
    *zip(operators(), targets(), strict=True),
    *(("paper", t) for t in targets() if t != "triangle"),
    ("crossed", "walk"),
]


@pytest.mark.parametrize(("name", "scan"), CASES)
def test_the_drive_answers_the_target_and_is_that_found_sample_by_sample(name, scan):
    operator, y = operators()[name], 20.0 + 50.0 * targets()[scan]
    stretches = target_stretches(jnp.asarray(y))
    assert stretches is not None
    numbers = [jnp.asarray(x) for x in (y.min(), y.max(), RATE, 0.0, 6.5, 1.0)]
    u_min, u_max = extremes(operator, *numbers)
    given = (operator, jnp.asarray(y), numbers[2], u_min, u_max, numbers[5])
    u = np.asarray(scan_inverse(*given, stretches))
    np.testing.assert_allclose(u, scan_inverse(*given), rtol=0, atol=1e-12 * np.ptp(u))
    answer = loop(operator, u, float(u_max - u_min), float(u_min))
    np.testing.assert_allclose(answer, y, rtol=0, atol=1e-12 * np.ptp(y))
    np.testing.assert_allclose(u, exact_inverse(operator, y, RATE, within=(0.0, 6.5)), atol=1e-12)


def test_its_derivative_is_that_of_the_inverse_sample_by_sample():
    operator, y = operators()["crossed"], jnp.asarray(20.0 + 50.0 * targets()["walk"])
    numbers = [jnp.asarray(x) for x in (20.0, 70.0, RATE, 0.0, 6.5, 1.0)]

    def drive(lam, stretches):
        changed = eqx.tree_at(lambda o: o.lam, operator, lam)
        u_min, u_max = extremes(changed, *numbers)
        return scan_inverse(changed, y, numbers[2], u_min, u_max, numbers[5], stretches)[::50]

    stretches = target_stretches(y)
    one, other = (jax.jacfwd(drive)(operator.lam, s) for s in (stretches, None))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-10 * float(jnp.abs(other).max()))


def test_a_target_whose_every_sample_turns_is_left_to_the_recursion():
    noisy = jnp.asarray(np.random.default_rng(0).normal(size=500))
    assert target_stretches(noisy) is None

    seen = []
    jax.jit(lambda y: seen.append(target_stretches(y)) or y)(jnp.linspace(0.0, 1.0, 500))
    assert seen == [None]  # traced
