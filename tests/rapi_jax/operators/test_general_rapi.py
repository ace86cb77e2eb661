"""GeneralRAPI: against a plain loop and RAPI, its derivatives, its inverse, and in a file."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rapi_jax import (
    ECDL,
    RAPI,
    Drive,
    DriveLimits,
    GeneralRAPI,
    certify,
    compensate,
    exact_inverse,
    linear_scan,
    memory,
    predict,
)
from rapi_jax._waveform import multisine, sine, triangle
from rapi_jax.effects import AmplifierLowpass, Creep, Etalon
from rapi_jax.examples import paper_device, paper_recording
from rapi_jax.io import read_model, write_model
from rapi_jax.operators import Plays

# Sums of a few dozen products in another order, beside responses of up to a few hundred.
EXACT = dict(rtol=1e-12, atol=1e-11)
FREQ = jnp.asarray(20.0)
SHARED = dict(alpha=0.4, lam=1.3, eta=0.8, a=0.7, d=(16.0, -0.8, 0.02), d_0=3.0)
FREE = dict(zeta=(4e-3, 2e-3), b=(0.3, -0.4), bow=0.04, u_0=2.5)
CASES = {
    "shared": dict(SHARED, **FREE, plays=5),
    "one play": dict(SHARED, **FREE, plays=1),
    "bent down, crossed in places": dict(SHARED, **FREE, plays=5) | dict(lam=0.7, bow=-0.05),
    "negative weights": dict(SHARED, **FREE, plays=4)
    | dict(
        alpha=(0.3, 0.5, 0.35, 0.6),
        lam=(0.8, 1.0, 1.5, 1.2),
        eta=(1.0, 0.2, 0.6, 1.4),
        a=(0.9, -0.6, 0.5, -0.3),
    ),
}


def reference(u, freq, *, alpha, zeta, lam, eta, a, b, bow, u_0, d, d_0, plays):
    """The class docstring, read line by line."""
    rank = np.arange(1, plays + 1) / plays
    r = alpha * rank * np.ptp(u) / 2 + (zeta[0] + zeta[1] * (rank - 0.5)) * freq
    p = a * np.exp(-b[0] * r - b[1] * r**2)
    total = d_0 + sum(c * u ** (k + 1) for k, c in enumerate(d))
    for r_i, lam_i, eta_i, p_i in np.broadcast(r, lam, eta, p):
        state, out = -np.inf, []
        for x in (u.min(), *u):  # Eq. (13): before the first sample the drive was at its minimum
            upper = lam_i * x + eta_i * r_i + bow * (x - u_0) ** 2
            state = max(x - r_i, upper if state == -np.inf else min(upper, state))
            out.append(state)
        total = total + p_i * np.array(out[1:])
    return total


def arrays(fields):
    return {k: np.asarray(v) if isinstance(v, tuple) else v for k, v in fields.items()}


@pytest.mark.parametrize("name", CASES)
def test_is_the_plain_loop(name):
    laser = ECDL(GeneralRAPI(**CASES[name]))
    drives = [
        *triangle((10.0, 80.0), amplitude=4.0, bias=3.0, samples=300, periods=2),
        *multisine(30.0, amplitude=4.0, bias=3.0, samples=400),  # no turn between two is drawn
    ]
    rng = np.random.default_rng(5)
    value = np.cumsum(rng.normal(size=300))
    value = 4.0 * (value - value.min()) / np.ptp(value) + 1.0
    drives.append(Drive(np.arange(300) * 1e-3, value, 35.0, "other"))
    for drive in drives:
        if drive.repeats:
            assert drive.value.argmin() == 0 or drive.waveform == "multisine"
            value = drive.value[: drive.size // drive.periods]
            expected = reference(np.tile(value, 3), drive.rate, **arrays(CASES[name]))
            expected = np.tile(expected[-value.size :], drive.periods)
        else:
            expected = reference(drive.value, drive.rate, **arrays(CASES[name]))
        np.testing.assert_allclose(predict(laser, drive), expected, **EXACT)


def test_each_freedom_makes_it_another_operator():
    drive = sine(60.0, amplitude=4.0, bias=3.0, samples=240)[0]
    fields = CASES["shared"]
    full = predict(ECDL(GeneralRAPI(**fields)), drive)
    for change in (dict(bow=0.0), dict(zeta=(4e-3, 0.0)), dict(b=(0.3, 0.0)), dict(u_0=2.0)):
        other = predict(ECDL(GeneralRAPI(**{**fields, **change})), drive)
        assert np.ptp(other - full) > 1e-3, change


@pytest.mark.parametrize("each", [False, True])
def test_is_rapi_to_the_last_bit_without_its_freedom(each):
    shape = dict(lam=(0.7, 1.0, 1.5), alpha=(0.3, 0.5, 0.35)) if each else {}
    plain = RAPI(**{**SHARED, **shape}, zeta=4e-3, b=0.3, plays=3)
    general = GeneralRAPI(
        **{**SHARED, **shape}, zeta=(4e-3, 0.0), b=(0.3, 0.0), bow=0.0, u_0=2.5, plays=3
    )
    assert eqx.tree_equal(general, GeneralRAPI.of(plain, u_0=2.5))
    for drive in triangle((10.0, 80.0), amplitude=4.0, bias=3.0, samples=300, periods=2):
        one, other = (predict(ECDL(o), drive) for o in (plain, general))
        assert np.array_equal(one, other)


@pytest.mark.parametrize(
    "change, message",
    [
        (dict(zeta=0.1), "`zeta` must be two numbers"),
        (dict(b=(0.1, 0.2, 0.3)), "`b` must be two numbers"),
        (dict(bow=(0.1, 0.2)), "`bow` must be a number"),
        (dict(u_0=(0.1,)), "`u_0` must be a number"),
        (dict(lam=(1.0, 1.0)), "`lam`.*5 of them"),
        (dict(plays=0), "`plays`"),
    ],
)
def test_wrong_arguments_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        GeneralRAPI(**{**CASES["shared"], **change})


# --- derivatives of the memory function with a bow

NAMES = ("u", "r", "lam", "eta", "p", "start", "bow", "u_0")
ALL = tuple(range(8))


def inputs(seed, samples=60, count=5):
    """A random drive and plays, of weights of both signs, one of them crossed in places."""
    rng = np.random.default_rng(seed)
    u = np.cumsum(rng.normal(0.0, 0.8, samples))
    u = 4.0 * (u - u.min()) / np.ptp(u) + 0.5
    r = np.sort(rng.uniform(0.1, 1.5, count))
    lam, eta = rng.uniform(0.6, 2.0, count), rng.uniform(0.3, 1.5, count)
    lam[0], eta[0], r[0] = 0.5, 0.9, 0.9
    p, start = rng.normal(0.0, 1.0, count), u[0] + rng.uniform(-0.05, 0.05, count)
    bow, u_0 = 0.03 * (-1) ** seed, rng.uniform(1.0, 4.0)
    return [jnp.asarray(x) for x in (u, r, lam, eta, p, start, bow, u_0)]


@jax.jit
def plain_memory(u, r, lam, eta, p, start, bow, u_0):
    def step(state, x):
        upper = lam * x + eta * r + bow * (x - u_0) ** 2
        state = jnp.maximum(x - r, jnp.minimum(upper, state))
        return state, state @ p

    return jax.lax.scan(step, start, u)[1]


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("transform", [jax.jacfwd, jax.jacrev])
def test_derivatives_are_those_of_the_plain_scan(transform, seed):
    values = inputs(seed)
    assert np.abs(memory(*values) - plain_memory(*values)).max() <= 1e-12
    ours = jax.jit(transform(memory, argnums=ALL))(*values)
    theirs = jax.jit(jax.jacfwd(plain_memory, argnums=ALL))(*values)
    for name, one, two in zip(NAMES, ours, theirs, strict=True):
        assert np.abs(two).max() > 0.05, name
        assert np.abs(np.asarray(one - two)).max() <= 1e-12, name
        alone = jax.jit(transform(memory, argnums=NAMES.index(name)))(*values)
        assert np.abs(np.asarray(alone - two)).max() <= 1e-12, name


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_derivatives_are_those_of_central_differences(seed):
    values = inputs(seed)
    columns = jax.jit(jax.jacfwd(memory, argnums=(6, 7)))(*values)
    for i, column in zip((6, 7), columns, strict=True):
        step = 1e-6
        ends = [
            memory(*[v + s if k == i else v for k, v in enumerate(values)]) for s in (step, -step)
        ]
        assert np.abs((ends[0] - ends[1]) / (2 * step) - column).max() <= 1e-6


def test_second_derivatives_are_those_of_the_plain_scan():
    values = inputs(0)
    loss = [
        jax.jit(jax.hessian(lambda *v: jnp.sum(jnp.sin(f(*v))), argnums=(0, 2, 6, 7)))  # noqa: B023
        for f in (memory, plain_memory)
    ]
    for one, two in zip(*(jax.tree.leaves(h(*values)) for h in loss), strict=True):
        assert np.abs(one - two).max() <= 1e-10


def test_vmap_and_jit_agree_with_one_at_a_time():
    operator = GeneralRAPI(**CASES["negative weights"])
    u = jnp.asarray(sine(20.0, amplitude=4.0, bias=3.0, samples=120)[0].value)
    bows = jnp.asarray([-0.03, 0.0, 0.02])

    def loss(bow):
        moved = eqx.tree_at(lambda o: o.bow, operator, bow)
        return jnp.sum(jnp.sin(moved(u, FREQ)))

    both = jax.jit(jax.vmap(jax.value_and_grad(loss)))(bows)
    for bow, value, slope in zip(bows, *both, strict=True):
        assert float(value) == pytest.approx(float(loss(bow)), rel=1e-12, abs=1e-11)
        ends = [float(loss(bow + s)) for s in (1e-6, -1e-6)]
        assert float(slope) == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-5)


# --- the inverse


def invertible(seed):
    """A random operator of both signs of weight and bow, certified on a range."""
    rng = np.random.default_rng(seed)
    for _ in range(100):
        plays = int(rng.choice([2, 7]))  # few, since each number is compiled for
        low = float(rng.uniform(-1.0, 2.0))
        high = low + float(rng.uniform(0.5, 6.0))
        swing = (high - low) / 2
        lam = np.exp(rng.uniform(-0.5, 0.7, plays))
        operator = GeneralRAPI(
            alpha=np.exp(rng.uniform(-4.0, 0.0, plays)),
            zeta=rng.uniform(0.0, 0.01, 2) / 5,
            lam=lam,
            eta=rng.uniform(-0.5, 3.0, plays),
            a=rng.normal(0.5, 1.0, plays),
            b=rng.uniform(-0.2, 0.2, 2),
            bow=float(rng.uniform(-0.3, 0.3) * lam.min() / swing),
            u_0=(low + high) / 2 + float(rng.uniform(-0.5, 0.5)),
            d=(float(rng.uniform(2.0, 9.0)), float(rng.normal(0.0, 0.1)), 0.0),
            d_0=float(rng.normal()),
            plays=plays,
        )
        freq = float(rng.uniform(1.0, 40.0))
        if certify(operator, low - 0.05, high + 0.05, freq, u_pp=high - low).invertible:
            return operator, low, high, freq
    raise AssertionError("none of 100 is invertible")


respond = eqx.filter_jit(lambda operator, u, freq: operator(u, freq))


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1))
@example(486)  # it falls and rises again
@example(807125571)  # the response at the minimum falls as the minimum rises
def test_response_to_drive_to_response(seed):
    """To rounding, for weights of both signs; the drive comes back where it is the only one."""
    operator, low, high, freq = invertible(seed)
    rng = np.random.default_rng(seed)
    time = np.arange(96) / 96
    wiggle = rng.normal(size=2) * 0.3
    u = -np.cos(2 * np.pi * time) + wiggle @ np.sin(2 * np.pi * np.outer([2, 5], time))
    u = low + (high - low) * (u - u.min()) / np.ptp(u)
    u = jnp.asarray(np.roll(u, -int(u.argmin())))
    y = respond(operator, u, jnp.asarray(freq))
    back = exact_inverse(operator, y, freq, within=(low - 0.04, high + 0.04))
    again = respond(operator, back, jnp.asarray(freq))
    assert float(jnp.abs(again - y).max()) < 1e-11 * float(jnp.ptp(y))


STEEP = GeneralRAPI(**(CASES["negative weights"] | {"d": (16.0, -0.4)}))


def scan(samples=400, span=50.0, start=15.0):
    x = np.arange(samples) / samples
    return jnp.asarray(start + span * (1.0 - np.abs(1.0 - 2.0 * x)))


def test_the_inverse_agrees_with_bisection():
    y = scan()
    u = np.asarray(exact_inverse(STEEP, y, FREQ, within=(0.0, 7.0)))
    plays = STEEP.plays(jnp.asarray(np.ptp(u)), FREQ)
    r, lam, eta, p = (np.asarray(x) for x in (plays.r, plays.lam, plays.eta, plays.p))
    bow, u_0 = 0.04, 2.5

    def clamped(x, state):
        return np.maximum(x - r, np.minimum(lam * x + eta * r + bow * (x - u_0) ** 2, state))

    state, worst = clamped(u.min(), np.inf), 0.0
    for wanted, found in zip(np.asarray(y), u, strict=True):
        low, high = -1.0, 8.0
        for _ in range(60):
            x = (low + high) / 2
            more = clamped(x, state) @ p + np.polyval([-0.4, 16.0, 3.0], x) > wanted
            low, high = (low, x) if more else (x, high)
        state = clamped(x, state)
        worst = max(worst, abs(x - found))
    assert worst < 1e-12


@pytest.mark.slow
def test_the_inverse_has_the_derivative_of_finite_steps_also_under_vmap():
    y, at = scan(200), 141

    def drive(bow, u_0):
        moved = eqx.tree_at(lambda o: (o.bow, o.u_0), STEEP, (bow, u_0))
        return exact_inverse(moved, y, FREQ, within=(0.0, 7.0))[at]

    bows = jnp.asarray([-0.02, 0.04])
    slopes = jax.vmap(jax.grad(drive, argnums=(0, 1)), in_axes=(0, None))(bows, STEEP.u_0)
    for k, bow in enumerate(bows):
        for i, slope in enumerate(slopes):
            ends = [drive(bow + s * (i == 0), STEEP.u_0 + s * (i == 1)) for s in (1e-5, -1e-5)]
            difference = float(ends[0] - ends[1]) / 2e-5
            assert float(slope[k]) == pytest.approx(difference, rel=2e-5, abs=1e-9)
            assert abs(difference) > 1e-4


# --- as part of a device


EFFECTS = {
    "alone": (),
    "with effects": (
        AmplifierLowpass(tau=2e-4),
        Etalon(amplitude=0.1, spacing=9.0),
        Creep(gain=0.02),
    ),
}


@pytest.mark.parametrize("effects", EFFECTS)
def test_a_device_is_compensated(effects):
    ecdl = ECDL(STEEP, EFFECTS[effects])
    target = linear_scan(20.0, span=50.0, samples=2048)[0]
    limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=5000.0)
    got = compensate(ecdl, target, limits=limits, bias=3.0)
    assert got.certificate.invertible and got.inverse == "exact"
    tolerance = 1e-10 if effects == "alone" else 1e-4
    assert np.abs(got.predicted - (target.value - target.value.min())).max() < tolerance * 50.0


def test_a_model_file_holds_every_bit(tmp_path):
    for name, fields in CASES.items():
        ecdl = ECDL(GeneralRAPI(**fields), EFFECTS["with effects"])
        path = tmp_path / f"{len(name)}.rapi"
        write_model(path, ecdl, note=name)
        again, about = read_model(path)
        assert eqx.tree_equal(again, ecdl) and about == {"note": name}
        assert type(again.operator) is GeneralRAPI


def test_slopes_of_falling_bounds():
    two = jnp.asarray([1.0, 2.0])
    straight, bowed = Plays(two, two, two, two), Plays(two, two, two, two, *two / 10)
    assert np.array_equal(straight.falling(jnp.asarray(5.0)), [1.0, 2.0])
    np.testing.assert_allclose(bowed.falling(jnp.asarray(5.2)), [2.0, 3.0], rtol=1e-14)


def test_the_flexible_form_of_a_model_without_hysteresis_may_have_some():
    """Weights that are zero have a prior of their own width, and not of none."""
    recording, _ = paper_recording(samples=200)
    zero = jnp.zeros(())
    operator = eqx.tree_at(lambda o: (o.a, o.alpha), paper_device().operator, (zero, zero))
    form = operator.flexible(recording)
    assert form is not None
    assert all(np.all(np.asarray(std) > 0) for std in form.deviations.values())
    slope = max(run.span for run in recording.runs) / recording.amplitudes[-1]
    assert form.deviations["a"] == pytest.approx(1e-3 * slope)
