"""The recursion of linear effects, against SciPy, Fourier series and closed forms."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.signal

from rapi_jax import NotInvertible
from rapi_jax.effects import Modes
from rapi_jax.effects.base import _first_order_lags as _lags
from rapi_jax.effects.base._first_order_lags import invert_linear
from rapi_jax.effects.base._linear import Past, transfer
from rapi_jax.sampling._history import History

respond_linear = eqx.filter_jit(_lags.respond_linear)
respond_from_rest = eqx.filter_jit(_lags.respond_from_rest)
TAU = (3e-3, 0.04, 0.7)
WEIGHT = (0.3, -0.1, 0.05)


def real(tau=TAU, weight=WEIGHT, dtype: type = float):
    return Modes(jnp.asarray(tau, dtype=dtype), jnp.asarray(weight, dtype=dtype))


def oscillator(hertz, damping):
    """The pair of modes of w0^2 / (s^2 + 2 z w0 s + w0^2), from its poles by SciPy."""
    w0 = 2 * np.pi * hertz
    residues, poles, _ = scipy.signal.residue([w0**2], [1.0, 2 * damping * w0, w0**2])
    upper = int(np.argmax(np.imag(poles)))
    tau = -1.0 / poles[upper]
    return Modes(jnp.asarray([tau]), jnp.asarray([2 * residues[upper] * tau]))


def uneven(rng, count, until):
    t = np.sort(rng.uniform(0.0, until, count))
    t[0] = 0.0
    return t


def lag(tau, t, x, start):
    """The lag of `x` (straight between even samples) by SciPy's matrix exponentials."""
    system = ([[-1.0 / tau]], [[1.0 / tau]], [[1.0]], [[0.0]])
    return scipy.signal.lsim(system, x, t, X0=[start])[1]


def answer(modes, t, x, starts):
    lags = [lag(tau, t, x, s) for tau, s in zip(np.asarray(modes.tau), starts, strict=True)]
    return x + np.asarray(modes.weight) @ (np.array(lags) - x[None, :])


def rows(modes, t, x, *, period=0.0, lead=0, gap=None, session=False, settled=0.0, past=None):
    """`respond_linear` of NumPy rows that are alike."""
    t, x = np.atleast_2d(t), np.atleast_2d(x)
    gap = np.full(len(t), np.inf) if gap is None else np.asarray(gap)
    history = History(
        jnp.full(len(t), float(period)), jnp.full(len(t), lead, dtype=int), jnp.asarray(gap)
    )
    out = respond_linear(
        modes, jnp.asarray(t), jnp.asarray(x), history,
        session=session, past=Past.of(settled) if past is None else past,
    )  # fmt: skip
    return np.asarray(out)


# --- one run from rest


@pytest.mark.parametrize("dtype", [float, complex])
def test_a_ramp_on_an_uneven_clock(dtype):
    t = uneven(np.random.default_rng(0), 300, 0.5)
    y = np.asarray(respond_from_rest(real(dtype=dtype), jnp.asarray(t), jnp.asarray(2.0 + 3.0 * t)))
    behind = sum(c * tau * -np.expm1(-t / tau) for c, tau in zip(WEIGHT, TAU, strict=True))
    np.testing.assert_allclose(y, 2.0 + 3.0 * t - 3.0 * behind, rtol=0, atol=1e-13)


def test_a_step_between_two_samples():
    """A ramp of 1 us up to 1, then a hold: closed forms of a ramp and of one that begins later."""
    d = 1e-6
    t = np.concatenate([[0.0, d], d + np.geomspace(1e-5, 30.0, 200)])
    y = np.asarray(respond_from_rest(real(), jnp.asarray(t), jnp.asarray(np.minimum(t / d, 1.0))))
    want = np.minimum(t / d, 1.0)
    for c, tau in zip(WEIGHT, TAU, strict=True):
        left = tau / d * (np.exp(-(t[1:] - d) / tau) - np.exp(-t[1:] / tau))
        want[1:] -= c * left
    np.testing.assert_allclose(y, want, rtol=0, atol=1e-10)  # the closed form cancels 1e4 fold


def test_any_drive_against_scipy():
    rng = np.random.default_rng(1)
    t = np.arange(400) * 1e-3
    x = rng.normal(size=400).cumsum()
    y = respond_from_rest(real(), jnp.asarray(t), jnp.asarray(x))
    np.testing.assert_allclose(y, answer(real(), t, x, [x[0]] * 3), rtol=0, atol=1e-10)


