"""The phase through a whole record: the analytic signal between turns, fits at them."""

import dataclasses

import numpy as np
from scipy import fft

from ._refine import smooth_phase
from ._thresholds import THRESHOLDS
from .turns._corner_model import TurnFit
from .turns._detect import (
    fit_parametric_turns,
    fit_sharp_turn,
    fit_spline_turns,
    fringes_passed,
    turn_candidates,
)
from .turns._spline_model import SplineFit
from .turns._thresholds import THRESHOLDS as TURN_THRESHOLDS


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


def analytic_phase(y: np.ndarray, highest: float) -> np.ndarray:
    """Phase of the analytic signal, unwrapped: rises wherever the fringe rate is not near 0.

    `highest`: highest fringe rate, cycles a sample; what is faster is noise. Where the analytic
    signal is small (the fringes stand still), noise would spin it: there the phase is taken
    straight across.
    """
    size = int(fft.next_fast_len(y.size) or y.size)
    spectrum = np.asarray(fft.fft(np.pad(y, (0, size - y.size), mode="reflect")))
    hz = np.fft.fftfreq(size)
    spectrum *= np.where(hz > 0, 2.0, 0.0) / (1.0 + (hz / (1.6 * highest)) ** 8)
    z = np.asarray(fft.ifft(spectrum))[: y.size]
    clear = np.flatnonzero(np.abs(z) > 0.4)
    if clear.size < 16:
        clear = np.arange(y.size)
    return _extrapolate_ends(np.interp(np.arange(y.size), clear, np.unwrap(np.angle(z[clear]))))


def _extrapolate_ends(phase: np.ndarray) -> np.ndarray:
    """The record's first and last 0.8 fringe, where the analytic signal fails, by extrapolation."""
    travel = fringes_passed(phase)
    for side in (slice(None), slice(None, None, -1)):
        from_edge = np.abs(travel - travel[side][0])
        outer, inner = from_edge < 0.8, (from_edge >= 0.8) & (from_edge < 4.0)
        if inner.sum() < 16:
            continue
        at = np.arange(phase.size) / phase.size
        origin = float(at[inner].mean())
        line = np.polyfit(at[inner] - origin, phase[inner], 2)
        phase[outer] = np.polyval(line, at[outer] - origin)
    return phase


@dataclasses.dataclass(frozen=True, eq=False)
class FringeSignal:
    """Normalised fringes on the decimated clock, with their analytic phase and its travel."""

    time: np.ndarray
    y: np.ndarray
    good: np.ndarray
    raw: np.ndarray
    phase: np.ndarray
    travel: np.ndarray

    @classmethod
    def of(
        cls, time: np.ndarray, y: np.ndarray, good: np.ndarray, highest: float
    ) -> "FringeSignal":
        """From normalised fringes; `highest` fringe rate in cycles a sample."""
        phase = analytic_phase(np.clip(y, -1.5, 1.5), highest)
        travel = fringes_passed(phase)
        return cls(time, y, good, phase, smooth_phase(time, phase, travel), travel)

    def at(self, time_s: float) -> int:
        """The sample at or after a time."""
        return int(np.clip(np.searchsorted(self.time, time_s), 0, self.time.size - 1))


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
        fits, onward = _fit_all_shapes(s, at, fringe_orders, None, 0)
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
        fits, onward = _fit_all_shapes(s, at, found.fringe_orders, found.fit, 2)
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


def _fit_all_shapes(
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


def refit_on_fringe(s: FringeSignal, found: LaserTurn, jump: int) -> LaserTurn:
    """The turn refitted on the fringe that takes `jump` fringes out of the phase after it."""
    at = s.at(found.fit.time_s)
    low = int(np.searchsorted(s.travel, s.travel[at] - THRESHOLDS.turn_outer))
    high = min(
        s.time.size - 1, int(np.searchsorted(s.travel, s.travel[at] + THRESHOLDS.turn_outer))
    )
    ends = found.fit.phase(s.time[[low, high]])
    twice = (ends[1] - ends[0] + s.raw[low] + s.raw[high]) / (2 * np.pi)
    fringe_order = round(float(twice)) + (jump if found.rising_after else -jump)
    place = int(
        np.clip(
            np.searchsorted(s.travel, s.travel[0] + (np.pi * fringe_order - s.raw[0]) / 2 / np.pi),
            0,
            s.time.size - 1,
        )
    )
    fits, onward = _fit_all_shapes(s, place, (fringe_order,), None, 3)
    if not fits:
        return found
    again = dataclasses.replace(
        found,
        fit=fits[0],
        fringe_orders=(fringe_order,),
        rivals=(),
        evidence=onward / fits[0].cost,
        hidden_s=0.0,
    )
    return refine_turn(s, again)


def turn_on_fringe(s: FringeSignal, found: LaserTurn, near_s: float) -> LaserTurn | None:
    """The turn on the extreme of a fringe that is nearest to a time; `None` where none fits."""
    at = s.at(near_s)
    order = round(float(np.interp(near_s, s.time, s.raw)) / np.pi)
    fits, onward = _fit_all_shapes(s, at, (order,), None, 0)
    if not fits:
        return None
    return dataclasses.replace(
        found, fit=fits[0], fringe_orders=(order,), rivals=(), evidence=onward / fits[0].cost
    )


def _criterion(fit: TurnFit | SplineFit) -> float:
    """Bayesian information criterion: the shape with fewest parameters that explains as much."""
    return fit.count * np.log(fit.cost + 1e-300) + fit.free * np.log(fit.count)


def join_branches(
    s: FringeSignal, turns: list[LaserTurn], rising_first: bool
) -> tuple[np.ndarray, list[str]]:
    """Phase of the whole record, rad, rising with the optical frequency; and what did not fit.

    Across each turn its own model leads; to both sides it hands over to the analytic signal,
    whose branch is moved by the whole number of fringes that makes them agree.
    """
    notes: list[str] = []
    sign = 1.0 if rising_first else -1.0
    phase = sign * s.phase
    for turn in turns:
        fit = turn.fit
        at = s.at(fit.time_s)
        low, high = np.searchsorted(
            s.travel, [s.travel[at] - TURN_THRESHOLDS.reach, s.travel[at] + TURN_THRESHOLDS.reach]
        )
        part = np.arange(low, high)
        if part.size < 8:
            continue
        before = -1.0 if turn.rising_after else 1.0
        local = before * fit.phase(s.time[part])
        distance = s.travel[part] - s.travel[at]
        left = (distance < -THRESHOLDS.turn_inner) & (distance > -THRESHOLDS.turn_outer)
        right = (distance > THRESHOLDS.turn_inner) & (distance < THRESHOLDS.turn_outer)
        if not left.any():
            left = distance <= 0
        if not right.any():
            right = distance >= 0
        gap = phase[part][left] - local[left]
        local = local + 2 * np.pi * np.round(np.median(gap) / (2 * np.pi))
        onward = -before * s.phase
        gap = local[right] - onward[part][right]
        shift = 2 * np.pi * np.round(np.median(gap) / (2 * np.pi))
        rest = float(np.median(np.abs(gap - shift)))
        if rest > 1.0:
            notes.append(
                f"turn at {fit.time_s:.6g} s: its fit and the fringes after it differ by "
                f"{rest / (2 * np.pi):.2f} fringe"
            )
        phase[at:] = onward[at:] + shift
        share = np.clip(
            (np.abs(distance) - THRESHOLDS.turn_inner)
            / (THRESHOLDS.turn_outer - THRESHOLDS.turn_inner),
            0.0,
            1.0,
        )
        phase[part] = share * phase[part] + (1 - share) * local
    return phase, notes
