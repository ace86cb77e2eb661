"""The phase through a whole record: the analytic signal between turns, fits at them."""

import numpy as np

from ._fringe_signal import FringeSignal
from ._thresholds import THRESHOLDS
from .turns._laser_turn import LaserTurn
from .turns._thresholds import THRESHOLDS as TURN_THRESHOLDS


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
