"""Eq. 17: PI and its inverse give each other's input back, to rounding."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rapi_jax import ECDL, PI, Drive, ModelError
from rapi_jax._precision import float64
from rapi_jax._waveform import triangle

SEEDS = st.integers(0, 2**32 - 1)
PLAYS = st.sampled_from([1, 2, 5, 12])
KINDS = st.sampled_from(["free", "rated", "triangle", "rolled"])


def operator_of(seed, plays, quadratic):
    """Slopes from 1/20 to 20 of the first one, thresholds in any order, sometimes one of 0."""
    rng = np.random.default_rng(seed)
    first = rng.uniform(0.5, 20.0)
    slopes = np.concatenate([[first], first * np.exp(rng.uniform(-3, 3, plays))])
    order = rng.permutation(plays)
    r = np.sort(rng.uniform(0.0, 2.0, plays))
    r[0] *= rng.integers(2)
    d = [first, 0.0] if quadratic else [first]
    return PI(r=r[order], p=np.diff(slopes)[order], d=d, d_0=rng.uniform(-30, 30))


def drive_of(seed, kind):
    rng = np.random.default_rng(seed)
    if kind in ("free", "rated"):
        value = np.cumsum(rng.normal(size=200)) * rng.uniform(0.05, 1.0)
        return Drive(np.arange(200) * 1e-3, value, 10.0 if kind == "rated" else None)
    drive = triangle(20.0, amplitude=4.0, bias=rng.uniform(-3, 3), samples=240, periods=2)[0]
    if kind == "rolled":
        one = np.roll(drive.value[:120], rng.integers(120))
        drive = Drive(drive.time, np.tile(one, 2), 20.0, "triangle")
    return drive


@eqx.filter_jit  # one program for each number of plays and samples
def respond(operator, u, rate):
    return ECDL(operator)(0.0 * u, u, rate)


@float64
def through(operator, drive, value):
    """The answer to `drive`'s clock and rate with other values, taken at the samples alone.

    `predict` would put a turning point between two samples where straight branches meet there, and
    a response has branches that bend within the last step before a turn.
    """
    other = Drive(drive.time, value, drive.excitation_hz, drive.waveform)
    before = other.lead_in()
    u = jnp.asarray(np.concatenate([before, other.value]))
    return np.asarray(respond(operator, u, jnp.asarray(other.rate)))[before.size :]


def size_of(operator):
    """How large the terms of the sum are, beside its input: rounding is a share of these."""
    return float(np.abs(operator.d).max() + np.abs(operator.p).sum())


@given(SEEDS, PLAYS, st.booleans(), KINDS)
@example(249, 5, False, "triangle")  # terms that cancel
@example(39910264, 5, False, "triangle")  # bends within the last step before a turn
def test_each_undoes_the_other(seed, plays, quadratic, kind):
    operator, drive = operator_of(seed, plays, quadratic), drive_of(seed, kind)
    inverse = operator.inverse()
    u = drive.value
    y = through(operator, drive, u)
    scale = np.abs(u).max() + np.abs(y - float(operator.d_0)).max() * size_of(inverse)
    assert np.abs(through(inverse, drive, y) - u).max() <= 1e-12 * scale
    # and the other way round, with `u` now a wanted response
    v = through(inverse, drive, u)
    made = np.abs(u).max() + abs(float(operator.d_0)) + np.abs(v).max() * size_of(operator)
    assert np.abs(through(operator, drive, v) - u).max() <= 1e-12 * made


@given(SEEDS, PLAYS)
def test_the_inverse_of_the_inverse_is_the_operator(seed, plays):
    operator = operator_of(seed, plays, False)
    order = np.argsort(operator.r)
    back = operator.inverse().inverse()
    scale = float(np.abs(operator.p).max() + operator.d[0])
    np.testing.assert_allclose(back.r, operator.r[order], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(back.p, operator.p[order], rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(back.d_0, operator.d_0, rtol=1e-11)


def test_by_hand():
    inverse = PI(r=[1.0, 3.0], p=[2.0, -1.0], d=[2.0], d_0=6.0).inverse()
    np.testing.assert_allclose(inverse.r, [2.0, 10.0])
    np.testing.assert_allclose(inverse.d, [0.5])
    np.testing.assert_allclose(inverse.p, [1 / 4 - 1 / 2, 1 / 3 - 1 / 4])
    np.testing.assert_allclose(inverse.d_0, -2.0)


@pytest.mark.parametrize(
    "fields, message",
    [
        (dict(r=[0.1], p=[1.0], d=[1.0, 0.0, 0.2]), "order 3.*one coefficient"),
        (dict(r=[0.1], p=[1.0], d=[0.0]), r"slope d_1 is 0"),
        (dict(r=[0.1], p=[1.0], d=[-1.0]), r"slope d_1 is -1"),
        (dict(r=[0.3, 0.1, 0.2], p=[5.0, -0.5, -0.6], d=[1.0]), r"play 3 .*-0\.1, .*positive"),
        (dict(r=[0.1], p=[np.nan], d=[1.0]), r"play 1 .*nan"),
    ],
)
def test_what_has_no_inverse_is_refused_with_the_place(fields, message):
    with pytest.raises(ModelError, match=message):
        PI(**fields).inverse()
