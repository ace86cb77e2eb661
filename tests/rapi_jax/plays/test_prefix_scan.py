"""The prefix scan over clamps is the recursion over samples, contacts and derivatives included."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax.plays import _play
from rapi_jax.plays._play import memory, play
from rapi_jax.plays._prefix_scan import prefix_contacts, prefix_values


def bounds(seed):
    """Bounds of noisy drives, crossed here and there, for one play and for several."""
    rng = np.random.default_rng(seed)
    shape = (257,) if seed % 2 else (300, 7)
    lower = np.cumsum(rng.normal(size=shape), axis=0) * 0.3
    upper = lower + rng.uniform(-0.3, 2.0, shape)
    return jnp.asarray(lower), jnp.asarray(upper), jnp.asarray(rng.normal(size=shape[1:]))


@pytest.mark.parametrize("seed", range(6))
def test_outputs_and_last_contacts_are_those_of_the_recursion(seed):
    lower, upper, start = bounds(seed)
    expected = _play._contacts(lower, upper, start)
    value, contact, below = prefix_contacts(lower, upper, start)
    np.testing.assert_array_equal(value, expected[0])
    np.testing.assert_array_equal(contact, expected[1])
    reached = np.asarray(contact) >= 0
    np.testing.assert_array_equal(np.asarray(below)[reached], np.asarray(expected[2])[reached])
    np.testing.assert_array_equal(prefix_values(lower, upper, start), expected[0])


def test_an_accelerator_takes_it_with_the_same_derivatives(monkeypatch):
    rng = np.random.default_rng(3)
    u = jnp.asarray(np.cumsum(rng.normal(size=200)) * 0.4)
    operator = [
        jnp.asarray(rng.uniform(*x, 5)) for x in ((0, 1), (0.5, 1.6), (0, 2), (-1, 1), (-1, 1))
    ]
    places = tuple(range(6))

    def all_of_it():
        slope = jax.jacfwd(lambda *x: memory(*x), argnums=places)(u, *operator)
        one = play(u - 0.5, u + 0.5, jnp.asarray(0.0))
        return [memory(u, *operator), one, *slope]

    recursion = all_of_it()
    monkeypatch.setattr(_play, "_on_accelerator", lambda: True)
    jax.clear_caches()
    for one, other in zip(all_of_it(), recursion, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)
    jax.clear_caches()
