"""Two recordings of one simulated device, of which one parameter may have changed between them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.signal import lfilter

from rapi_jax import ECDL, Recording, predict
from rapi_jax._precision import float64
from rapi_jax.examples import NOISE, paper_device


@float64
def changed_device(**factors) -> ECDL:
    """The paper's device with parameters times `factors`; `d_1` is the first of `d`."""
    operator = paper_device().operator
    for name, factor in factors.items():
        field = "d" if name == "d_1" else name
        value = np.array(getattr(operator, field))
        if name == "d_1":
            value[0] *= factor
        else:
            value = value * factor
        operator = eqx.tree_at(
            lambda o, field=field: getattr(o, field), operator, jnp.asarray(value)
        )
    return ECDL(operator)


def record(drives, seed, *, noise=NOISE, memory=0.0, origin=0.0, **factors) -> Recording:
    """A session with noise whose correlation from sample to sample is `memory`."""
    rng, device = np.random.default_rng(seed), changed_device(**factors)

    def hiss(size):
        white = rng.standard_normal(size + 200)
        return lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], white)[200:]

    clean = [np.asarray(predict(device, drive)) for drive in drives]
    return Recording.of(drives, [y + noise * hiss(y.size) + origin for y in clean])
