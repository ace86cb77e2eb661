"""The inverse RA-PI against Eqs. 18 to 23 written out, its bounds, its guess and its file."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rapi_jax import ECDL, PI, RAPI, Drive, InverseRAPI, Recording, predict
from rapi_jax._waveform import triangle
from rapi_jax.io import read_model, write_model

FIELDS: dict[str, Any] = dict(
    s_1=0.05,
    s_2=1.0,
    s_3=2.0,
    kappa=0.08,
    sigma=-3e-3,
    epsilon=-0.3,
    lam=1.2,
    eta=0.8,
    g=(0.07, -2e-4, 1e-6),
    g_0=3.0,
    v_0=55.0,
    plays=5,
)
CASES: dict[str, dict[str, Any]] = {
    "shared": {},
    "a value a play": dict(lam=(2.0, 1.5, 1.0, 0.7, 0.5), eta=(0.2, 0.6, 1.0, 1.4, 2.0)),
    "one play, positive weight": dict(plays=1, sigma=2e-3, g=(0.05,)),
    "origin in the range": dict(v_0=20.0, lam=0.6),
}


def reference(v, freq, *, s_1, s_2, s_3, kappa, sigma, epsilon, lam, eta, g, g_0, v_0, plays):
    """Eqs. 18 to 23, plays recursing on their own outputs, in frequencies from the origin."""
    w = v - v_0
    out = g_0 + sum(c * w ** (k + 1) for k, c in enumerate(g))  # Eq. (22)
    lam, eta = np.broadcast_to(lam, plays), np.broadcast_to(eta, plays)
    for n in range(plays):
        i = n + 1
        z = s_1 * i**2 + s_2 * i + s_3 + kappa * freq  # Eq. (19)
        state = max(w.min() - z, lam[n] * w.min() + eta[n] * z)
        for k, x in enumerate(w):
            state = max(x - z, min(lam[n] * x + eta[n] * z, state))  # Eq. (20)
            out[k] += sigma * i**epsilon * state  # Eqs. (18), (21)
    return out


@pytest.mark.parametrize("name", CASES)
def test_the_equations(name):
    fields = FIELDS | CASES[name]
    for drive in triangle((10.0, 40.0), amplitude=70.0, bias=60.0, samples=200, periods=2):
        expected = reference(drive.value, drive.rate, **fields)
        made = predict(ECDL(InverseRAPI(**fields)), drive)
        np.testing.assert_allclose(made, expected, rtol=1e-12, atol=1e-12)


def test_all_frequencies_may_be_moved_with_the_origin():
    """Fringes give frequency up to a constant: with `v_0` moved along the drive is the same."""
    drive = triangle(20.0, amplitude=70.0, bias=60.0, samples=200)[0]
    moved = Drive(drive.time, drive.value + 1000.0, 20.0, "triangle")
    one = predict(ECDL(InverseRAPI(**FIELDS)), drive)
    fields: dict[str, Any] = FIELDS | dict(v_0=1055.0)
    other = predict(ECDL(InverseRAPI(**fields)), moved)
    np.testing.assert_allclose(other, one, rtol=1e-11)
    assert np.ptp(np.asarray(predict(ECDL(InverseRAPI(**FIELDS)), moved) - one)) > 0.1


def test_it_can_be_the_closed_form_inverse_of_a_pi():
    """With equal steps and weights that Eq. 18 can express, it is Eq. 17."""
    inverse = PI(r=(0.1, 0.3, 0.5), p=(0.0, 0.0, 1.0), d=(5.0,), d_0=7.0).inverse()
    last = float(inverse.p[2])
    fields: dict[str, Any] = FIELDS | dict(
        s_1=0.0, s_2=0.0, s_3=float(inverse.r[2]), kappa=0.0, sigma=last
    )
    fields |= dict(epsilon=0.0, lam=1.0, eta=1.0, g=inverse.d, g_0=1.4, v_0=0.0, plays=1)
    made = InverseRAPI(**fields)
    drive = triangle(20.0, amplitude=30.0, bias=20.0, samples=200)[0]
    gap = np.asarray(predict(ECDL(made), drive) - predict(ECDL(inverse), drive))
    assert np.ptp(gap) < 1e-12


@given(st.integers(3, 15), st.integers(0, 2**32 - 1))
def test_bounds_keep_every_threshold_positive(plays, seed):
    """Any point inside the bounds, couplings applied, has positive thresholds at all rates."""
    rng = np.random.default_rng(seed)
    freq = list(rng.uniform(0.0, 50.0, 3))
    names = ["s_1", "s_2", "s_3", "kappa"]
    model = InverseRAPI(**FIELDS | {"plays": plays})
    coupling = np.eye(4)
    for (moved, by), slope in model.couplings([1.0], freq).items():
        coupling[names.index(moved), names.index(by)] = slope
    values = coupling @ np.exp(rng.uniform(-5, 5, 4))
    fields = dict(zip(names, values, strict=True))
    for f in freq:
        z = np.asarray(InverseRAPI(**FIELDS | {"plays": plays} | fields).thresholds(jnp.asarray(f)))
        assert z.min() > -1e-9 * np.abs(values).max() * plays**2


def swapped(forward, rates, amplitude=3.0, bias=2.0):
    drives = triangle(rates, amplitude=amplitude, bias=bias, samples=400)
    made = [np.asarray(predict(ECDL(forward), d)) for d in drives]
    pairs = zip(drives, made, strict=True)
    inputs = [Drive(d.time, y, d.excitation_hz, "triangle") for d, y in pairs]
    return Recording.of(inputs, [d.value for d in drives], drive_unit="GHz", response_unit="V")


def test_the_guess_for_symmetric_plays_is_eq_17():
    """`lam` and `eta` 1, no polynomial: thresholds are those of the closed form at each rate."""
    forward = RAPI(alpha=0.5, zeta=2e-3, lam=1.0, eta=1.0, a=0.6, b=0.0, d=(12.0,), plays=8)
    recording = swapped(forward, (10.0, 40.0))
    guess = InverseRAPI.guess_inverses(forward, recording, each=(), order=1)[0]
    for rate in (10.0, 40.0):
        own = forward.plays(jnp.asarray(3.0), jnp.asarray(rate))
        exact = PI(r=own.r, p=own.p, d=forward.d).inverse()
        np.testing.assert_allclose(guess.thresholds(jnp.asarray(rate)), exact.r, rtol=0.02)
    for run in recording.runs:
        error = np.asarray(predict(ECDL(guess), run.drive)) - run.response
        assert np.sqrt(np.mean(error**2)) < 0.01 * np.ptp(run.response)


@pytest.mark.parametrize("each", [(), ("lam",), ("lam", "eta")])
@pytest.mark.parametrize("plays", [1, 2, 3, 12])
def test_guesses_of_every_shape_explain_the_drive(plays, each):
    forward = RAPI(alpha=0.3, zeta=5e-3, lam=1.4, eta=1.0, a=0.8, b=0.2, d=(15.0, -0.8), plays=6)
    recording = swapped(forward, (10.0, 40.0))
    guess = InverseRAPI.guess_inverses(forward, recording, plays=plays, order=3, each=each)[0]
    assert guess.count == plays and guess.g.shape == (3,)
    assert guess.lam.shape == ((plays,) if "lam" in each else ())
    assert guess.eta.shape == ((plays,) if "eta" in each else ())
    for run in recording.runs:
        assert np.asarray(guess.thresholds(jnp.asarray(run.drive.rate))).min() > 0
        error = np.asarray(predict(ECDL(guess), run.drive)) - run.response
        assert np.std(error) < 0.06 * np.ptp(run.response)


@pytest.mark.parametrize("name", CASES)
def test_a_model_file_gives_it_back(tmp_path, name):
    model = ECDL(InverseRAPI(**FIELDS | CASES[name]))
    write_model(tmp_path / "inverse.rapi", model, drive_unit="GHz")
    back, about = read_model(tmp_path / "inverse.rapi")
    assert about == {"drive_unit": "GHz"}
    drive = triangle(20.0, amplitude=70.0, bias=60.0, samples=200)[0]
    assert np.array_equal(predict(back, drive), predict(model, drive))
    assert isinstance(back.operator, InverseRAPI)
    assert float(back.operator.v_0) == (FIELDS | CASES[name])["v_0"]


@pytest.mark.parametrize(
    "change, message",
    [
        (dict(plays=0), "`plays`"),
        (dict(lam=(1.0, 2.0)), "`lam`.*5 of them"),
        (dict(sigma=(1.0,)), "`sigma` must be a number"),
        (dict(v_0=(1.0, 2.0)), "`v_0` must be a number"),
        (dict(g=1.0), "`g` must list"),
    ],
)
def test_wrong_arguments_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        InverseRAPI(**FIELDS | change)
