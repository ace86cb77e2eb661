"""A device whose response is linear in all that is fitted, and its closed form by NumPy alone."""

import numpy as np

from fitting import fit
from rapi_jax import ECDL, PI, Recording, triangle

R, P, D, D_0 = (0.3, 0.7, 1.2), (2.0, 1.0, 0.5), (12.0, -0.6), 1.5
SIGMA = 0.05  # GHz
NAMES = ("p_1", "p_2", "p_3", "d_1", "d_2", "d_0")
TRUE = np.array([*P, *D, D_0])


def device(r=R):
    """Three plays with known thresholds, and a polynomial of order 2."""
    return ECDL(PI(r=r, p=P, d=D, d_0=D_0))


def drives(samples=250):
    """Two triangles, one period each."""
    return triangle((10.0, 20.0), amplitude=4.0, bias=3.0, samples=samples)


def plays(u, r=R):
    """Each play's steady output, by the definition, over two periods of which the last counts."""
    out = []
    for threshold in r:
        state, last = 0.0, []
        for value in (*u, *u):
            state = max(value - threshold, min(value + threshold, state))
            last.append(state)
        out.append(last[len(u) :])
    return np.array(out).T


def design(u, r=R):
    """The columns of `NAMES`."""
    return np.column_stack([plays(u, r), u, u**2, np.ones_like(u)])


def recording(seed, noise=None, samples=250):
    """Readings with noise from `noise(rng, size)`, by default white."""
    rng = np.random.default_rng(seed)
    make = (lambda rng, size: SIGMA * rng.standard_normal(size)) if noise is None else noise
    some = drives(samples)
    return Recording.of(some, [design(d.value) @ TRUE + make(rng, d.size) for d in some])


def everything(ecdl):
    """All that is linear: weights of plays, polynomial, constant."""
    return ecdl.operator.p, ecdl.operator.d, ecdl.operator.d_0


def fitted(data, r=R, **options):
    """The fit of all of `NAMES` with equal weights."""
    known = dict(weights="uniform", starts=1, guess=False, hold_out=False, throw=False)
    return fit(device(r), data, free=everything, **(known | options))


def ar1(rho):
    """Stationary AR(1) noise."""

    def make(rng, size):
        white, out = rng.standard_normal(size), np.empty(size)
        out[0] = white[0]
        for i in range(1, size):
            out[i] = rho * out[i - 1] + np.sqrt(1.0 - rho**2) * white[i]
        return SIGMA * out

    return make
