"""The plays of one run and their derivatives, read off the bound that each touched last.

While both bounds of a play are monotone it is one clamp of its output at the beginning, so that the
recursion of Eq. 9 runs over turning points alone; at any time the output is the bound touched last,
at the drive of that contact, and so is its derivative.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int


class PlayNumbers(NamedTuple):
    """What the plays of one run are made of, see `rapi_jax.plays.Plays`; `start`: first outputs."""

    r: Float[np.ndarray, " plays"]
    lam: Float[np.ndarray, " plays"]
    eta: Float[np.ndarray, " plays"]
    p: Float[np.ndarray, " plays"]
    start: Float[np.ndarray, " plays"]
    bow: float
    u_0: float

    @classmethod
    def of(cls, vector: Float[np.ndarray, " numbers"]) -> "PlayNumbers":
        """From all of them in this order."""
        r, lam, eta, p, start = vector[:-2].reshape(5, -1)
        return cls(r, lam, eta, p, start, float(vector[-2]), float(vector[-1]))

    def upper(self, u: Float[np.ndarray, " time"]) -> Float[np.ndarray, "plays time"]:
        """The falling bounds at the drives `u` (Eq. 12)."""
        straight = self.lam[:, None] * u + (self.eta * self.r)[:, None]
        return straight + self.bow * (u - self.u_0) ** 2 if self.bow else straight

    def falls(self, low: float, high: float) -> bool:
        """Whether a falling bound falls while the drive rises, between `low` and `high`."""
        ends = (self.lam + 2.0 * self.bow * (u - self.u_0) for u in (low, high))
        return any(bool(np.any(slope < 0.0)) for slope in ends)


class DriveStretches(NamedTuple):
    """The drive of one run at the samples `u_turn` at which its stretches begin, and at others.

    `u`: at some samples, in any order; `stretch`: the stretch of each.
    """

    u_turn: Float[np.ndarray, " turns"]
    u: Float[np.ndarray, " time"]
    stretch: Int[np.ndarray, " time"]

    @classmethod
    def of(
        cls,
        u: Float[np.ndarray, " grid"],
        turn: Int[np.ndarray, " turns"],
        index: Int[np.ndarray, " grid"],
        at: Int[np.ndarray, " time"],
        numbers: PlayNumbers,
    ) -> "DriveStretches":
        """The drive `u` at the samples `at`; `turn`, `index`: see `rapi_jax.plays.Stretches`.

        A bent bound may fall and rise on one stretch. Then this begins anew where a bound turns,
        and where the two bounds of a play cross: between such samples a play is one clamp again.
        """
        if numbers.falls(float(u.min()), float(u.max())):
            lower, upper = u - numbers.r[:, None], numbers.upper(u)
            crossed, way = lower > upper, np.sign(np.diff(upper, axis=1))
            change = np.flatnonzero((crossed[:, 1:] != crossed[:, :-1]).any(axis=0))
            bound = np.flatnonzero((way[:, 1:] != way[:, :-1]).any(axis=0))
            turn = np.unique(np.concatenate([turn, change, change + 1, bound + 1]))
            index = np.searchsorted(turn, np.arange(u.size), side="right") - 1
        return cls(u[turn], u[at], index[at])


class _Contacts(NamedTuple):
    """Outputs of plays, the drive at the last contact, and with which bound it was."""

    output: Float[np.ndarray, "plays time"]
    drive: Float[np.ndarray, "plays time"]
    below: Bool[np.ndarray, "plays time"]
    above: Bool[np.ndarray, "plays time"]


def play_jacobian(
    numbers: PlayNumbers, drive: DriveStretches
) -> tuple[Float[np.ndarray, " time"], Float[np.ndarray, "numbers time"]]:
    """The weighted sum of the plays (Eq. 14), and its derivative by each of their numbers.

    Numbers in the order of `PlayNumbers`; one row more is the derivative by the drive itself, where
    all of it moves.
    """
    eta, p = numbers.eta[:, None], numbers.p[:, None]
    output, at, below, above = _contacts(numbers, drive)
    off = at - numbers.u_0
    bend = 2.0 * numbers.bow * off
    slope = np.where(above, numbers.lam[:, None] + bend, below)
    rows = [
        (eta * above - below) * p,  # r
        at * (above * p),  # lam
        above * (numbers.r[:, None] * p),  # eta
        output,  # p
        ~(above | below) * p,  # start
        np.sum(above * off**2 * p, axis=0, keepdims=True),  # bow
        np.sum(above * -bend * p, axis=0, keepdims=True),  # u_0
        np.sum(slope * p, axis=0, keepdims=True),
    ]
    return numbers.p @ output, np.concatenate(rows)


def _contacts(numbers: PlayNumbers, drive: DriveStretches) -> _Contacts:
    u_turn, u, stretch = drive
    lower_turn, upper_turn = u_turn[:, None] - numbers.r, numbers.upper(u_turn).T
    shape = (u_turn.size, numbers.r.size)
    states, at_turn = np.empty(shape), np.zeros(shape)
    below_turn, above_turn = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    state = numbers.start
    at, below, above = at_turn[0], below_turn[0], above_turn[0]
    for k, (lower, upper) in enumerate(zip(lower_turn, upper_turn, strict=True)):
        capped = np.minimum(upper, state)
        up = lower > capped
        down = ~up & (upper < state)
        state = np.maximum(lower, capped)
        at = np.where(up | down, u_turn[k], at)
        below, above = up | (below & ~down), down | (above & ~up)
        states[k], at_turn[k], below_turn[k], above_turn[k] = state, at, below, above
    before = states.T[:, stretch]
    lower, upper = u - numbers.r[:, None], numbers.upper(u)
    capped = np.minimum(upper, before)
    # At the turning point itself the output is on its bound: rounding must not decide again.
    moved = u != u_turn[stretch]
    up = moved & (lower > capped)
    down = moved & ~up & (upper < before)
    return _Contacts(
        np.maximum(lower, capped),
        np.where(up | down, u, at_turn.T[:, stretch]),
        up | (below_turn.T[:, stretch] & ~down),
        down | (above_turn.T[:, stretch] & ~up),
    )
