r"""Where the plays in contact change: an operator's range of drive in finitely many pieces.

The falling bounds are $U_i(u) = \lambda_i u + \eta_i r_i + c (u - u_0)^2$ with one bend $c$ for
all, mostly 0. Rising from $m$ a play is in contact where $u \ge U_i(m) + r_i$, falling from $M$
where $M \ge U_i(u) + r_i$. Two plays come into contact at one turning point where two of these
curves meet; there the bend cancels, so the meeting points follow from straight lines.
"""

import dataclasses

import numpy as np

from ._plays import Plays


@dataclasses.dataclass(frozen=True, eq=False)
class Band:
    """The bands of all plays in plain numbers; drives count from the operator's origin."""

    r: np.ndarray
    lam: np.ndarray
    eta: np.ndarray
    p: np.ndarray
    bow: float
    u_0: float

    @classmethod
    def of(cls, plays: Plays) -> "Band":
        """The bands of `plays`; without a bow they are straight."""
        r, lam, eta, p = (np.asarray(x, float) for x in (plays.r, plays.lam, plays.eta, plays.p))
        bent = plays.bow is not None and plays.u_0 is not None
        bend = (float(plays.bow), float(plays.u_0)) if bent else (0.0, 0.0)  # type: ignore[arg-type]
        return cls(r, lam, eta, p, *bend)

    @property
    def width(self) -> np.ndarray:
        """`(1 + eta) r`: how far a drive turned at 0 goes before contact, were `lam` 1."""
        return (1.0 + self.eta) * self.r

    def bend(self, u: np.ndarray | float) -> np.ndarray | float:
        """What the bow adds to every falling bound."""
        return self.bow * (u - self.u_0) ** 2

    def slope(self, u: np.ndarray | float) -> np.ndarray:
        """The slopes of the falling bounds at `u`."""
        return self.lam + 2.0 * self.bow * (u - self.u_0)

    def reach(self, m: np.ndarray | float) -> np.ndarray:
        """How far a drive must rise from `m` to bring each play into contact."""
        return self.lam * m + self.width + self.bend(m)

    def turn(self, u: np.ndarray | float, near: float) -> np.ndarray:
        """The inverse of `reach`, where it rises: the turning point for contact at `u`.

        `near`: a drive at which it rises. Infinite where no turning point, or every one, would do;
        NaN for a bound that falls at `near`.
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            if self.bow == 0.0:
                return (u - self.width) / self.lam
            slope, short = self.slope(near), u - self.reach(near)
            under = slope**2 + 4.0 * self.bow * short
            found = near + 2.0 * short / (slope + np.sqrt(np.maximum(under, 0.0)))
            found = np.where(under < 0.0, -np.inf if self.bow > 0 else np.inf, found)
            return np.where(slope > 0.0, found, np.nan)

    def crossings(self) -> np.ndarray:
        """Where the bounds of each play meet, "meetings plays"; NaN where they do not."""
        gap = 1.0 - self.lam
        with np.errstate(invalid="ignore", divide="ignore"):
            if self.bow == 0.0:
                return np.where(gap == 0.0, np.nan, self.width / gap)[None, :]
            # bow x^2 - gap x + rest = 0 for x = u - u_0, by the form that does not cancel
            rest = self.width - gap * self.u_0
            root = np.sqrt(gap**2 - 4.0 * self.bow * rest)
            half = (gap + np.where(gap < 0.0, -root, root)) / 2.0
            return self.u_0 + np.stack([half / self.bow, rest / half])

    def crossed(self, u: np.ndarray) -> np.ndarray:
        """Whether the bounds of each play are crossed at `u`, a column."""
        return u - self.r > self.lam * u + self.eta * self.r + self.bend(u)

    def crossed_stretches(self, low: float, high: float) -> list[tuple[int, float, float]]:
        """(play, from, to): where in the range `u - r` lies above the falling bound."""
        found = []
        for i, meetings in enumerate(self.crossings().T):
            inside = meetings[(meetings > low) & (meetings < high)]
            edges = np.unique(np.concatenate([[low, high], inside]))
            middle = (edges[:-1] + edges[1:]) / 2
            with np.errstate(invalid="ignore"):
                room = (self.lam[i] - 1.0) * middle + self.width[i] + self.bend(middle)
            for n in np.flatnonzero(room < 0):
                found.append((i + 1, float(edges[n]), float(edges[n + 1])))
        return found


@dataclasses.dataclass(frozen=True, eq=False)
class Pieces:
    """Stretches of drive on which the sets of plays in contact do not change."""

    edges: np.ndarray
    turn: dict[str, np.ndarray]  # turning point at which each play comes into contact, per piece
    slope: dict[str, np.ndarray]  # what each play then adds, at drive 0
    tilt: dict[str, np.ndarray]  # by how much that grows with the drive
    low: float
    high: float

    @classmethod
    def of(cls, band: Band, low: float, high: float) -> "Pieces":
        """The pieces between `low` and `high`; falling bounds must rise there."""
        lam, width, p = band.lam, band.width, band.p
        middle = (low + high) / 2
        i, j = np.triu_indices(width.size, 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            meet_down = (width[j] - width[i]) / (lam[i] - lam[j])
            meet_up = (lam[j] * width[i] - lam[i] * width[j]) / (lam[j] - lam[i])
            meet_up = meet_up + band.bend(meet_down)  # the drive whose turning point that is
        special = np.concatenate(
            [
                band.reach(low),
                band.turn(high, middle),
                band.crossings().ravel(),
                meet_up,
                meet_down,
            ]
        )
        inside = special[np.isfinite(special) & (special > low) & (special < high)]
        edges = np.unique(np.concatenate([[low, high], inside]))
        u = ((edges[:-1] + edges[1:]) / 2)[:, None]
        crossed = band.crossed(u)
        tilt = np.where(crossed, 0.0, 2.0 * band.bow * p)
        return cls(
            edges,
            {"up": band.turn(u, middle), "down": band.reach(u)},
            {
                "up": np.broadcast_to(p, crossed.shape),
                "down": np.where(crossed, p, p * band.slope(0.0)),
            },
            {"up": np.zeros(crossed.shape), "down": tilt},
            low,
            high,
        )
