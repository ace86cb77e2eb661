"""A turn of the laser in the fringes: found between two times, and fitted in every shape."""

import dataclasses

import numpy as np

from rapi_jax.readout._fringe_signal import FringeSignal

from ._corner_model import TurnFit
from ._detect import (
    fit_parametric_turns,
    fit_sharp_turn,
    fit_spline_turns,
    turn_candidates,
)
from ._spline_model import SplineFit


@dataclasses.dataclass(frozen=True, eq=False)
class LaserTurn:
    """A turn: its fit, the drive's turn (s) it answers, and the direction after it.

    `rivals`: other fringes that explain it nearly as well. `evidence`: how many times less it
    leaves unexplained than going on does. `fringe_orders`: where the
    cavity tells, the only fringes on which the phase may turn. `hidden_s`: how wrong the place may
    be of a turn that the fringes do not show, s; 0 where they do.
    """

    fit: TurnFit | SplineFit
    drive_s: float
    rising_after: bool
    rivals: tuple[TurnFit | SplineFit, ...]
    evidence: float
    fringe_orders: tuple[int, ...] | None
    hidden_s: float = 0.0

    @property
    def lag_s(self) -> float:
        """Laser's turn less the drive's, s."""
        return self.fit.time_s - self.drive_s


def find_turn(
    s: FringeSignal,
    drive_s: float,
    rising_after: bool,
    early_s: float,
    late_s: float,
    ends: tuple[float, float] | None = None,
) -> LaserTurn | None:
    """The laser's turn between two times; `None` where the record shows none there.

    `ends`: times of two cavity peaks of one order, before and after it. Then the phase is the same
    at both, which leaves one fringe on which it can fringe_order.
    """
    low, high = s.at(early_s), s.at(late_s)
    if high - low < 16:
        return None
    fringe_orders = None
    places = turn_candidates(s.time, s.phase, s.travel, low, high)
    if ends is not None:
        twice = float(np.sum(np.interp(ends, s.time, s.raw))) / (2 * np.pi)
        fringe_orders = (round(twice),)
        if abs(twice - round(twice)) > 0.25:
            fringe_orders = (int(np.floor(twice)), int(np.ceil(twice)))
        middle = (s.travel[s.at(ends[0])] + s.travel[s.at(ends[1])]) / 2
        places = [i for i in places if abs(s.travel[i] - middle) < 2.5][:3]
        places.insert(0, int(np.searchsorted(s.travel, middle)))
    found: list[LaserTurn] = []
    for at in places:
        if any(abs(s.travel[at] - s.travel[s.at(f.fit.time_s)]) < 0.3 for f in found):
            continue
        fits, onward = fit_all_shapes(s, at, fringe_orders, None, 0)
        fits = [f for f in fits if early_s <= f.time_s <= late_s]
        if fits:
            gain = onward / fits[0].cost
            found.append(LaserTurn(fits[0], drive_s, rising_after, (), gain, fringe_orders))
    if not found:
        return None
    least = min(
        f.fit.misfit for f in found if f.evidence >= min(2.0, max(g.evidence for g in found))
    )

    def score(f: LaserTurn) -> float:
        return min(np.log(f.evidence), 2.0) - 4.0 * max(np.log(f.fit.misfit / least), 0.0)

    return max(found, key=score)


def refine_turn(s: FringeSignal, found: LaserTurn) -> LaserTurn:
    """Fit again with the window centred on the turn; keep what else explains the fringes."""
    for _ in range(2):
        at = s.at(found.fit.time_s)
        fits, onward = fit_all_shapes(s, at, found.fringe_orders, found.fit, 2)
        if not fits:
            return found
        distinct: list[TurnFit | SplineFit] = []
        for f in fits:
            if all(abs(f.time_s - g.time_s) > 0.2 * f.unit for g in distinct):
                distinct.append(f)
        found = dataclasses.replace(
            found,
            fit=distinct[0],
            rivals=tuple(distinct[1:]),
            evidence=onward / distinct[0].cost,
        )
        if abs(s.travel[s.at(distinct[0].time_s)] - s.travel[at]) < 0.5:
            break
    return found


def fit_all_shapes(
    s: FringeSignal,
    at: int,
    fringe_orders: tuple[int, ...] | None,
    known: TurnFit | SplineFit | None,
    corners: int,
) -> tuple[list[TurnFit | SplineFit], float]:
    """Splines near sample `at`, and corners on the fringes of the best of them; best first."""
    shaped, onward = fit_spline_turns(
        s.time, s.y, s.good, s.raw, s.travel, at, fringe_orders, known
    )
    fits: list[TurnFit | SplineFit] = [*shaped]
    for seed in shaped[:corners]:
        fits += fit_parametric_turns(s.time, s.y, s.good, s.travel, at, seed)
    if shaped:
        fits += fit_sharp_turn(s.time, s.y, s.good, s.raw, s.travel, at, fringe_orders, known)
    return sorted(fits, key=_criterion), onward


def _criterion(fit: TurnFit | SplineFit) -> float:
    """Bayesian information criterion: the shape with fewest parameters that explains as much."""
    return fit.count * np.log(fit.cost + 1e-300) + fit.free * np.log(fit.count)
