r"""The exact inverse over monotone stretches of the scan: a table of contacts, then all samples.

Where the scan is monotone so is the drive, and each play is one clamp of its output at the
stretch's start (see `plays._monotone_stretches`). So the roots at the turning points are found one
after the other; between them the response is a polynomial in the drive from each contact to the
next, and all samples are solved at once, each inside its interval.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from rapi_jax.operators import AbstractOperator, Plays
from rapi_jax.plays._monotone_stretches import Stretches, weighted_sum

from ._root import Scalar
from ._thresholds import THRESHOLDS


def contacts(
    plays: Plays,
    state: Float[Array, " plays"],
    rises: Bool[Array, ""],
    low: Scalar,
    high: Scalar,
) -> Float[Array, " contacts"]:
    """The drives between which no play changes its law on a stretch, ascending, ends included.

    `state`: the outputs at the stretch's start; falling bounds are straight and rise.
    """
    shift = plays.eta * plays.r
    contact = jnp.where(rises, state + plays.r, (state - shift) / plays.lam)
    meeting = (plays.r + shift) / (1.0 - plays.lam)
    inner = jnp.concatenate([contact, jnp.where(rises, high, meeting)])
    inner = jnp.clip(jnp.nan_to_num(inner, nan=high), low, high)
    return jnp.sort(jnp.concatenate([low[None], inner, high[None]]))


def solve_samples(
    operator: AbstractOperator,
    plays: Plays,
    y: Float[Array, " time"],
    stretches: Stretches,
    begun: tuple[Float[Array, " turns"], Float[Array, "turns plays"]],
    low: Scalar,
    high: Scalar,
) -> Float[Array, " time"]:
    """The drives for `y`, without derivative, between `low` and `high`.

    `begun`: drive and outputs of the plays at the start of each stretch. All drives count from the
    operator's origin.
    """
    turning, states = begun
    origin = -operator.centred(jnp.zeros(()))
    turn, index = stretches
    after = jnp.append(turn[1:], y.size - 1)
    rises = y[jnp.where(after > turn, after, y.size - 1)] > y[turn]
    lowest, highest = jnp.where(rises, turning, low), jnp.where(rises, high, turning)
    knots = jax.vmap(contacts, in_axes=(None, 0, 0, 0, 0))(plays, states, rises, lowest, highest)
    gain = jnp.concatenate([jnp.zeros(1), operator.coefficients])
    # On each interval the plays are level + slope u; by two values, so that no case is forgotten.
    values = jax.vmap(jax.vmap(lambda u, s: plays.p @ plays.clamped(u, s), in_axes=(0, None)))(
        knots, states
    )
    width = jnp.diff(knots, axis=1)
    slope = jnp.where(width > 0, jnp.diff(values, axis=1) / jnp.where(width > 0, width, 1.0), 0.0)
    responses = values + operator.memoryless(knots + origin)
    place = _interval(y, responses, index)
    at = index * (knots.shape[1] - 1) + place

    def given(table: Float[Array, "turns intervals"]) -> Float[Array, " time"]:
        return table.ravel().at[at].get(mode="promise_in_bounds")

    left, right, tilt = given(knots[:, :-1]), given(knots[:, 1:]), given(slope)
    begin, end = given(responses[:, :-1]), given(responses[:, 1:])
    rest = y - begin
    share = jnp.where(end > begin, rest / jnp.where(end > begin, end - begin, 1.0), 0.0)
    first = left + (right - left) * jnp.clip(share, 0.0, 1.0)
    # The polynomial less its value at the interval's left end, without cancellation of the two.
    constant = given(_horner(gain, knots[:, :-1]))
    small = THRESHOLDS.root_rounding * (jnp.abs(low) + jnp.abs(high))

    def go_on(carry):
        _, step, count = carry
        return (step > small) & (count < THRESHOLDS.interval_steps)

    def advance(carry):
        u, _, count = carry
        total, rate = _horner_with_slope(gain, u)
        error = tilt * (u - left) + (total - constant) - rest
        new = jnp.clip(u - error / (tilt + rate), left, right)
        new = jnp.where(jnp.isnan(new), u, new)
        return new, jnp.max(jnp.abs(new - u)), count + 1

    start = (first, jnp.asarray(jnp.inf), jnp.zeros((), dtype=jnp.int32))
    return jax.lax.while_loop(go_on, advance, start)[0]


def attach_samples(
    operator: AbstractOperator,
    plays: Plays,
    y: Float[Array, " time"],
    stretches: Stretches,
    states: Float[Array, "turns plays"],
    u: Float[Array, " time"],
) -> Float[Array, " time"]:
    """The drives `u` for `y` with their derivative in all else, as `attach` has it for one."""

    def error(u: Array) -> Array:
        total = weighted_sum(plays, operator.centred(u), states, stretches.index)
        return total + operator.memoryless(u) - y

    value, rate = jax.jvp(error, (u,), (jnp.ones_like(u),))
    rate = jax.lax.stop_gradient(rate)
    return u - value / jnp.where(rate == 0, 1.0, rate)


def _interval(
    y: Float[Array, " time"],
    responses: Float[Array, "turns contacts"],
    index: Int[Array, " time"],
) -> Int[Array, " time"]:
    """The interval of each sample among those of its stretch, by what it must answer."""
    last = responses.shape[1] - 2  # the last interval
    place = jnp.zeros(y.shape, dtype=jnp.int32)
    table, begin = responses.ravel(), index * responses.shape[1]
    for power in reversed(range(last.bit_length())):  # bit by bit
        trial = place + (1 << power)
        knot = table.at[begin + jnp.minimum(trial, last)].get(mode="promise_in_bounds")
        place = jnp.where((trial <= last) & (y > knot), trial, place)
    return place


def _horner(gain: Float[Array, " order"], u: Float[Array, "*any"]) -> Float[Array, "*any"]:
    total = jnp.zeros_like(u)
    for k in range(gain.size - 1, -1, -1):
        total = total * u + gain[k]
    return total


def _horner_with_slope(
    gain: Float[Array, " order"], u: Float[Array, "*any"]
) -> tuple[Float[Array, "*any"], Float[Array, "*any"]]:
    total, slope = jnp.zeros_like(u), jnp.zeros_like(u)
    for k in range(gain.size - 1, -1, -1):
        slope = slope * u + total
        total = total * u + gain[k]
    return total, slope
