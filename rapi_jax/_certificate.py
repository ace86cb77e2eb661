r"""Where an operator is monotone in the drive, exactly: the condition under which it inverts.

Given its past, the slope of an operator's response to the next sample is $G'(u)$ and, for each play
in contact, $p_i$ on a rising drive and $p_i\lambda_i$ on a falling one; where the band is crossed
the play is memoryless, with slope $p_i$ both ways. Which plays are in contact depends on the past
only through the last turning point $m$ that is not wiped out:

- rising from $m$: those with $u \ge \lambda_i m + (1+\eta_i) r_i$;
- falling from $M$: those with $M \ge \lambda_i u + (1+\eta_i) r_i$.

For one $u$ the sets so reached are nested, and change with $u$ only where two of these straight
lines meet. So the smallest slope over every history within a range is found by looking at finitely
many pieces of $u$, on each of which only the polynomial $G'$ varies.
"""

import dataclasses
from typing import Any

import numpy as np

from ._errors import ModelError
from ._precision import as_float64, float64
from .operators import AbstractOperator

_MARGIN = 1e-9  # of the mean slope: below it a model is singular to rounding


class NotInvertible(ModelError):
    """A model without an inverse on the range asked for; says where it is not monotone."""


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
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(f"`low` must lie below `high`, both finite, but they are {low}, {high}.")
    u_pp = float(high - low) if u_pp is None else float(u_pp)
    plays = operator.plays(as_float64(u_pp), as_float64(freq))
    r, lam, eta, p = (np.asarray(x, float) for x in (plays.r, plays.lam, plays.eta, plays.p))
    gain = np.polynomial.Polynomial([0.0, *np.asarray(operator.coefficients, float)]).deriv()
    origin = -float(operator.centred(as_float64(0.0)))
    low, high = float(low) - origin, float(high) - origin  # as plays and polynomial see it
    reasons = _broken(r, lam, eta, p, gain.coef)
    failures: tuple[Failure, ...] = ()
    least = (-np.inf, low, "up")
    if not reasons:
        pieces = _Pieces.of(r, lam, eta, p, low, high)
        stretches = [_worst(pieces, gain, direction) for direction in ("up", "down")]
        least = min(best for best, _ in stretches)
        scale = abs(float(gain.integ()(high) - gain.integ()(low))) / (high - low) + np.abs(p).sum()
        failures = tuple(_failed(stretches, _MARGIN * scale, origin))
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
        crossed=tuple((i, a + origin, b + origin) for i, a, b in _crossed(r, lam, eta, low, high)),
        negative=tuple(int(i) + 1 for i in np.flatnonzero(r < 0)),
        reasons=tuple(reasons),
    )


def _broken(r, lam, eta, p, coefficients) -> list[str]:
    if not all(np.isfinite(x).all() for x in (r, lam, eta, p, coefficients)):
        return ["a parameter is not a number"]
    flat = np.flatnonzero((lam <= 0) & (p != 0))
    if flat.size:
        where = ", ".join(str(i + 1) for i in flat[:5])
        return [f"`lam` is not positive in play {where}: its falling bound does not fall"]
    return []


def _listed(plays: tuple[int, ...]) -> str:
    shown = ", ".join(map(str, plays[:5])) + (", ..." if len(plays) > 5 else "")
    return f"play{'s' if len(plays) > 1 else ''} {shown}"