@pytest.mark.parametrize("damping", [0.01, 0.5, 0.95])
@pytest.mark.parametrize("hertz", [30.0, 2000.0])
def test_an_oscillator_against_scipy(hertz, damping):
    w0 = 2 * np.pi * hertz
    t = np.arange(500) * 1e-3
    x = 5.0 + np.random.default_rng(2).normal(size=500)
    y = respond_from_rest(oscillator(hertz, damping), jnp.asarray(t), jnp.asarray(x))
    system = scipy.signal.TransferFunction([w0**2], [1.0, 2 * damping * w0, w0**2])
    want = x[0] + scipy.signal.lsim(system, x - x[0], t)[1]
    np.testing.assert_allclose(y, want, rtol=0, atol=1e-9)


def test_more_samples_on_the_same_lines_change_nothing():
    rng = np.random.default_rng(3)
    t = uneven(rng, 60, 0.3)
    x = rng.normal(size=60)
    many = np.unique(np.concatenate([t, uneven(rng, 900, t[-1])]))
    modes = Modes(
        jnp.concatenate([real(dtype=complex).tau, oscillator(90.0, 0.03).tau]),
        jnp.concatenate([real(dtype=complex).weight, oscillator(90.0, 0.03).weight]),
    )
    few = respond_from_rest(modes, jnp.asarray(t), jnp.asarray(x))
    more = respond_from_rest(modes, jnp.asarray(many), jnp.asarray(np.interp(many, t, x)))
    np.testing.assert_allclose(np.asarray(more)[np.searchsorted(many, t)], few, atol=1e-12)


def test_a_lag_of_zero_passes_everything_and_the_shortest_nearly_so():
    rng = np.random.default_rng(4)
    t, x = jnp.asarray(uneven(rng, 50, 1.0)), jnp.asarray(rng.normal(size=50))
    assert np.array_equal(respond_from_rest(real((0.0,), (1.0,)), t, x), x)
    steepest = float(jnp.max(jnp.abs(jnp.diff(x) / jnp.diff(t))))
    for tau in (1e-300, 1e-14, 1e-9):
        y = respond_from_rest(real((tau,), (1.0,)), t, x)
        assert float(jnp.abs(y - x).max()) <= tau * steepest + 1e-15


def test_weights_of_zero_are_the_identity_bit_for_bit():
    rng = np.random.default_rng(5)
    t, x = jnp.asarray(uneven(rng, 50, 1.0)), jnp.asarray(rng.normal(size=50))
    assert np.array_equal(respond_from_rest(real(weight=(0.0, 0.0, 0.0)), t, x), x)


def test_a_very_long_lag_keeps_all_its_digits():
    """With tau = 1e9 s the lag is the integral of the drive over tau: 1e-10, of which one sees the
    digits that are left beside a drive of 1."""
    t = uneven(np.random.default_rng(6), 200, 0.5)
    x = np.sin(40 * t)
    passed = np.asarray(respond_from_rest(real((1e9,), (1.0,)), jnp.asarray(t), jnp.asarray(x)))
    steps = np.diff(t) * (x[1:] + x[:-1]) / 2.0
    np.testing.assert_allclose(passed[1:], np.cumsum(steps) / 1e9, rtol=1e-9, atol=3e-16)


def test_padding_neither_changes_nor_is_changed():
    t = uneven(np.random.default_rng(7), 40, 0.2)
    x = np.cos(30 * t)
    alone = respond_from_rest(real(), jnp.asarray(t), jnp.asarray(x))
    padded = respond_from_rest(
        real(), jnp.asarray(np.pad(t, (0, 9), "edge")), jnp.asarray(np.pad(x, (0, 9), "edge"))
    )
    assert np.array_equal(padded[:40], alone) and (padded[40:] == alone[-1]).all()


# --- the periodic state


def triangle_wave(t, period):
    """From -1 at t = 0 to 1 at half a period."""
    return 1.0 - 2.0 * np.abs(1.0 - 2.0 * np.mod(t / period, 1.0))


@pytest.mark.parametrize("dtype", [float, complex])
def test_the_periodic_state_is_the_fourier_series(dtype):
    """One period of lead-in is enough, whatever the lag: up to 10^10 periods."""
    period = 0.05
    modes = real((1e-4, 3e-3, 0.7, 5e3, 1e9), (0.2, 0.3, 0.1, -0.2, 0.3), dtype)
    t = np.sort(
        np.concatenate([np.arange(-100, 200) * 5e-4, np.arange(-2, 4) * period / 2 + 1.3e-4])
    )
    x = triangle_wave(t - 1.3e-4, period)  # its corners lie between even samples
    lead = int(np.searchsorted(t, -1e-9))
    y = rows(modes, t, x, period=period, lead=lead)[0]
    n = np.arange(1, 40001, 2)
    share = -8.0 / np.pi**2 / n**2
    turns = np.exp(2j * np.pi * n[:, None] * (t - 1.3e-4)[None, :] / period)
    want = x.copy()
    for tau, c in zip(np.asarray(modes.tau), np.asarray(modes.weight), strict=True):
        want += (c * ((share / (1 + 2j * np.pi * n / period * tau)) @ turns - x)).real
    # Left out of the series: sum over n > 40000 of 0.8 / n^3 / (2 pi tau / period) < 1e-9.
    np.testing.assert_allclose(y, want, rtol=0, atol=1e-9)


