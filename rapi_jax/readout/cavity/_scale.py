"""The cavity's say: the fringe count checked and mended, the delay calibrated."""

import dataclasses

import numpy as np

from ._comb import Comb
from ._peaks import PeakFit

_TWO_PI = 2 * np.pi


@dataclasses.dataclass(frozen=True, eq=False)
class Slip:
    """A wrong number of fringes between two neighbouring peaks.

    `jump`: fringes too many. `turn`: the turn between them, -1 for none. `begin`, `end`: times of
    the peaks, s.
    """

    jump: int
    turn: int
    begin: float
    end: float


def find_slips(comb: Comb, fits: list[PeakFit], times: np.ndarray) -> tuple[list[Slip], np.ndarray]:
    """Slips between neighbouring peaks of the comb, and which turns have a peak on both sides."""
    checked = np.zeros(times.size, dtype=bool)
    found = []
    used = np.flatnonzero(comb.used)
    for a, b in zip(used[:-1], used[1:], strict=True):
        begin, end = fits[a].time_s, fits[b].time_s
        within = np.flatnonzero((times > begin) & (times < end))
        checked[within] = True
        jump = int(comb.slip[b] - comb.slip[a])
        if jump:
            found.append(Slip(jump, int(within[0]) if within.size else -1, begin, end))
    checked |= np.array(
        [any(f.turns and abs(f.time_s - t) < 1e-3 for f in fits) for t in times], dtype=bool
    )
    return found, checked


def list_off_comb_peaks(comb: Comb, fits: list[PeakFit], times: np.ndarray) -> list[str]:
    """Peaks that the comb does not expect, and orders that have none."""
    notes = [
        f"cavity: spurious peak at {fits[i].time_s:.6g} s, {comb.residual[i]:+.2f} fringe off the "
        "comb"
        for i in np.flatnonzero(~comb.used)
    ]
    used = np.flatnonzero(comb.used)
    for a, b in zip(used[:-1], used[1:], strict=True):
        begin, end = fits[a].time_s, fits[b].time_s
        missing = abs(int(comb.order[b] - comb.order[a])) - 1
        if missing > 0 and not ((times > begin) & (times < end)).any():
            notes.append(f"cavity: {missing} peak(s) missed between {begin:.6g} and {end:.6g} s")
    return notes


def correct_slips(
    found: list[Slip], time: np.ndarray, phase: np.ndarray, stderr: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Take slipped fringes out of the phase after them; between the two peaks it stays doubtful."""
    phase, stderr, notes = phase.copy(), stderr.copy(), []
    for slip in found:
        low, high = np.searchsorted(time, [slip.begin, slip.end])
        if slip.turn >= 0:
            place = float(times[slip.turn])
            cut = int(np.searchsorted(time, place))
        else:
            rate = np.gradient(phase[low:high])
            cut = low + int(np.argmax(np.abs(rate - np.median(rate))))
            place = float(time[cut])
        phase[cut:] -= _TWO_PI * slip.jump
        stderr[low:high] = np.hypot(stderr[low:high], _TWO_PI * abs(slip.jump) / np.sqrt(12))
        notes.append(
            f"wrong fringe: {slip.jump:+d} between the cavity peaks at {slip.begin:.6g} and "
            f"{slip.end:.6g} s, {'at the turn' if slip.turn >= 0 else 'near'} {place:.6g} s; "
            "mended by the comb"
        )
    return phase, stderr, notes
