"""The recursion of linear effects: first-order lags of a piecewise linear signal.

Exact for any spacing of the samples, so turning points may stand between even ones. A run may be
preceded by one period of its own signal; its periodic state then follows in closed form, without a
transient.
"""

from math import factorial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact

from rapi_jax._errors import NotInvertible
from rapi_jax.effects._thresholds import THRESHOLDS
from rapi_jax.sampling._history import History

from ._linear import ALWAYS_ON_S, Modes, Past, transfer

# Of h = step / tau: 1 - (1 - exp(-h)) / h - ... as power series from the first power on.
_BEFORE_SERIES = tuple(
    (-1.0) ** n * (1.0 / factorial(n + 1) - 1.0 / factorial(n)) for n in range(1, 9)
)
_AFTER_SERIES = tuple(-((-1.0) ** n) / factorial(n + 1) for n in range(1, 9))


class _Step(NamedTuple):
    """`L_after = keep L_before + before x_before + after x_after`, exact for a straight `x`."""

    keep: Array
    before: Array
    after: Array


def _step_coefficients(step: Array, tau: Array) -> _Step:
    """The coefficients for a step of `step` s; for `tau` = 0 their limits."""
    step = step.astype(tau.dtype)
    dead = jnp.abs(tau) < THRESHOLDS.least_time_constant
    h = step / jnp.where(dead, 1.0, tau)
    longest = THRESHOLDS.longest_decay
    keep = jnp.exp(-jnp.where(jnp.real(h) < longest, h, longest))
    # Where a step is short beside the lag the closed forms lose all digits.
    short = jnp.abs(h) < THRESHOLDS.series_step
    few, many = jnp.where(short, h, 0.0), jnp.where(short, 1.0, h)
    mean = (1.0 - keep) / many
    before = jnp.where(short, _sum_series(few, _BEFORE_SERIES), mean - keep)
    after = jnp.where(short, _sum_series(few, _AFTER_SERIES), 1.0 - mean)
    return _Step(
        jnp.where(dead, 0.0, keep), jnp.where(dead, 0.0, before), jnp.where(dead, 1.0, after)
    )


def _sum_series(h: Array, coefficients: tuple[float, ...]) -> Array:
    total = jnp.zeros_like(h)
    for coefficient in coefficients[::-1]:
        total = (total + coefficient) * h
    return total


def _decay(step: Array, tau: Array) -> Array:
    """The decay of each mode over `step` s."""
    dead = jnp.abs(tau) < THRESHOLDS.least_time_constant
    h = step.astype(tau.dtype) * (1.0 / jnp.where(dead, 1.0, tau))
    longest = THRESHOLDS.longest_decay
    return jnp.where(dead, 0.0, jnp.exp(-jnp.where(jnp.real(h) < longest, h, longest)))


def _lag_states(
    t: Float[Array, "time runs"], x: Inexact[Array, "time runs 1"], tau: Inexact[Array, " modes"]
) -> tuple[Inexact[Array, "time runs modes"], Inexact[Array, "time runs modes"]]:
    """Each mode's lag of `x` at each sample, from 0 at the first, and its decay since that one.

    Time comes first, so that a step of the recursion reads and writes memory in one piece.
    """
    steps = _step_coefficients(jnp.diff(t, axis=0, prepend=t[:1])[:, :, None], tau[None, None])

    def advance(states, one):
        step, before, after = one
        lag, decay = states
        states = step.keep * lag + step.before * before + step.after * after, step.keep * decay
        return states, states

    zero = jnp.zeros((t.shape[1], tau.size), dtype=tau.dtype)
    before = jnp.concatenate([x[:1], x[:-1]])
    return jax.lax.scan(advance, (zero, zero + 1.0), (steps, before, x))[1]


def respond_linear(
    modes: Modes,
    t: Float[Array, "runs time"],
    x: Float[Array, "runs time"],
    history: History,
    *,
    session: bool,
    past: Past,
) -> Float[Array, "runs time"]:
    """The output of a linear system for all runs of a session; see `Modes`.

    A row with a lead-in of one period is in its periodic state, any other starts at rest at its
    first value. With `session`, each later run continues from the end of the one before; `past`
    gives the state in the gaps between them and before the first.
    """
    t, x = t.T, x.T
    wide = x.astype(modes.tau.dtype)[:, :, None]
    driven, free = _lag_states(t, wide - wide[:1], modes.tau)
    # The state at the first sample that returns after one period.
    turn = _step_coefficients(history.period_s[:, None], modes.tau[None, :])
    lost = turn.before + turn.after  # 1 - keep, with all its digits
    runs, repeats = jnp.arange(t.shape[1]), (history.period_s > 0)[:, None]
    periodic = driven[history.lead, runs] / jnp.where(repeats, lost, 1.0)
    lags = driven + free * jnp.where(repeats, periodic, 0.0)[None] + wide[:1]
    if session:
        since = (t - t[history.lead, runs][None])[:, :, None]
        left = _decay(jnp.maximum(since, 0.0), modes.tau[None, None])
        off = _carried_states(modes, t, wide, lags, history, past)
        lags += jnp.where(since >= 0, left * off[None], 0.0)
    at_once = jnp.abs(modes.tau) < THRESHOLDS.least_time_constant
    weight = jnp.where(at_once, 0.0, modes.weight)
    behind = jnp.real(lags @ weight) - jnp.real(weight.sum()) * x
    # Of a mode without a lag to first order in it: exactly zero, with a gradient.
    delay = jnp.real(jnp.where(at_once, modes.weight * modes.tau, 0.0).sum())
    return (x + behind - delay * _slope(t, x)).T


