r"""Plays over monotone stretches of the drive: the recursion over turning points alone.

Between two turning points a play is one clamp of its output $s$ at the first of them:
$v(t) = \max(l(t), \min(h(t), s))$, with the band $[l, h]$ of Eq. 12. For while the drive rises so
do both bounds, so that a clamp now contains all earlier ones of the stretch; the same holds while
it falls, and where the bounds are crossed, since $s$ is never below $l$ at the stretch's start. So
the recursion of Eq. 9 is needed at turning points only, and between them all plays are summed in
one pass. This holds where the falling bounds rise with the drive.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ._plays import Plays
from ._thresholds import THRESHOLDS

_PLAYS_A_PASS = 16  # as many as one pass over the samples holds in registers


class Stretches(NamedTuple):
    """The monotone stretches of a drive.

    - `turn`: the sample with which each stretch begins, the first being 0.
    - `index`: the stretch of each sample.
    """

    turn: Int[Array, "*runs turns"]
    index: Int[Array, "*runs time"]


def direction_changes(u: Float[np.ndarray, " time"]) -> Int[np.ndarray, " changes"]:
    """The samples from which on the drive `u` goes another way than before: up, down or level."""
    rises, falls = u[1:] > u[:-1], u[1:] < u[:-1]
    if np.count_nonzero(rises) + np.count_nonzero(falls) == rises.size:
        return np.flatnonzero(rises[1:] != rises[:-1]) + 1
    return np.flatnonzero((rises[1:] != rises[:-1]) | (falls[1:] != falls[:-1])) + 1


def turning_places(u: Float[np.ndarray, " time"]) -> Int[np.ndarray, " turns"]:
    """The samples at which the drive `u` turns; of equal ones the last."""
    changes = direction_changes(u)
    if not changes.size:
        return changes
    before = np.append(0, changes)
    way = np.sign(u[before + 1] - u[before])  # of each piece
    moves = np.flatnonzero(way)
    return before[moves[1:][way[moves[1:]] != way[moves[:-1]]]]


def find_stretches(
    u: Float[np.ndarray, "runs time"],
) -> tuple[Int[np.ndarray, "runs turns"], Int[np.ndarray, "runs time"]] | None:
    """The fields of `Stretches` of the drives `u`, one per row; `None` where these are short.

    The number of turns is that of the row with the most, raised to a power of two so that drives of
    one kind share compiled code; a row's last one is repeated.
    """
    turns = [turning_places(row) for row in u]
    count = 1 + max(turn.size for turn in turns)
    if count * THRESHOLDS.samples_a_turn > u.shape[1]:
        return None
    count = max(THRESHOLDS.least_turns, 1 << (count - 1).bit_length())
    turn = np.zeros((u.shape[0], count), dtype=np.int32)
    index = np.zeros(u.shape, dtype=np.int32)
    for row, found in enumerate(turns):
        turn[row, 1 : 1 + found.size] = found
        turn[row, 1 + found.size :] = found[-1] if found.size else 0
        ends = np.append(found, u.shape[1])
        index[row] = np.repeat(np.arange(ends.size, dtype=np.int32), np.diff(ends, prepend=0))
    return turn, index


def stretches_on_device(u: Float[np.ndarray, "runs time"]) -> Stretches | None:
    """The stretches of the drives `u`, one per row, as JAX arrays; `None` where they are short."""
    found = find_stretches(u)
    return None if found is None else Stretches(*jax.device_put(found))


def clamp_states(
    plays: Plays, turning: Float[Array, " turns"], start: Float[Array, " plays"]
) -> Float[Array, "turns plays"]:
    """The outputs at the turning points with drives `turning`, after `start` (Eq. 9)."""

    def step(before, u):
        after = plays.clamped(u, before)
        return after, after

    return jax.lax.scan(step, start, turning)[1]


def rising(plays: Plays, low: Float[Array, ""], high: Float[Array, ""]) -> Bool[Array, ""]:
    """Whether all falling bounds rise with the drive, between `low` and `high`."""
    return jnp.all((plays.falling(low) >= 0.0) & (plays.falling(high) >= 0.0))


def weighted_sum(
    plays: Plays,
    u: Float[Array, " time"],
    states: Float[Array, "turns plays"],
    index: Int[Array, " time"],
) -> Float[Array, " time"]:
    """The sum of all plays (Eq. 14), in one pass over the samples for every few of them.

    `states`: the outputs at the start of each stretch, `index`: the stretch of each sample.
    """
    count = plays.r.size
    bend = 0.0 if plays.bow is None or plays.u_0 is None else plays.bow * (u - plays.u_0) ** 2
    table = states.T

    def add(total, one):
        r, lam, shift, p, state = one
        held = state.at[index].get(mode="promise_in_bounds")
        return total + p * jnp.maximum(u - r, jnp.minimum(lam * u + shift + bend, held))

    rows = (plays.r, plays.lam, plays.eta * plays.r, plays.p, table)
    total = jnp.zeros_like(u)
    if count <= _PLAYS_A_PASS:
        for i in range(count):
            total = add(total, tuple(row[i] for row in rows))
        return total
    passes = -(-count // _PLAYS_A_PASS)
    short = passes * _PLAYS_A_PASS - count

    def grouped(row):  # plays with weight 0 fill the last pass
        filled = jnp.concatenate([row, jnp.zeros((short, *row.shape[1:]), row.dtype)])
        return filled.reshape(passes, _PLAYS_A_PASS, *row.shape[1:])

    def one_pass(total, group):
        for i in range(_PLAYS_A_PASS):
            total = add(total, tuple(row[i] for row in group))
        return total, None

    return jax.lax.scan(one_pass, total, tuple(grouped(row) for row in rows))[0]
