"""The forward model and the paper's inverse one sample at a time, against a plain loop."""

import jax.numpy as jnp
import numpy as np
import pytest
from streaming_models import respond

from rapi_jax import InverseRAPI, StreamingCompensator, StreamingOperator
from rapi_jax.examples import paper_device

INVERSE = InverseRAPI(
    s_1=0.05, s_2=1.0, s_3=2.0, kappa=0.08, sigma=-3e-3, epsilon=-0.3, lam=1.2, eta=0.8,
    g=(0.07, -2e-4, 1e-6), g_0=3.0, v_0=55.0, plays=5,
)  # fmt: skip


@pytest.mark.parametrize(
    ("operator", "low", "span", "origin"),
    [(paper_device().operator, 0.75, 4.5, 0.0), (INVERSE, 20.0, 70.0, 55.0)],
)
def test_it_is_the_operator(operator, low, span, origin):
    u = low + span * (0.5 - 0.5 * np.cos(np.linspace(0.0, 20.0, 500)) * np.linspace(1, 0.2, 500))
    stream = StreamingOperator.of(operator, 20.0, u_min=low, u_pp=span)
    state, y = stream.run(u[:200])
    _, rest = stream.run(u[200:], state)
    expected = respond(operator, u, 20.0, u_pp=span, u_min=low, origin=origin)
    ends = dict(u_pp=jnp.asarray(span), u_min=jnp.asarray(low))
    whole = np.asarray(operator(*(jnp.asarray(x) for x in (u, 20.0)), **ends))
    for reference in (expected, whole):
        np.testing.assert_allclose(np.concatenate([y, rest]), reference, rtol=1e-13)


def test_the_papers_inverse_is_not_inverted_again():
    with pytest.raises(ValueError, match="StreamingOperator"):
        StreamingCompensator.of(INVERSE, 20.0, within=(20.0, 90.0))


def test_an_origin_counts():
    """An operator with an origin of its own, here for drives, follows it."""
    forward = InverseRAPI(
        s_1=0.01, s_2=0.05, s_3=0.02, kappa=1e-3, sigma=0.8, epsilon=-0.3, lam=1.4, eta=0.8,
        g=(18.0, -0.5), g_0=3.0, v_0=2.0, plays=4,
    )  # fmt: skip
    stream = StreamingOperator.of(forward, 20.0, u_min=0.5, u_pp=4.0)
    u = 0.5 + 4.0 * np.random.default_rng(3).random(200)
    expected = respond(forward, u, 20.0, u_pp=4.0, u_min=0.5, origin=2.0)
    np.testing.assert_allclose(stream.run(u)[1], expected, rtol=1e-13)