def _slope(t: Float[Array, "time runs"], x: Float[Array, "time runs"]) -> Float[Array, "time runs"]:
    """The slope before each sample; 0 at the first."""
    step, rise = jnp.diff(t, axis=0, prepend=t[:1]), jnp.diff(x, axis=0, prepend=x[:1])
    return jnp.where(step == 0, 0.0, rise / jnp.where(step == 0, 1.0, step))


def _carried_states(
    modes: Modes,
    t: Float[Array, "time runs"],
    x: Inexact[Array, "time runs 1"],
    lags: Inexact[Array, "time runs modes"],
    history: History,
    past: Past,
) -> Inexact[Array, "runs modes"]:
    """Offsets of each run's initial states from those in `lags`, the states of each run alone."""
    runs = jnp.arange(t.shape[1])
    began_s, at_lead = t[history.lead, runs], x[history.lead, runs]
    joined = jnp.isfinite(history.gap_s)
    gap_s = jnp.where(joined, history.gap_s, 0.0)
    rest = (past.rest * jnp.ptp(jnp.real(x[:, 0]))).astype(x.dtype)
    # How long the run's drive was on before its first sample, and the state it started from.
    longest = jnp.where(joined, gap_s, past.lead_s)
    rests = past.lead_s < ALWAYS_ON_S
    on = jnp.where(rests, jnp.minimum(past.lead_s, longest), gap_s)
    period_s = jnp.where(history.period_s > 0, history.period_s, 1.0)
    back = jnp.where(history.period_s > 0, on % period_s, 0.0)
    at = jax.vmap(_interpolate_states, in_axes=(0, 1, 1))(began_s - back, t, lags)
    idle = _decay(jnp.maximum(gap_s - on, 0.0)[:, None], modes.tau[None])
    unsettled = jnp.where(joined, 1.0, 1.0 - past.settled)[:, None]
    fade = unsettled * _decay(on[:, None], modes.tau[None])
    end = _decay((t[-1] - began_s)[:, None], modes.tau[None])
    level = at_lead[0] + rest

    def one(before, run):
        joined, at_lead, at, idle, fade, end, last = run
        began = jnp.where(joined, level + idle * (before - level), at_lead + rest)
        off = fade * (began - at)
        return last + end * off, off

    rows = (joined, at_lead, at, idle, fade, end, lags[-1])
    return jax.lax.scan(one, jnp.zeros_like(lags[0, 0]), rows)[1]


def _interpolate_states(at, t, lags):
    """The states at time `at`, by linear interpolation between samples."""
    i = jnp.clip(jnp.searchsorted(t, at, side="right") - 1, 0, t.size - 2)
    step = t[i + 1] - t[i]
    along = ((at - t[i]) / jnp.where(step > 0, step, 1.0)).astype(lags.dtype)
    return lags[i] + along * (lags[i + 1] - lags[i])


def respond_from_rest(
    modes: Modes, t: Float[Array, " time"], x: Float[Array, " time"]
) -> Float[Array, " time"]:
    """The output for one run that starts at rest at its first value."""
    zero = jnp.zeros(1)
    alone = History(zero, jnp.zeros(1, dtype=jnp.int32), zero + jnp.inf)
    return respond_linear(modes, t[None, :], x[None, :], alone, session=False, past=Past.of(0.0))[0]


def invert_linear(
    modes: Modes, t: Float[Array, " time"], signal: Float[Array, " time"]
) -> Float[Array, " time"]:
    """The periodic input whose steady-state output is `signal`: one period, evenly sampled.

    By division in the frequency domain, hence for band-limited signals: next to a sharp corner it
    rings. Raises `NotInvertible` where the gain at a frequency is zero to rounding.
    """
    hertz = jnp.fft.rfftfreq(signal.size) / (t[1] - t[0])
    through = transfer(modes, hertz)
    worst = int(jnp.argmin(jnp.abs(through)))
    if not float(jnp.abs(through[worst])) > THRESHOLDS.least_gain:
        raise NotInvertible(
            f"nothing passes at {float(hertz[worst]):.6g} Hz (gain "
            f"{float(jnp.abs(through[worst])):.2g}), so no drive reaches the target there. Sample "
            "the target less densely, or leave the effect out of what is compensated."
        )
    return jnp.fft.irfft(jnp.fft.rfft(signal) / through, n=signal.size)
