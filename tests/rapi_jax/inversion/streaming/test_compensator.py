"""The streaming inverse: against the inverse of whole scans, and against a plain loop."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from streaming_models import loose, monotone, respond

from rapi_jax import (
    ECDL,
    RAPI,
    NotInvertible,
    StreamingCompensator,
    certify,
    exact_inverse,
    linear_scan,
)
from rapi_jax.effects import Etalon
from rapi_jax.examples import paper_device

WITHIN = (0.0, 7.0)


def triangle(samples=1000, span=70.0, start=20.0):
    x = np.arange(samples) / samples
    return start + span * (1.0 - np.abs(1.0 - 2.0 * x))


@pytest.mark.parametrize("freq", [10.0, 40.0])
@pytest.mark.parametrize("shape", ["triangle", "linear scan", "sawtooth"])
def test_of_a_scan_known_ahead_it_is_the_exact_inverse(shape, freq):
    if shape == "triangle":
        y = triangle()
    else:
        rise = 0.5 if shape == "linear scan" else 0.9
        y = 20.0 + linear_scan(freq, span=75.0, rise=rise, samples=1000)[0].value
    operator = paper_device().operator
    compensator = StreamingCompensator.for_scan(paper_device(), freq, y, within=WITHIN)
    state, u = compensator.run(np.tile(y, 2))
    expected = np.asarray(exact_inverse(operator, y, freq, within=WITHIN))
    assert np.abs(np.asarray(u) - np.tile(expected, 2)).max() < 1e-12
    assert float(state.error) < 1e-12


KINDS = {
    "positive weights": dict(weights=(0.5, 0.2)),
    "weights of both signs": dict(weights=(0.3, 0.5)),
    "crossed bands": dict(weights=(0.3, 0.5), crossed=True),
    "bent bounds": dict(weights=(0.3, 0.5), crossed=True, bent=True),
}


@pytest.mark.parametrize("kind", KINDS)
def test_the_response_is_the_target_whatever_the_turns(kind):
    """Steps, ramps and noise within the range that every history reaches."""
    rng = np.random.default_rng(list(KINDS).index(kind))
    for operator, low, high in monotone(rng, 6, **KINDS[kind]):
        u_pp = high - low
        walk = np.interp(np.arange(600), np.arange(0, 600, 25), rng.random(24))
        u = low + u_pp * np.where(np.arange(600) < 300, walk, rng.random(600))
        y = respond(operator, u, 10.0, u_pp=u_pp, u_min=low)
        compensator = StreamingCompensator.of(operator, 10.0, within=(low, high))
        state, found = compensator.run(y)
        scale = np.abs(y).max() + np.ptp(y)
        again = respond(operator, found, 10.0, u_pp=u_pp, u_min=low)
        assert np.abs(again - y).max() < 1e-12 * scale
        least = certify(operator, low, high, 10.0).slope_min
        assert np.abs(np.asarray(found) - u).max() < 1e-12 * scale / least + 1e-12
        assert float(state.error) < 1e-12 * scale


@pytest.mark.parametrize("parts", [(500,), (250, 500, 750)])
def test_a_stream_in_parts_is_the_stream(parts):
    y = triangle()
    compensator = StreamingCompensator.of(paper_device(), 20.0, within=(0.5, 5.5))
    whole_state, whole = compensator.run(y)
    state, drives = compensator.initial(), []
    for part in np.split(y, parts):
        state, drive = compensator.run(part, state)
        drives.append(np.asarray(drive))
    assert np.array_equal(np.concatenate(drives), whole)
    assert all(np.array_equal(a, b) for a, b in zip(state, whole_state, strict=True))


def test_the_past_alone_decides():
    y = triangle()
    other = np.where(np.arange(1000) < 400, y, 30.0)
    compensator = StreamingCompensator.of(paper_device(), 20.0, within=(0.5, 5.5))
    same = np.asarray(compensator.run(y)[1]) == np.asarray(compensator.run(other)[1])
    assert same[:400].all() and not same[400:410].any()


def test_a_step_within_a_scan_of_the_callers_and_under_vmap():
    y = jnp.asarray(triangle())
    compensator = StreamingCompensator.of(paper_device(), 20.0, within=(0.5, 5.5))
    _, expected = compensator.run(y)

    def feedback(carry, target):
        state, last = carry
        state, drive = compensator.step(state, target)
        return (state, drive), drive - last

    (_, _), change = jax.lax.scan(feedback, (compensator.initial(), compensator.low), y)
    start = float(compensator.low)
    np.testing.assert_allclose(start + np.cumsum(change), expected, rtol=0, atol=1e-12)
    many = jax.vmap(lambda y: compensator.run(y)[1])(jnp.stack([y, y + 1.0]))
    np.testing.assert_allclose(many[0], expected, rtol=0, atol=1e-13)


def test_a_target_out_of_reach_gives_the_nearest_drive_and_is_seen():
    compensator = StreamingCompensator.of(paper_device(), 20.0, within=(1.0, 5.0))
    y = np.concatenate([np.linspace(30.0, 500.0, 125), np.linspace(500.0, -100.0, 125)])
    state, u = compensator.run(y)
    assert np.asarray(u).min() == 1.0 and np.asarray(u).max() == 5.0
    assert np.isfinite(u).all() and float(state.error) > 400.0
    y = np.where(np.arange(250) == 100, np.nan, np.linspace(30.0, 80.0, 250))
    state, held = compensator.run(y)
    assert held[100] == held[99] < held[101] and np.isnan(state.error)


def test_float64_whatever_the_host_says():
    y = triangle()
    compensator = StreamingCompensator.for_scan(paper_device(), 20.0, y, within=WITHIN)
    expected = np.asarray(compensator.run(y)[1])
    with jax.enable_x64(False):
        compensator = StreamingCompensator.for_scan(paper_device(), 20.0, y, within=WITHIN)
        state, u = compensator.run(y)
        assert u.dtype == np.float64 and np.array_equal(u, expected)
        state, drive = jax.jit(lambda state, y: compensator.step(state, y))(
            compensator.initial(), jnp.asarray(y[0])
        )
        assert drive.dtype == state.plays.dtype == np.float64
        assert not jax.config.jax_enable_x64


def test_what_is_refused():
    device = paper_device()
    with pytest.raises(ValueError, match="no effects around its operator, but has Etalon"):
        StreamingCompensator.of(ECDL(device.operator, (Etalon(),)), 20.0, within=WITHIN)
    with pytest.raises(NotInvertible, match="nearest is"):
        StreamingCompensator.for_scan(device, 20.0, triangle(span=200.0), within=WITHIN)
    with pytest.raises(ValueError, match="`low` must lie below"):
        StreamingCompensator.of(device, 20.0, within=(5.0, 1.0))
    falling = RAPI(alpha=0.2, zeta=0.0, lam=1.0, eta=1.0, a=-2.0, b=0.0, d=(3.0,), plays=2)
    with pytest.raises(NotInvertible, match="does not rise with it"):
        StreamingCompensator.of(falling, 20.0, within=WITHIN)


def test_a_certified_model_with_negative_weights_is_not_refused():
    rng = np.random.default_rng(5)
    for _ in range(20):
        operator, low, high = loose(rng, weights=(-0.2, 0.3))
        certificate = certify(operator, low, high, 10.0)
        if certificate.invertible:
            StreamingCompensator.of(operator, 10.0, within=(low, high))
        else:
            with pytest.raises(NotInvertible):
                StreamingCompensator.of(operator, 10.0, within=(low, high))
