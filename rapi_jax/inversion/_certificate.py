r"""Where an operator is monotone in the drive, exactly: the condition under which it inverts.

Given its past, the slope of an operator's response to the next sample is $G'(u)$ and, for each play
in contact, $p_i$ on a rising drive and $p_i U_i'(u)$ on a falling one, with the falling bound
$U_i(u) = \lambda_i u + \eta_i r_i + c (u - u_0)^2$, mostly straight; where the band is crossed the
play is memoryless, with slope $p_i$ both ways. Which plays are in contact depends on the past only
through the last turning point $m$ that is not wiped out, as long as every $U_i$ rises:

- rising from $m$: those with $u \ge U_i(m) + r_i$;
- falling from $M$: those with $M \ge U_i(u) + r_i$.

For one $u$ the sets so reached are nested, and change with $u$ only in finitely many places (see
`_pieces`). So the smallest slope over every history within a range is found by looking at finitely
many pieces of $u$, on each of which only $G'$ varies and, where bounds bend, a linear function.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from rapi_jax._errors import NotInvertible
from rapi_jax._precision import as_float64, float64
from rapi_jax.display._results import summarise_certificate
from rapi_jax.operators import AbstractOperator
from rapi_jax.plays._contact_intervals import Band, Pieces

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class Failure:
    """A stretch of drive on which some history makes the response fall as the drive rises."""

    low: float
    high: float
    direction: str  # of the drive: "up" or "down"
    slope: float  # the smallest there, response units per drive unit
    plays: tuple[int, ...]  # in contact at that slope, counted from 1


@dataclasses.dataclass(frozen=True)
class Certificate:
    """What was proved about an operator on a range of drive, at one scan rate and amplitude.

    - `invertible`: whether every history of drives within the range keeps the slope positive.
    - `low`, `high`, `u_pp`, `freq`: the range, the peak-to-peak drive in the thresholds, the rate.
    - `slope_min`, `slope_at`, `slope_direction`: the smallest slope and where it is met.
    - `failures`: where it is not positive. `crossed`: (play, from, to) where its band is crossed:
      memoryless there, and by itself no fault. `negative`: plays with a threshold below zero.

    >>> from rapi_jax import certify
    >>> from rapi_jax.examples import paper_device
    >>> proof = certify(paper_device().operator, 0.75, 5.25, 10.0)
    >>> proof.invertible, round(proof.slope_min, 1), proof.slope_direction  # GHz/V
    (True, 8.3, 'down')
    """

    invertible: bool
    low: float
    high: float
    u_pp: float
    freq: float
    slope_min: float
    slope_at: float
    slope_direction: str
    failures: tuple[Failure, ...]
    crossed: tuple[tuple[int, float, float], ...]
    negative: tuple[int, ...]
    reasons: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for a file."""
        return dataclasses.asdict(self)

    def summary(self) -> str:
        """The certificate as text for people."""
        return summarise_certificate(self).text()

    def _repr_html_(self) -> str:
        return summarise_certificate(self).html()

    def require(self) -> None:
        """Raise `NotInvertible` where there is no inverse."""
        if not self.invertible:
            raise NotInvertible(
                f"the model cannot be inverted between {self.low:.6g} and {self.high:.6g} at "
                f"{self.freq:g} Hz: {'; '.join(self.reasons)}. Scan less, move the bias, or "
                "identify the model again with more data."
            )


