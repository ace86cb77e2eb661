"""The output of linear effects: sums of first-order lags of a piecewise linear signal.

Exact for any spacing of the samples, so turning points may stand between even ones. A run may be
preceded by one period of its own signal; its periodic state then follows in closed form, without a
transient.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax._errors import NotInvertible
from rapi_jax.effects._thresholds import THRESHOLDS
from rapi_jax.sampling._history import History

from ._carried_states import Places, carried_states
from ._lag_recursion import decay, lag_recursion, rates, time_constants, weighted
from ._linear import Modes, Past, transfer


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
    rate, at_once = rates(modes.tau)
    weight = jnp.where(at_once, 0.0, modes.weight)
    level = x - x[:1]
    places = Places.of(t, history, past)
    samples = places.samples if session else places.samples[:1]
    total, kept = lag_recursion(t, level, rate, weight, samples)
    # The state at the first sample that returns after one period, if anything is lost in one.
    lost = -jnp.expm1(-time_constants(history.period_s[:, None], rate))
    returns = lost != 0
    first = jnp.where(returns, kept[0] / jnp.where(returns, lost, 1.0), 0.0)
    since_s, begin = t - t[:1], first[None]
    if session:
        since = jnp.take_along_axis(since_s, samples, axis=0)
        lags = kept + first[None] * decay(since[:, :, None], rate)
        off = carried_states(x, lags, rate, places, history, past)
        later = t >= places.began_s[None]
        since_s = jnp.where(later, t - places.began_s[None], since_s)
        begin = jnp.where(later[:, :, None], (lags[0] - kept[0] + off)[None], begin)
    total += weighted(begin * decay(since_s[:, :, None], rate), weight)
    behind = total - jnp.real(weight.sum()) * level
    return (x + behind - _delay(modes, at_once) * _slope(t, x)).T


def respond_from_rest(
    modes: Modes, t: Float[Array, " time"], x: Float[Array, " time"]
) -> Float[Array, " time"]:
    """The output for one run that starts at rest at its first value."""
    t, x = t[:, None], x[:, None]
    rate, at_once = rates(modes.tau)
    weight = jnp.where(at_once, 0.0, modes.weight)
    level = x - x[:1]
    total, _ = lag_recursion(t, level, rate, weight, jnp.zeros((0, 1), dtype=int))
    behind = total - jnp.real(weight.sum()) * level
    return (x + behind - _delay(modes, at_once) * _slope(t, x))[:, 0]


def _delay(modes: Modes, at_once: Array) -> Array:
    """Of the modes without a lag, to first order in it: zero, with a gradient; s."""
    return jnp.real(jnp.where(at_once, modes.weight * modes.tau, 0.0).sum())


def _slope(t: Float[Array, "time runs"], x: Float[Array, "time runs"]) -> Float[Array, "time runs"]:
    """The slope before each sample; 0 at the first."""
    step, rise = jnp.diff(t, axis=0, prepend=t[:1]), jnp.diff(x, axis=0, prepend=x[:1])
    return jnp.where(step == 0, 0.0, rise / jnp.where(step == 0, 1.0, step))


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