def test_an_oscillator_rings_from_corner_to_corner():
    period, hertz, z = 0.05, 430.0, 0.004  # rings for 93 ms: the last corners matter
    t = np.arange(-400, 401) * (period / 400)
    x = triangle_wave(t, period)
    y = rows(oscillator(hertz, z), t, x, period=period, lead=400)[0]
    n = np.arange(1, 20001, 2)
    s = 2j * np.pi * n / period
    w0 = 2 * np.pi * hertz
    line = -8.0 / np.pi**2 / n**2 * w0**2 / (s**2 + 2 * z * w0 * s + w0**2)
    want = (line @ np.exp(2j * np.pi * n[:, None] * t[None, :] / period)).real
    np.testing.assert_allclose(y, want, rtol=0, atol=1e-10)
    assert np.abs(y - x).max() > 0.005  # 2 S / w0 = 0.06 at a corner


# --- sessions


def session(settled, gap, periods=4, same=False):
    """Two runs, `gap` s apart, in `respond_linear`, and as one long simulation by SciPy.

    The later drive, carried back by one step, is where the first one ends.
    """
    step, period = 5e-4, 0.05
    each = round(period / step)
    t = np.arange(-each, periods * each) * step
    second, shift = (1.0, 0.0) if same else (0.4, 0.6 * float(triangle_wave(-step, period)))
    later = t + periods * period - step + gap
    x = np.stack([triangle_wave(t, period), shift + second * triangle_wave(t, period)])
    y = rows(
        real(), np.stack([t, later]), x,
        period=period, lead=each, gap=[np.inf, gap], session=True, settled=settled,
    )  # fmt: skip
    first, before = triangle_wave(t[each:], period), round(gap / step)
    between = shift + second * triangle_wave(np.arange(-before, 0) * step, period)
    whole = np.concatenate([first, between[1:], shift + second * first])
    clock = np.arange(whole.size) * step
    long = triangle_wave(np.arange(400 * each + 1) * step, period)
    runs = []
    for tau in TAU:
        driven = lag(tau, np.arange(long.size) * step, long, long[0])[-1]
        runs.append(settled * driven + (1 - settled) * first[0])
    want = answer(real(), clock, whole, runs)
    return y[:, each:], want[: first.size], want[-first.size :]


@pytest.mark.parametrize("settled", [0.0, 1.0, 0.35])
@pytest.mark.parametrize("same", [True, False])
def test_runs_that_follow_at_once_are_one_history(settled, same):
    """A gap of one step is none: the end of one run and the start of the next are neighbours."""
    y, first, second = session(settled, 5e-4, same=same)
    np.testing.assert_allclose(y[0], first, rtol=0, atol=1e-10)
    np.testing.assert_allclose(y[1], second, rtol=0, atol=1e-10)