@float64
def certify(
    operator: AbstractOperator, low: float, high: float, freq: float, *, u_pp: float | None = None
) -> Certificate:
    """Prove or refuse that `operator` inverts for every drive within `low` and `high`.

    `freq` is the scan rate, Hz; `u_pp` the peak-to-peak drive in Eq. 11, by default the whole
    range.

    >>> from rapi_jax import certify
    >>> from rapi_jax.examples import paper_device
    >>> certify(paper_device().operator, 0.75, 5.25, 10.0).invertible
    True
    >>> certify(paper_device().operator, 0.0, 40.0, 10.0).invertible  # the cubic turns over
    False
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(f"`low` must lie below `high`, both finite, but they are {low}, {high}.")
    u_pp = float(high - low) if u_pp is None else float(u_pp)
    plays = operator.plays(as_float64(u_pp), as_float64(freq))
    band = Band.of(plays)
    gain = np.polynomial.Polynomial([0.0, *np.asarray(operator.coefficients, float)]).deriv()
    origin = -float(operator.centred(as_float64(0.0)))
    low, high = float(low) - origin, float(high) - origin  # as plays and polynomial see it
    reasons = _broken(band, gain.coef, low, high, origin)
    failures: tuple[Failure, ...] = ()
    least = (-np.inf, low, "up")
    if not reasons:
        pieces = Pieces.of(band, low, high)
        slopes = [_slopes(pieces, gain, direction) for direction in ("up", "down")]
        least = min(found.best for found in slopes)
        scale = abs(float(gain.integ()(high) - gain.integ()(low))) / (high - low)
        scale += np.abs(band.p).sum()
        failures = tuple(_failed(slopes, THRESHOLDS.least_slope * scale, origin))
        reasons = [
            f"on a drive going {f.direction} the response does not rise with it from {f.low:.6g} "
            f"to {f.high:.6g} (slope down to {f.slope:.4g}, with "
            f"{_listed(f.plays) if f.plays else 'no play'} in contact)"
            for f in failures
        ]
    return Certificate(
        invertible=not reasons,
        low=low + origin,
        high=high + origin,
        u_pp=u_pp,
        freq=float(freq),
        slope_min=float(least[0]),
        slope_at=float(least[1]) + origin,
        slope_direction=least[2],
        failures=failures,
        crossed=tuple((i, a + origin, b + origin) for i, a, b in band.crossed_stretches(low, high)),
        negative=tuple(int(i) + 1 for i in np.flatnonzero(band.r < 0)),
        reasons=tuple(reasons),
    )


def _broken(
    band: Band, coefficients: np.ndarray, low: float, high: float, origin: float
) -> list[str]:
    numbers = (band.r, band.lam, band.eta, band.p, band.bow, band.u_0, coefficients)
    if not all(np.isfinite(x).all() for x in numbers):
        return ["a parameter is not a number"]
    ends = np.stack([band.slope(low), band.slope(high)])
    flat = np.flatnonzero((ends <= 0).any(axis=0) & (band.p != 0))
    if not flat.size:
        return []
    where = ", ".join(str(i + 1) for i in flat[:5])
    if band.bow == 0.0:
        return [f"`lam` is not positive in play {where}: its falling bound does not fall"]
    i = int(flat[0])
    turns = band.u_0 - band.lam[i] / (2.0 * band.bow) + origin
    return [
        f"`lam + 2 bow (u - u_0)` is not positive all over the range in play {where}: its falling "
        f"bound turns over at {turns:.6g}"
    ]


def _listed(plays: tuple[int, ...]) -> str:
    shown = ", ".join(map(str, plays[:5])) + (", ..." if len(plays) > 5 else "")
    return f"play{'s' if len(plays) > 1 else ''} {shown}"


class _Slopes(NamedTuple):
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
            ends.append(_where(slope, *self.edges[piece : piece + 2]))
        return min(low for low, _ in ends), max(high for _, high in ends)


def _slopes(pieces: Pieces, gain: np.polynomial.Polynomial, direction: str) -> _Slopes:
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
    return _Slopes(pieces.edges, gain, sums, tilts, least, place, order, reached, direction)


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


def _failed(found: Sequence[_Slopes], margin: float, origin: float) -> Iterator[Failure]:
    """Joined stretches whose slope is not above `margin`, with their exact ends."""
    for slopes in found:
        failures: list[Failure] = []
        edges, least = slopes.edges, slopes.least.min(axis=1)
        for n in map(int, np.flatnonzero(least <= margin)):
            low, high = slopes.where(n, margin)
            new = Failure(
                low + origin, high + origin, slopes.direction, float(least[n]), slopes.contacts(n)
            )
            if failures and abs(failures[-1].high - new.low) < 1e-9 * (edges[-1] - edges[0]):
                last = failures.pop()
                worse = min(last, new, key=lambda f: f.slope)
                new = dataclasses.replace(worse, low=last.low, high=new.high)
            failures.append(new)
        yield from failures


def _where(poly: np.polynomial.Polynomial, low: float, high: float) -> tuple[float, float]:
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
