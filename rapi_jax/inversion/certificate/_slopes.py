r"""The smallest slope of an operator over every history of drives within a range.

Given its past, the slope of an operator's response to the next sample is $G'(u)$ and, for each play
in contact, $p_i$ on a rising drive and $p_i U_i'(u)$ on a falling one, with the falling bound
$U_i(u) = \lambda_i u + \eta_i r_i + c (u - u_0)^2$, mostly straight; where the band is crossed the
play is memoryless, with slope $p_i$ both ways. Which plays are in contact depends on the past only
through the last turning point $m$ that is not wiped out, as long as every $U_i$ rises:

- rising from $m$: those with $u \ge U_i(m) + r_i$;
- falling from $M$: those with $M \ge U_i(u) + r_i$.

For one $u$ the sets so reached are nested, and change with $u$ only in finitely many places (see
`Pieces`). So the smallest slope over every history within a range is found by looking at finitely
many pieces of $u$, on each of which only $G'$ varies and, where bounds bend, a linear function.
"""

from typing import NamedTuple

import numpy as np

from rapi_jax.plays._contact_intervals import Pieces


class Slopes(NamedTuple):
    """The smallest slopes in one direction, with every set of plays that can be in contact.

    The sets of a piece are nested: the first `k` plays of its `order`, for `k` from 0.
    """

    edges: np.ndarray
    gain: np.polynomial.Polynomial
    sums: np.ndarray  # what a set adds at drive 0, "pieces sets"; infinite where not a whole set
    tilts: np.ndarray  # by how much that grows with the drive
    least: np.ndarray  # the smallest slope, "pieces sets"
    place: np.ndarray  # where it is met
    order: np.ndarray
    reached: np.ndarray  # which plays can be in contact at all, "pieces plays"
    direction: str

    @property
    def best(self) -> tuple[float, float, str]:
        """The smallest of all, where it is met, and the direction."""
        at = np.unravel_index(int(np.argmin(self.least)), self.least.shape)
        return float(self.least[at]), float(self.place[at]), self.direction

    def contacts(self, piece: int) -> tuple[int, ...]:
        """The plays of the set with the smallest slope on a piece, counted from 1."""
        first = self.order[piece, : int(np.argmin(self.least[piece]))]
        return tuple(sorted(int(k) + 1 for k in first if self.reached[piece, k]))

    def where(self, piece: int, margin: float) -> tuple[float, float]:
        """First and last place of a piece where the slope of some set is not above `margin`."""
        bad = np.flatnonzero(self.least[piece] <= margin)
        ends = []
        for tilt in np.unique(self.tilts[piece, bad]):  # of equal ones the lowest holds the others
            added = self.sums[piece, bad[self.tilts[piece, bad] == tilt]].min()
            slope = self.gain + np.polynomial.Polynomial([added - margin, tilt])
            ends.append(_not_positive(slope, *self.edges[piece : piece + 2]))
        return min(low for low, _ in ends), max(high for _, high in ends)


def smallest_slopes(pieces: Pieces, gain: np.polynomial.Polynomial, direction: str) -> Slopes:
    """The smallest slope on each piece for each set of plays that can be in contact."""
    u = (pieces.edges[:-1] + pieces.edges[1:]) / 2
    turn = pieces.turn[direction]
    # Rising from m: in contact where m <= turn, the largest m being u itself. Falling from M: where
    # M >= turn, the smallest M being u.
    key = np.minimum(turn, u[:, None]) if direction == "up" else np.maximum(turn, u[:, None])
    reached = key >= pieces.low if direction == "up" else key <= pieces.high
    order = np.argsort(-key if direction == "up" else key, axis=1, kind="stable")
    ordered = np.take_along_axis(key, order, 1)
    # A set is whole only where the next play comes later; before the first, there may be none.
    whole = np.concatenate(
        [
            ordered[:, :1] != u[:, None],
            ordered[:, 1:] != ordered[:, :-1],
            np.ones((u.size, 1), dtype=bool),
        ],
        axis=1,
    )

    def summed(added: np.ndarray) -> np.ndarray:
        each = np.take_along_axis(np.where(reached, added, 0.0), order, 1)
        return np.concatenate([np.zeros((u.size, 1)), np.cumsum(each, axis=1)], axis=1)

    sums = np.where(whole, summed(pieces.slope[direction]), np.inf)
    tilts = summed(pieces.tilt[direction])
    least, place = _lowest(gain, sums, tilts, pieces.edges)
    return Slopes(pieces.edges, gain, sums, tilts, least, place, order, reached, direction)


def _lowest(
    gain: np.polynomial.Polynomial, sums: np.ndarray, tilts: np.ndarray, edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The smallest value of `gain(u) + sum + tilt u` on each stretch between `edges`, and where."""
    low, high = edges[:-1, None], edges[1:, None]
    ends = [np.broadcast_to(x, sums.shape) for x in (low, high)]
    places = np.stack([*ends, *np.clip(_flat(gain, tilts), low, high)])
    values = gain(places) + sums + tilts * places
    best = np.argmin(values, axis=0)[None]
    return np.take_along_axis(values, best, 0)[0], np.take_along_axis(places, best, 0)[0]


def _flat(gain: np.polynomial.Polynomial, tilts: np.ndarray) -> np.ndarray:
    """Where the derivative of `gain(u) + tilt u` is zero, "roots pieces sets".

    Of complex ones the real part: to look in one place more does no harm.
    """
    bend = gain.deriv().trim()
    count = bend.degree()
    if count < 1:
        return np.zeros((0, *tilts.shape))
    if not tilts.any():
        return np.broadcast_to(bend.roots().real[:, None, None], (count, *tilts.shape))
    lead = bend.coef[-1]
    companion = np.zeros((*tilts.shape, count, count))
    companion[..., range(1, count), range(count - 1)] = 1.0
    companion[..., -1] = -bend.coef[:-1] / lead
    companion[..., 0, -1] -= tilts / lead
    return np.moveaxis(np.linalg.eigvals(companion).real, -1, 0)


def _not_positive(poly: np.polynomial.Polynomial, low: float, high: float) -> tuple[float, float]:
    """First and last place of `[low, high]` where `poly` is not positive."""
    roots = poly.roots()
    real = roots[np.abs(roots.imag) < 1e-9 * (1 + np.abs(roots))].real
    places = np.sort(np.concatenate([[low, high], real[(real > low) & (real < high)]]))
    middle = (places[:-1] + places[1:]) / 2
    bad = np.flatnonzero(poly(middle) <= 0)
    if not bad.size:  # touches zero at one point
        at = places[int(np.argmin(poly(places)))]
        return float(at), float(at)
    return float(places[bad[0]]), float(places[bad[-1] + 1])
