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
from fitting.identification._thresholds import THRESHOLDS
from rapi_jax import ECDL
from rapi_jax.internal import Plays

from ._data import IntervalData


class Lines(NamedTuple):
    """Sums of plays on the intervals of all runs, `level + slope u`, and where they begin.

    One for each element of the parameter in which the weights of plays are linear, as if it were 1
    and the others 0.
    """

    level: Float[Array, "runs stretches intervals weights"]
    slope: Float[Array, "runs stretches intervals weights"]
    edge: Int[Array, "runs stretches edges"]


class IntervalResidual(eqx.Module):
    """`RunResidual` in few rows; `values` likewise, of a model without effects.

    Plays must have straight falling bounds that rise with the drive; else the rows are not numbers.
    With `projects` the weights of plays are those that leave least, whatever `values` says of them
    (variable projection); they must have no bounds.
    """

    ecdl: ECDL
    vector: ParameterVector = eqx.field(static=True)
    unknown: tuple[int, ...] = eqx.field(static=True)  # runs whose initial fractions end `values`
    projects: bool = eqx.field(static=True, default=False)

    def __call__(self, values: Array, data: IntervalData) -> Float[Array, " rows"]:
        return self.solved(values, data)[0]

    def solved(self, values: Array, data: IntervalData) -> tuple[Float[Array, " rows"], Array]:
        """The rows, and `values` with the weights for which they hold.

        Derivatives are those at fixed weights: at the best ones a step along them and the weights'
        own columns is that of the projected problem (L. Kaufman, BIT 15, 49, 1975).
        """
        columns, response = _rows(find_lines(self, values, data), data)
        weights = self.weights(values)
        if self.projects:
            rounding = data.smallest * data.x_of_u[1] ** 2
            best = _least(*jax.lax.stop_gradient((columns, response)), rounding)
            change = best - jax.lax.stop_gradient(weights)
            values, weights = values.at[self.weight_place].add(change), weights + change
        return columns @ weights + response, values

    @property
    def weight_place(self) -> slice:
        """Where the parameter in which weights are linear stands in `values`; empty without one."""
        name = self.ecdl.operator.weight
        return slice(0, 0) if name is None else self.vector.slice(name)

    def weights(self, values: Array) -> Float[Array, " weights"]:
        """What the lines are to be multiplied by."""
        return jnp.ones(1) if self.ecdl.operator.weight is None else values[self.weight_place]


def find_lines(residual: IntervalResidual, values: Array, data: IntervalData) -> Lines:
    """The sums of plays on the intervals of all runs, without their weights."""
    at = residual.weight_place
    unit = values.at[at].set(1.0)
    operator = residual.vector.put(residual.ecdl, unit).operator
    initial = jnp.full((data.freq.size, operator.count), jnp.nan)
    if residual.unknown:
        rest = values[residual.vector.size :].reshape(len(residual.unknown), -1)
        initial = initial.at[jnp.array(residual.unknown)].set(rest)
    each = jnp.eye(operator.count) if at.stop - at.start > 1 else jnp.ones((operator.count, 1))

    def one(u_pp, freq, u_min, initial, *drive):
        plays = operator.plays(u_pp, freq)
        return _lines(plays, plays.p[:, None] * each, u_min, initial, *drive)

    drive = data.u, data.begin, data.end, data.rises
    return jax.vmap(one)(data.u_pp, data.freq, data.u_min, initial, *drive)


def _lines(
    plays: Plays,
    shares: Float[Array, "plays weights"],
    u_min: Float[Array, ""],
    initial: Float[Array, " plays"],
    u: Float[Array, " nodes"],
    begin: Int[Array, " stretches"],
    end: Int[Array, " stretches"],
    rises: Bool[Array, " stretches"],
) -> Lines:
    """The sums of plays on each interval of a run."""
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
    level = lower @ (-plays.r[:, None] * shares) + upper @ (shift[:, None] * shares)
    level = level + (free * state[:, None, :]) @ shares
    slope = lower @ shares + upper @ (plays.lam[:, None] * shares)
    known = jnp.where(jnp.all(plays.lam > 0.0), 0.0, jnp.nan)
    return Lines(level + known, slope, edge)


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


def _rows(
    lines: Lines, data: IntervalData
) -> tuple[Float[Array, "rows weights"], Float[Array, " rows"]]:
    """Those of plays, one column a weight, and of the response."""
    middle, half = data.x_of_u
    level, slope = lines.level + lines.slope * middle, lines.slope * half  # of x
    runs, stretches, edges = lines.edge.shape
    flat = lines.edge.reshape(runs, -1)
    sums = jnp.take_along_axis(data.sums, flat[None], axis=2)
    sums = jnp.diff(sums.reshape(-1, runs, stretches, edges), axis=3)
    sums = jnp.moveaxis(sums, 0, 3)
    powers = data.order + 2
    # Products of each of the basis with 1 and with x; the response comes last.
    by_one = jnp.concatenate([sums[..., : powers - 1], sums[..., powers::2]], axis=-1)
    by_x = jnp.concatenate([sums[..., 1:powers], sums[..., powers + 1 :: 2]], axis=-1)
    # The linear part that takes away most; nothing, of the response.
    overlap = jnp.einsum("rsiw,rsik->rkw", level, by_one)
    overlap = overlap + jnp.einsum("rsiw,rsik->rkw", slope, by_x)
    overlap = jnp.einsum("rkw,rkq->qw", overlap[:, : data.size], data.linear)
    taken = jnp.einsum("rkq,qw->rkw", data.linear, overlap)
    level, slope = (x - taken[:, k, None, None] for k, x in enumerate((level, slope)))
    rest = -taken[0, 2:]
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
    scale = jnp.where(some, one, 0.0)
    factor = _factor(others, data.smallest).T
    columns = (
        scale[..., None] * level + mean[..., None] * slope + first[..., :-1] @ rest,
        deviation[..., None] * slope + second[..., :-1] @ rest,
        factor[:, :-1] @ rest,
    )
    response = [x[..., -1].ravel() for x in (first, second, factor)]
    columns = [x.reshape(-1, x.shape[-1]) for x in columns]
    return jnp.concatenate(columns), -data.scale * jnp.concatenate(response)


def _least(
    columns: Float[Array, "rows weights"],
    target: Float[Array, " rows"],
    rounding: Float[Array, ""],
) -> Float[Array, " weights"]:
    """The weights that leave least of `columns @ weights + target`, 0 where nothing fixes them.

    `rounding`: a sum of squares of a column that is no more than that.
    """
    square = jnp.sum(columns**2, axis=0)
    there = square > rounding
    unit = jnp.where(there, jnp.sqrt(jnp.where(there, square, 1.0)), jnp.inf)
    scaled = columns / unit[None, :]
    size, turn = jnp.linalg.eigh(scaled.T @ scaled)
    kept = size > THRESHOLDS.weight_rank
    solve = turn * jnp.where(kept, 1.0 / jnp.where(kept, size, 1.0), 0.0)[None, :] @ turn.T
    first = -solve @ (scaled.T @ target)
    left = target + scaled @ first  # once more: half of the digits are lost in squares
    return (first - solve @ (scaled.T @ left)) / unit


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