def test_a_settled_device_stays_settled():
    y, *_ = session(1.0, 5e-4, same=True)
    np.testing.assert_allclose(y[1], y[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("gap", [0.02, 0.05, 0.33, 2.0])
def test_in_a_gap_the_device_is_driven_as_in_the_later_run(gap):
    """Where the first run ends the drive jumps to the later one's, within one step."""
    y, first, second = session(0.0, gap)
    np.testing.assert_allclose(y[0], first, rtol=0, atol=1e-10)
    # The simulation takes the jump as a ramp of one step; half of that is the time in doubt.
    slack = 0.5 * 5e-4 * sum(abs(c) / tau for c, tau in zip(WEIGHT, TAU, strict=True))
    assert np.abs(y[1] - second).max() <= 2.0 * slack


def test_runs_without_a_common_clock_share_nothing():
    t = np.arange(-100, 100) * 5e-4
    x = triangle_wave(t, 0.05)
    once = rows(real(), t, x, period=0.05, lead=100, session=True, settled=0.3)
    twice = rows(
        real(), np.stack([t, t]), np.stack([x, x]),
        period=0.05, lead=100, gap=[np.inf, np.inf], session=True, settled=0.3,
    )  # fmt: skip
    np.testing.assert_allclose(twice, np.concatenate([once, once]), rtol=0, atol=1e-14)


def test_steps_and_holds_in_several_runs():
    """Rows without lead-in: rest at the first value, then one history over all runs."""
    step, each = 1e-3, 150
    t = np.arange(3 * each) * step
    x = np.floor(t / 0.1) ** 2 - np.cos(20 * t)  # no jump where a run ends
    parts, clocks = x.reshape(3, each), t.reshape(3, each)
    y = rows(real(), clocks, parts, gap=[np.inf, step, step], session=True)
    want = answer(real(), t, x, [x[0]] * 3).reshape(3, each)
    # Between runs the drive jumps in `y` and is a ramp of one step in `want`.
    jump = np.abs(parts[1:, 0] - parts[:-1, -1]).max()
    slack = 0.5 * step * jump * sum(abs(c) / tau for c, tau in zip(WEIGHT, TAU, strict=True))
    np.testing.assert_allclose(y[0], want[0], rtol=0, atol=1e-10)
    assert np.abs(y - want).max() <= 2.0 * slack
    alone = rows(real(), clocks, parts)
    assert np.abs(alone - want).max() > 10.0 * slack


@pytest.mark.parametrize("in_periods", [0.0, 0.4])  # of the lead
@pytest.mark.parametrize("lead_s", [0.02, 0.13, 0.5])
def test_a_rest_between_runs_and_before_the_first(lead_s, in_periods):
    """Rest, a run whose drive was on for `lead_s`, a rest, and another, as one long record."""
    step, period, periods, rest, gap = 5e-4, 0.05, 3, 0.35, 1.3
    count, lead = round(periods * period / step), round(lead_s / step)
    per = round(period / step)
    t = np.arange(-per, count) * step
    runs = [triangle_wave(t, period), 2.0 * triangle_wave(t, period) + 0.4]
    level = runs[0][per] + rest * np.ptp(runs[0])
    parts = []
    for k, x in enumerate(runs):
        index = (np.arange(-lead, count) % per) + per
        # Between the last sample of a run and its neighbour's drive lies the rest.
        still = round((2.0 if k == 0 else gap - lead_s) / step) - (k > 0)
        parts += [np.full(still, level), x[index]]
    record = np.concatenate(parts)
    at = np.arange(record.size) * step
    want = answer(real(), at, record, [level] * len(TAU))
    sizes = np.cumsum([p.size for p in parts])
    wanted = [want[e - count : e] for e in (sizes[1], sizes[3])]
    times = np.stack([t, t + (count - 1) * step + gap])
    past = Past(
        jnp.zeros(()), jnp.asarray(rest), jnp.asarray((1.0 - in_periods) * lead_s),
        jnp.asarray(in_periods * lead_s / period),
    )  # fmt: skip
    y = rows(
        real(), times, np.stack(runs),
        period=period, lead=per, gap=[np.inf, gap], session=True, past=past,
    )  # fmt: skip
    # The record takes each jump of the drive as a ramp of one step.
    jumps = max(np.abs(np.diff(record)).max(), 1.0)
    left = [abs(c) / tau * np.exp(-lead_s / tau) for c, tau in zip(WEIGHT, TAU, strict=True)]
    slack = 0.5 * step * jumps * sum(left)
    for row, expected in zip(y[:, per:], wanted, strict=True):
        assert np.abs(row - expected).max() <= 4.0 * slack
    driven = rows(
        real(), times, np.stack(runs),
        period=period, lead=per, gap=[np.inf, gap], session=True,
    )  # fmt: skip
    assert np.abs(driven[1, per:] - wanted[1]).max() > 20.0 * slack


# --- gradients


@jax.jit
def loss(tau, weight, settled):
    t = jnp.asarray(np.stack([np.arange(-50, 80), np.arange(81, 211)]) * 1e-3)
    x = jnp.asarray(triangle_wave(np.stack([np.arange(-50, 80)] * 2) * 1e-3, 0.05))
    history = History(jnp.full(2, 0.05), jnp.full(2, 50), jnp.array([jnp.inf, 2e-3]))
    past = Past.of(0.0)._replace(settled=settled)
    y = respond_linear(Modes(tau, weight), t, x, history, session=True, past=past)
    return y[:, 50::9].ravel()


def test_gradients_are_central_differences():
    at = (jnp.asarray(TAU), jnp.asarray(WEIGHT), jnp.array(0.4))
    found = jax.jit(jax.jacfwd(loss, argnums=(0, 1, 2)))(*at)
    backward = jax.jit(jax.jacrev(loss, argnums=(0, 1, 2)))(*at)
    for k in range(3):
        flat = np.ravel(at[k])
        got = np.asarray(found[k]).reshape(-1, flat.size)
        np.testing.assert_allclose(backward[k], found[k], rtol=1e-9, atol=1e-12)
        for i in range(flat.size):
            h = 1e-5 * flat[i]
            ends = []
            for sign in (1, -1):
                moved = flat.copy()
                moved[i] += sign * h
                new = list(at)
                new[k] = jnp.asarray(moved.reshape(np.shape(at[k])))
                ends.append(np.asarray(loss(*new)))
            want = (ends[0] - ends[1]) / (2 * h)
            scale = np.abs(want).max()
            np.testing.assert_allclose(got[:, i], want, rtol=0, atol=1e-6 * scale)


def test_the_gradient_of_a_lag_at_zero_is_the_slope():
    t = jnp.asarray(uneven(np.random.default_rng(9), 60, 0.1))
    x = jnp.sin(50 * t)
    ahead = np.asarray(respond_from_rest(real((1e-9,), (1.0,)), t, x) - x) / 1e-9
    found = jax.jacfwd(lambda tau: respond_from_rest(Modes(tau[None], jnp.ones(1)), t, x))(
        jnp.array(0.0)
    )
    gaps = float(jnp.diff(t).min())
    np.testing.assert_allclose(found, ahead, rtol=1e-9 / gaps, atol=1e-5)
    np.testing.assert_allclose(found[1:], -np.diff(x) / np.diff(t), rtol=1e-12)


def test_the_gradient_of_an_oscillator():
    t = jnp.asarray(np.arange(300) * 1e-4)
    x = jnp.asarray(triangle_wave(np.arange(300) * 1e-4, 0.02))

    def ring(hertz):
        tau = jax.lax.complex(0.1 / (2 * jnp.pi * hertz), 0.9 / (2 * jnp.pi * hertz))
        return respond_from_rest(Modes(tau[None], jnp.ones(1, dtype=complex)), t, x)

    ring = jax.jit(ring)
    found = jax.jacfwd(ring)(jnp.array(300.0))
    want = (ring(jnp.array(300.01)) - ring(jnp.array(299.99))) / 0.02
    np.testing.assert_allclose(found, want, rtol=0, atol=1e-6 * float(jnp.abs(want).max()))


# --- in the frequency domain


def test_the_transfer_function_is_that_of_scipy():
    hertz = np.array([0.0, 3.0, 80.0, 430.0, 5000.0])
    w0 = 2 * np.pi * 430.0
    found = transfer(oscillator(430.0, 0.05), jnp.asarray(hertz))
    system = scipy.signal.TransferFunction([w0**2], [1.0, 2 * 0.05 * w0, w0**2])
    want = scipy.signal.freqresp(system, 2 * np.pi * hertz)[1]
    np.testing.assert_allclose(found, want, rtol=1e-11)
    some = transfer(real(), jnp.asarray(hertz))
    want = 1 + sum(
        c * (1 / (1 + 2j * np.pi * hertz * tau) - 1) for c, tau in zip(WEIGHT, TAU, strict=True)
    )
    np.testing.assert_allclose(some, want, rtol=1e-13)
    assert found[0] == pytest.approx(1.0, abs=1e-13) and some[0] == 1.0


@pytest.mark.parametrize("count", [400, 401])
def test_what_is_undone_comes_back(count):
    """A smooth signal, that straight lines between samples follow to (pi 3 / 400)^2 / 3."""
    period = 0.05
    t = np.arange(-count, count) * (period / count)
    target = 3.0 + np.sin(2 * np.pi * t / period) + 0.2 * np.cos(6 * np.pi * t / period + 0.3)
    for modes in (real(), oscillator(430.0, 0.05)):
        given = invert_linear(modes, jnp.asarray(t[count:]), jnp.asarray(target[count:]))
        back = rows(modes, t, np.tile(given, 2), period=period, lead=count)[0, count:]
        bound = (np.pi * 3 / count) ** 2 / 3
        assert np.abs(back - target[count:]).max() <= bound
        assert np.abs(given - target[count:]).max() > 10 * bound


def test_a_frequency_that_is_lost_is_refused():
    t = jnp.arange(400.0) * 1e-6
    with pytest.raises(NotInvertible, match="500000 Hz.*Sample the target less densely"):
        invert_linear(oscillator(10.0, 0.05), t, jnp.sin(2 * jnp.pi * t / 4e-4))
