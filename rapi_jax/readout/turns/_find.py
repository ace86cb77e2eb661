"""Which turns of the drive the laser answers in a record, and roughly when."""

import dataclasses

import numpy as np

from rapi_jax.readout._fringe_signal import FringeSignal
from rapi_jax.readout._fringes import Fringes
from rapi_jax.readout.cavity._peaks import Regions, turn_bracket
from rapi_jax.recording._drive import Drive

from ._drive_turns import drive_turns
from ._hidden import is_visible, place_hidden_turns, usual_lag
from ._laser_turn import LaserTurn, find_turn, refine_turn
from ._thresholds import THRESHOLDS


class CavityPeaks:
    """Cavity peaks by time, on the interferometer's count of fringes, before any of it is fitted.

    `ruler`: nominal fringes between orders.
    """

    def __init__(self, fringes: Fringes, regions: Regions | None, signal: FringeSignal) -> None:
        self.ruler = fringes.delay_s * fringes.fsr_ghz * 1e9
        self.time = self.width = np.zeros(0)
        if regions is not None:
            first, self.time, last = (
                fringes.start_s + at / fringes.sample_hz
                for at in (regions.first, regions.centre, regions.last)
            )
            ends = (np.interp(t, signal.time, signal.travel) for t in (first, last))
            self.width = -np.subtract(*ends)
        self.travel = np.interp(self.time, signal.time, signal.travel)

    def around(self, early_s: float, late_s: float) -> tuple[float, float] | None:
        """Two peaks of one order between which the laser turned, if they can be told."""
        if self.time.size < 5:
            return None
        on = self._on_a_peak(early_s, late_s)
        if on is not None:
            return on
        return turn_bracket(self.time, self.travel, self.ruler, early_s, late_s)

    def _on_a_peak(self, early_s: float, late_s: float) -> tuple[float, float] | None:
        """The neighbours of the one peak that is far too wide: the laser turned inside it.

        They are about an order away on both sides. Where one is not half an order away, the laser
        turned between those two, and the peak is wide for its noise or its power.
        """
        wide = self.width > THRESHOLDS.wide_peak * np.median(self.width)
        wide &= (self.time > early_s) & (self.time < late_s)
        wide[[0, -1]] = False
        if wide.sum() != 1:
            return None
        at = int(np.argmax(wide))
        if np.diff(self.travel[at - 1 : at + 2]).min() < 0.5 * self.ruler:
            return None
        return float(self.time[at - 1]), float(self.time[at + 1])


def find_turns(
    signal: FringeSignal, drive: Drive, marks: CavityPeaks
) -> tuple[list[LaserTurn], list[str]]:
    """All turns of the laser in the record, in order; and what was looked for in vain.

    Turns at the record's ends are looked for last, where the others say that they should be.
    """
    notes: list[str] = []
    start, stop = float(signal.time[0]), float(signal.time[-1])
    branch = (0.5 / drive.rate) if drive.repeats else float(drive.time[-1]) / 2
    late = (
        min(THRESHOLDS.latest_share * branch, THRESHOLDS.latest_s)
        if drive.repeats
        else THRESHOLDS.latest_share * branch
    )
    early = THRESHOLDS.earliest_share * branch + min(THRESHOLDS.earliest_s, 0.05 * branch)
    every = drive_turns(drive, start - late, stop + early)
    inside = [(t, up) for t, up in every if t - early > start and t + late < stop]
    found: list[LaserTurn] = []
    hidden: list[LaserTurn] = []
    fringe = (stop - start) / max(1.0, float(signal.travel[-1]))
    # Turns that the cavity brackets come first: their lag says where the others are.
    sure = [(t, up) for t, up in inside if marks.around(t - early, t + late) is not None]
    for t, up in sure + [turn for turn in inside if turn not in sure]:
        low, high = t - early, t + late
        if (t, up) not in sure and found:
            usual = usual_lag(found, up)
            near = 0.5 * abs(usual) + 6.0 * fringe + 0.03 * branch
            low, high = max(low, t + usual - near), min(high, t + usual + near)
        turn = _find_turn_between(signal, marks, t, up, low, high)
        if turn is None:
            notes.append(f"turn of the drive at {t:.6g} s: no turn of the laser found after it")
        else:
            (found if is_visible(turn) else hidden).append(turn)
    found += place_hidden_turns(signal, drive, found, hidden, late)
    edge = 2.0 * float(signal.time[1] - signal.time[0])
    for t, up in every:
        if (t, up) in inside:
            continue
        low, high = max(start, t - early), min(stop, t + late)
        expected = t + usual_lag(found, up) if found else None
        if expected is not None and marks.around(low, high) is None:
            near = 0.5 * abs(expected - t) + 6.0 * fringe + 0.03 * branch
            low, high = max(low, expected - near), min(high, expected + near)
        if high <= low:
            continue
        # Some fringes inside the record, there is a turn: the drive had one, and others followed.
        inner = THRESHOLDS.inner_edge * fringe
        if expected is not None and start + inner < expected < stop - inner:
            found.append(_turn_near(signal, drive, found, (t, up), expected, fringe, late))
            continue
        turn = _find_turn_between(signal, marks, t, up, low, high)
        if (
            turn is not None
            and turn.fringe_orders is None
            and turn.evidence < THRESHOLDS.edge_evidence
        ):
            turn = refine_turn(signal, turn)  # a sharp corner shows better in its own shape
        if turn is not None and (
            turn.fringe_orders is not None or turn.evidence > THRESHOLDS.edge_evidence
        ):
            found.append(turn)
        elif expected is not None and start + edge < expected < stop - edge:
            notes.append(
                f"turn near {expected:.6g} s is too near the record's edge to fit; the frequency "
                "beyond it is doubtful"
            )
    return sorted(found, key=lambda f: f.fit.time_s), notes


def _turn_near(
    signal: FringeSignal,
    drive: Drive,
    found: list[LaserTurn],
    drive_turn: tuple[float, bool],
    expected_s: float,
    fringe_s: float,
    latest_s: float,
) -> LaserTurn:
    """The turn near a time at which others say that it is: the one seen there, or else placed."""
    reach = THRESHOLDS.turn_scatter * fringe_s + float(np.ptp([turn.lag_s for turn in found]))
    turn = find_turn(signal, *drive_turn, expected_s - reach, expected_s + reach)
    if turn is not None and is_visible(turn):
        return turn
    blank = dataclasses.replace(found[-1], drive_s=drive_turn[0], rising_after=drive_turn[1])
    (placed,) = place_hidden_turns(signal, drive, found, [turn or blank], latest_s)
    return placed


def _find_turn_between(
    signal: FringeSignal,
    marks: CavityPeaks,
    drive_s: float,
    rising_after: bool,
    low: float,
    high: float,
) -> LaserTurn | None:
    ends = marks.around(low, high)
    if ends is not None:
        low, high = max(low, ends[0]), min(high, ends[1])
    return find_turn(signal, drive_s, rising_after, low, high, ends)
