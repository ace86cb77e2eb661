r"""Residuals compressed by contact intervals: a few rows, whatever the number of samples.

On an interval of samples between two contacts the sum of plays is $A + B u$, with $A$ and $B$ of
the parameters alone. Its squares summed over the samples are those of two numbers there, the
coefficients in an orthonormal basis of $1, u$ on the interval. What the linear part and the
response have besides is the same on all intervals, and leaves a few rows in all. Cost, gradient and
Gauss-Newton matrix are those of the samples to rounding; that an interval begins at another sample
changes none of their derivatives.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import ECDL
from rapi_jax.internal import Plays

from ._data import IntervalData


class Line(NamedTuple):
    """The sum of plays on the intervals of a run, `level + slope u`, and where they begin."""

    level: Float[Array, "stretches intervals"]
    slope: Float[Array, "stretches intervals"]
    edge: Int[Array, "stretches edges"]


class IntervalResidual(eqx.Module):
    """`RunResidual` in few rows; `values` likewise, of a model without effects.

    Plays must have straight falling bounds that rise with the drive; else the rows are not numbers.
    """

    ecdl: ECDL
    vector: ParameterVector = eqx.field(static=True)
    unknown: tuple[int, ...] = eqx.field(static=True)  # runs whose initial fractions end `values`

    def __call__(self, values: Array, data: IntervalData) -> Float[Array, " rows"]:
        return _rows(find_lines(self, values, data), data)


def find_lines(residual: IntervalResidual, values: Array, data: IntervalData) -> Line:
    """The sum of plays on the intervals of all runs, "runs" first in each field."""
    operator = residual.vector.put(residual.ecdl, values).operator
    initial = jnp.full((data.freq.size, operator.count), jnp.nan)
    if residual.unknown:
        rest = values[residual.vector.size :].reshape(len(residual.unknown), -1)
        initial = initial.at[jnp.array(residual.unknown)].set(rest)

    def one(u_pp, freq, u_min, initial, *drive):
        return _lines(operator.plays(u_pp, freq), u_min, initial, *drive)

    drive = data.u, data.begin, data.end, data.rises
    return jax.vmap(one)(data.u_pp, data.freq, data.u_min, initial, *drive)


def _lines(
    plays: Plays,
    u_min: Float[Array, ""],
    initial: Float[Array, " plays"],
    u: Float[Array, " nodes"],
    begin: Int[Array, " stretches"],
    end: Int[Array, " stretches"],
    rises: Bool[Array, " stretches"],
) -> Line:
    """The sum of plays on each interval of a run."""
    last = u.size - 1
    start = plays.start(u[:1], u_min, initial)

    def step(before, at_turn):
        low, high = at_turn - plays.r, plays.upper(at_turn)
        capped = jnp.where(high < before, high, before)
        after = jnp.where(low > capped, low, capped)  # Eq. (9)
        return after, after

    state = jax.lax.scan(step, start, u[jnp.minimum(begin, last)])[1]
    place = _changes(jax.lax.stop_gradient((plays, state)), u, begin, end, rises)
    contact = place[:, : plays.r.size]
    edge = jnp.sort(jnp.concatenate([begin[:, None], end[:, None], place], axis=1), axis=1)
    at = edge[:, :-1, None]
    touches = at >= contact[:, None, :]
    here = u[jnp.minimum(at, last)]
    shift = plays.eta * plays.r
    r, lam, eta_r = (x[None, None, :] for x in jax.lax.stop_gradient((plays.r, plays.lam, shift)))
    below = rises[:, None, None] | (here - r > lam * here + eta_r)
    # Which bound holds a play on an interval, if one does, is no matter of degree: so the sums over
    # plays, and their derivatives by all parameters at once, are products with these masks.
    masks = (touches & below, touches & ~below, ~touches)
    lower, upper, free = (mask.astype(u.dtype) for mask in masks)
    level = lower @ (-plays.p * plays.r) + upper @ (plays.p * shift)
    level = level + jnp.einsum("sip,sp->si", free, plays.p[None, :] * state)
    slope = lower @ plays.p + upper @ (plays.p * plays.lam)
    known = jnp.where(jnp.all(plays.lam > 0.0), 0.0, jnp.nan)
    return Line(level + known, slope, edge)


def _changes(
    given: tuple[Plays, Float[Array, "stretches plays"]],
    u: Float[Array, " nodes"],
    begin: Int[Array, " stretches"],
    end: Int[Array, " stretches"],
    rises: Bool[Array, " stretches"],
) -> Int[Array, "stretches changes"]:
    """Where contact begins in each stretch, then where falling plays go from bound to bound."""
    plays, state = given
    r, lam, shift = (x[None, :] for x in (plays.r, plays.lam, plays.eta * plays.r))
    contact = jnp.where(rises[:, None], state + r, (state - shift) / lam)
    meeting = jnp.broadcast_to((r + shift) / (1.0 - lam), contact.shape)
    return _first_beyond(jnp.concatenate([contact, meeting], axis=1), u, begin, end, rises)


def _first_beyond(
    level: Float[Array, "stretches levels"],
    u: Float[Array, " nodes"],
    begin: Int[Array, " stretches"],
    end: Int[Array, " stretches"],
    rises: Bool[Array, " stretches"],
) -> Int[Array, "stretches levels"]:
    """The first sample of each stretch at which the drive is beyond each level, by bisection."""
    up = rises[:, None]

    def halve(_, ends):
        low, high = ends
        middle = (low + high) // 2
        here = u[jnp.minimum(middle, u.size - 1)]
        beyond = jnp.where(up, here > level, here < level)
        open_ = low < high
        return (
            jnp.where(open_ & ~beyond, middle + 1, low),
            jnp.where(open_ & beyond, middle, high),
        )

    ends = tuple(jnp.broadcast_to(x[:, None], level.shape) for x in (begin, end))
    return jax.lax.fori_loop(0, u.size.bit_length(), halve, ends)[0]


def _rows(line: Line, data: IntervalData) -> Float[Array, " rows"]:
    """The rows whose squares sum to those of the weighted residuals."""
    middle, half = data.x_of_u
    level, slope = line.level + line.slope * middle, line.slope * half  # of x
    runs, stretches, edges = line.edge.shape
    flat = line.edge.reshape(runs, -1)
    sums = jnp.take_along_axis(data.sums, flat[None], axis=2)
    sums = jnp.diff(sums.reshape(-1, runs, stretches, edges), axis=3)
    sums = jnp.moveaxis(sums, 0, 3)
    powers = data.order + 2
    # Products of each of the basis with 1 and with x; the response comes last.
    by_one = jnp.concatenate([sums[..., : powers - 1], sums[..., powers::2]], axis=-1)
    by_x = jnp.concatenate([sums[..., 1:powers], sums[..., powers + 1 :: 2]], axis=-1)
    # The linear part that takes away most.
    overlap = jnp.einsum("rsi,rsik->rk", level, by_one) + jnp.einsum("rsi,rsik->rk", slope, by_x)
    overlap = jnp.einsum("rk,rkq->q", overlap[:, : data.size], data.linear)
    taken = data.linear @ overlap
    level, slope = level - taken[:, :1, None], slope - taken[:, 1:2, None]
    rest = jnp.append(-taken[0, 2:], -data.scale)
    # An orthonormal basis of 1 and x on each interval.
    some = sums[..., 0] > data.smallest
    one = jnp.sqrt(jnp.where(some, sums[..., 0], 1.0))
    mean = jnp.where(some, by_x[..., 0] / one, 0.0)
    left = sums[..., 2] - mean**2
    spread = left > data.smallest
    deviation = jnp.where(spread, jnp.sqrt(jnp.where(spread, left, 1.0)), 0.0)
    first = jnp.where(some[..., None], by_one[..., 2:] / one[..., None], 0.0)
    second = by_x[..., 2:] - mean[..., None] * first
    second = jnp.where(
        spread[..., None], second / jnp.where(spread, deviation, 1.0)[..., None], 0.0
    )
    both = jnp.stack([first, second])
    others = data.total - jnp.einsum("arsij,arsik->jk", both, both)
    rows = (
        jnp.where(some, one, 0.0) * level + mean * slope + first @ rest,
        deviation * slope + second @ rest,
    )
    factor = _factor(others, data.smallest)
    return jnp.concatenate([*(row.ravel() for row in rows), factor.T @ rest])


def _factor(matrix: Float[Array, "n n"], smallest: Float[Array, ""]) -> Float[Array, "n n"]:
    """The Cholesky factor; columns whose square is no more than rounding are left out."""
    size = matrix.shape[0]
    columns = []
    left = matrix
    for k in range(size):
        there = left[k, k] > smallest
        column = jnp.where(there, left[:, k] / jnp.sqrt(jnp.where(there, left[k, k], 1.0)), 0.0)
        column = jnp.where(jnp.arange(size) >= k, column, 0.0)
        left = left - column[:, None] * column[None, :]
        columns.append(column)
    return jnp.stack(columns, axis=1)