def _crossing(lam: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Where `(1 - lam) u = (1 + eta) r`; NaN where the bounds are parallel."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(lam == 1.0, np.nan, width / (1.0 - lam))


def _crossed(r, lam, eta, low, high):
    """Stretches of the range with `u - r` above `lam u + eta r`."""
    width = (1.0 + eta) * r
    for i, at in enumerate(_crossing(lam, width)):
        begin, end = (low, high) if np.isnan(at) else (max(low, at), high)
        if lam[i] > 1.0:
            begin, end = low, min(high, at)
        if (lam[i] != 1.0 and begin < end) or (lam[i] == 1.0 and width[i] < 0):
            yield i + 1, float(begin), float(end)


@dataclasses.dataclass(frozen=True, eq=False)
class _Pieces:
    """Stretches of drive on which the sets of plays in contact do not change."""

    edges: np.ndarray
    turn: dict[str, np.ndarray]  # turning point at which each play comes into contact, per piece
    slope: dict[str, np.ndarray]  # what each play then adds
    low: float
    high: float

    @classmethod
    def of(cls, r, lam, eta, p, low, high) -> "_Pieces":
        width = (1.0 + eta) * r
        i, j = np.triu_indices(r.size, 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            meet_up = (lam[j] * width[i] - lam[i] * width[j]) / (lam[j] - lam[i])
            meet_down = (width[j] - width[i]) / (lam[i] - lam[j])
        special = np.concatenate(
            [lam * low + width, (high - width) / lam, _crossing(lam, width), meet_up, meet_down]
        )
        inside = special[np.isfinite(special) & (special > low) & (special < high)]
        edges = np.unique(np.concatenate([[low, high], inside]))
        u = ((edges[:-1] + edges[1:]) / 2)[:, None]
        crossed = u - r > lam * u + eta * r
        return cls(
            edges,
            {"up": (u - width) / lam, "down": lam * u + width},
            {"up": np.broadcast_to(p, crossed.shape), "down": np.where(crossed, p, p * lam)},
            low,
            high,
        )


def _worst(pieces: _Pieces, gain: np.polynomial.Polynomial, direction: str):
    """The smallest slope with where it is met, and each piece's smallest slope."""
    u = (pieces.edges[:-1] + pieces.edges[1:]) / 2
    turn, added = pieces.turn[direction], pieces.slope[direction]
    # Rising from m: in contact where m <= turn, the largest m being u itself. Falling from M: where
    # M >= turn, the smallest M being u.
    key = np.minimum(turn, u[:, None]) if direction == "up" else np.maximum(turn, u[:, None])
    reached = key >= pieces.low if direction == "up" else key <= pieces.high
    order = np.argsort(-key if direction == "up" else key, axis=1, kind="stable")
    sums = np.cumsum(np.take_along_axis(np.where(reached, added, 0.0), order, 1), axis=1)
    ordered = np.take_along_axis(key, order, 1)
    # A set is whole only where the next play comes later; before the first, there may be none.
    whole = np.concatenate(
        [ordered[:, 1:] != ordered[:, :-1], np.ones((u.size, 1), dtype=bool)], axis=1
    )
    empty = ordered[:, :1] != u[:, None]
    sums = np.concatenate([np.where(empty, 0.0, np.inf), np.where(whole, sums, np.inf)], axis=1)
    at = np.argmin(sums, axis=1)
    plays_least = sums[np.arange(u.size), at]
    poly_least, place = _lowest(gain, pieces.edges)
    slopes = plays_least + poly_least
    worst = int(np.argmin(slopes))
    contacts = [
        tuple(sorted(int(k) + 1 for k in order[n, : at[n]] if reached[n, k])) for n in range(u.size)
    ]
    best = (float(slopes[worst]), float(place[worst]), direction)
    return best, (pieces.edges, slopes, plays_least, gain, contacts, direction)


def _lowest(poly: np.polynomial.Polynomial, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The smallest value of a polynomial on each stretch between `edges`, and where."""
    places = np.stack([edges[:-1], edges[1:]])
    roots = poly.deriv().roots() if poly.degree() > 1 else np.zeros(0)
    flat = np.sort(roots[np.abs(roots.imag) < 1e-12 * (1 + np.abs(roots))].real)
    for x in flat:
        clipped = np.clip(x, edges[:-1], edges[1:])
        places = np.concatenate([places, clipped[None, :]])
    values = poly(places)
    best = np.argmin(values, axis=0)
    columns = np.arange(edges.size - 1)
    return values[best, columns], places[best, columns]


def _failed(stretches, margin: float, origin: float):
    """Joined stretches whose slope is not above `margin`, with their exact ends."""
    for _, (edges, slopes, added, gain, contacts, direction) in stretches:
        found: list[Failure] = []
        for n in np.flatnonzero(slopes <= margin):
            low, high = _where(gain + (added[n] - margin), edges[n], edges[n + 1])
            new = Failure(low + origin, high + origin, direction, float(slopes[n]), contacts[n])
            if found and abs(found[-1].high - new.low) < 1e-9 * (edges[-1] - edges[0]):
                last = found.pop()
                worse = min(last, new, key=lambda f: f.slope)
                new = dataclasses.replace(worse, low=last.low, high=new.high)
            found.append(new)
        yield from found


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
