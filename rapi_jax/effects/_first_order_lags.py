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
from rapi_jax.sampling._history import History

from ._base import ALWAYS_ON_S, Modes, Past, transfer
from ._thresholds import THRESHOLDS

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
    return _step_coefficients(step, tau).keep


def _advance(value: Array, one: tuple[_Step, Array, Array]) -> tuple[Array, Array]:
    step, before, after = one
    value = step.keep * value + step.before * before + step.after * after
    return value, value


def _lag_states(
    t: Float[Array, " time"],
    x: Float[Array, " time"],
    modes: Modes,
    start: Inexact[Array, " modes"],
) -> Inexact[Array, "time modes"]:
    """Each mode's lag of `x` at each sample; `start`: at the first."""
    steps = _step_coefficients(jnp.diff(t)[:, None], modes.tau[None, :])
    wide = x.astype(modes.tau.dtype)[:, None]
    rest = jax.lax.scan(_advance, start, (steps, wide[:-1], wide[1:]))[1]
    return jnp.concatenate([start[None, :], rest])


def _free_decay(t: Float[Array, " time"], modes: Modes) -> Inexact[Array, "time modes"]:
    """The decay of each mode since the first sample."""
    return _decay((t - t[0])[:, None], modes.tau[None, :]).at[0].set(1.0)


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
    zero = jnp.zeros(modes.tau.shape, dtype=modes.tau.dtype)

    def forced(t, x):
        """Lags from rest, relative to the first value."""
        return _lag_states(t, x - x[0], modes, zero)

    driven = jax.vmap(forced)(t, x)  # runs time modes
    free = jax.vmap(_free_decay, in_axes=(0, None))(t, modes)
    # The state at the first sample that returns after one period.
    turn = _step_coefficients(history.period_s[:, None], modes.tau[None, :])
    lost = turn.before + turn.after  # 1 - keep, with all its digits
    row = jnp.arange(t.shape[0])
    repeats = (history.period_s > 0)[:, None]
    periodic = driven[row, history.lead] / jnp.where(repeats, lost, 1.0)
    periodic = jnp.where(repeats, periodic, 0.0)
    wide = x.astype(modes.tau.dtype)[:, :, None]
    lags = driven + free * periodic[:, None, :] + wide[:, :1]
    if session:
        off = _carry_states(modes, t, wide, lags, history, past)
        since = t - t[row, history.lead][:, None]
        left = _decay(jnp.maximum(since, 0.0)[:, :, None], modes.tau[None, None, :])
        lags = lags + jnp.where((since >= 0)[:, :, None], left * off[:, None, :], 0.0)
    behind = jnp.where(
        jnp.abs(modes.tau) < THRESHOLDS.least_time_constant,
        _small_lag(modes, t, wide),
        lags - wide,
    )
    return x + jnp.sum(jnp.real(modes.weight[None, None, :] * behind), axis=2)


def _small_lag(modes, t, x):
    """Lag less signal to first order in `tau`: exactly zero, with a gradient, where `tau` is 0."""
    step = jnp.diff(t, axis=1, prepend=t[:, :1])[:, :, None].astype(x.dtype)
    rise = jnp.diff(x, axis=1, prepend=x[:, :1])
    slope = jnp.where(step == 0, 0.0, rise / jnp.where(step == 0, 1.0, step))
    return -modes.tau[None, None, :] * slope


def _carry_states(modes, t, x, lags, history, past):
    """Offsets of each run's initial states from those in `lags`, the states of each run alone."""
    rest = (past.rest * jnp.ptp(jnp.real(x[0]))).astype(x.dtype)
    level = x[0, history.lead[0]] + rest
    rests = past.lead_s < ALWAYS_ON_S

    def one(before, run):
        t, x, lags, lead, gap_s, period_s = run
        joined = jnp.isfinite(gap_s)
        gap_s = jnp.where(joined, gap_s, 0.0)
        # How long the run's drive was on before its first sample, and the state it started from.
        longest = jnp.where(joined, gap_s, past.lead_s)
        on = jnp.where(rests, jnp.minimum(past.lead_s, longest), gap_s)
        idle = _decay(jnp.maximum(gap_s - on, 0.0)[None], modes.tau)
        began = jnp.where(joined, level + idle * (before - level), x[lead] + rest)
        back = jnp.where(period_s > 0, on % jnp.where(period_s > 0, period_s, 1.0), 0.0)
        off = _decay(on[None], modes.tau) * (began - _interpolate_states(t[lead] - back, t, lags))
        off = off * jnp.where(joined, 1.0, 1.0 - past.settled)
        return lags[-1] + _decay((t[-1] - t[lead])[None], modes.tau) * off, off

    rows = (t, x, lags, history.lead, history.gap_s, history.period_s)
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
