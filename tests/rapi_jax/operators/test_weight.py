"""What operators say of themselves: weights of plays are linear in the parameter `weight`."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import PI, RAPI, GeneralRAPI, InverseRAPI

SHARED = {"alpha": 0.3, "lam": 1.2, "eta": 0.9, "d": (15.0, 0.1)}
OPERATORS = {
    "PI": PI(r=(0.2, 0.7, 1.5), p=(1.0, -0.4, 2.0), d=(15.0,)),
    "RAPI": RAPI(**SHARED, zeta=0.01, a=0.6, b=0.2, plays=3),
    "RAPI, a weight a play": RAPI(**SHARED, zeta=0.01, a=(0.6, 0.1, 0.3), b=0.2, plays=3),
    "GeneralRAPI": GeneralRAPI(**SHARED, zeta=(0.01, 2e-3), a=0.6, b=(0.2, 0.1), plays=3),
    "InverseRAPI": InverseRAPI(
        s_1=0.1, s_2=2.0, s_3=1.0, sigma=-2e-3, epsilon=0.3, lam=1.1, eta=0.9, kappa=0.01,
        g=(0.05,), plays=3,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", OPERATORS)
def test_weights_are_linear_in_it(name):
    operator = OPERATORS[name]
    assert operator.weight is not None

    def weights(value):
        other = eqx.tree_at(lambda o: getattr(o, o.weight), operator, jnp.asarray(value))
        return np.asarray(other.plays(jnp.asarray(4.5), jnp.asarray(20.0)).p)

    shape = np.shape(getattr(operator, operator.weight))
    rng = np.random.default_rng(0)
    one, other = rng.standard_normal((2, *shape))
    np.testing.assert_array_equal(weights(np.zeros(shape)), 0.0)
    np.testing.assert_allclose(weights(one + 2 * other), weights(one) + 2 * weights(other))
    if shape:  # each play's weight is its own
        assert (weights(np.eye(operator.count)[1]) != 0).tolist() == [False, True, False]
