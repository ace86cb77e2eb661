"""Models to compensate sample by sample, and the forward model as a plain loop."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from rapi_jax import certify
from rapi_jax.operators import AbstractOperator, Fields, Plays


class Loose(AbstractOperator):
    """Any thresholds, shapes, weights and bend: wider than the paper's operators."""

    r: Any
    lam: Any
    eta: Any
    p: Any
    bow: Any
    u_0: Any
    d: Any
    d_0: Any
    count: int
    fields = Fields("d", "d_0")

    def plays(self, u_pp, freq):
        del u_pp, freq
        return Plays(self.r, self.lam, self.eta, self.p, self.bow, self.u_0)

    def couplings(self, u_pp, freq):
        del u_pp, freq
        return {}


def loose(rng, *, weights, crossed=False, bent=False, plays=6):
    """A random operator and a range of drive; `weights`: mean and spread of `p`."""
    low = float(rng.uniform(-2.0, 2.0))
    high = low + float(rng.uniform(0.5, 5.0))
    r = rng.uniform(0.0, 0.4 * (high - low), plays) - (0.1 if crossed else 0.0)
    lam = np.exp(rng.uniform(-0.7, 0.7, plays))
    eta = rng.uniform(-0.5, 2.0, plays)
    bow = rng.uniform(-0.5, 0.5) * lam.min() / (high - low) if bent else 0.0
    d = rng.normal([3.0, 0.0, 0.0], [2.0, 0.3, 0.1])
    numbers = dict(
        r=r, lam=lam, eta=eta, p=rng.normal(*weights, plays), bow=bow, u_0=(low + high) / 2,
        d=d, d_0=rng.normal(),
    )  # fmt: skip
    arrays = {name: jnp.asarray(value) for name, value in numbers.items()}
    return Loose(**arrays, count=plays), low, high


def monotone(rng, count, **options):
    """`count` of them that certify."""
    found = []
    while len(found) < count:
        operator, low, high = loose(rng, **options)
        if certify(operator, low, high, 10.0).invertible:
            found.append((operator, low, high))
    return found


def respond(operator, u, freq, *, u_pp, u_min, origin=0.0):
    """Eqs. 9, 12, 13, 14 and 16 by a loop over samples."""
    plays = operator.plays(jnp.asarray(u_pp), jnp.asarray(float(freq)))
    r, lam, eta, p = (np.asarray(x) for x in (plays.r, plays.lam, plays.eta, plays.p))
    bow, u_0 = (0.0, 0.0) if plays.bow is None else (float(plays.bow), float(plays.u_0))
    constant = float(getattr(operator, operator.fields.constant))
    powers = [*np.asarray(operator.coefficients)[::-1], constant]
    x = u_min - origin
    state = np.maximum(x - r, lam * x + eta * r + bow * (x - u_0) ** 2)
    out = []
    for x in np.asarray(u) - origin:
        upper = lam * x + eta * r + bow * (x - u_0) ** 2
        state = np.maximum(x - r, np.minimum(upper, state))
        out.append(p @ state + np.polyval(powers, x))
    return np.array(out)
