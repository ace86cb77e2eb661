"""Turns that the interferometer does not show: where they are, by the drive and the other turns.

A laser that turns where a fringe is at its extreme, as steeply before as after, leaves the same
fringes as one that goes on: a cosine is even about its extremes. The fringes then say that a turn
is at one of these extremes, half a fringe apart, but not at which.
"""

import dataclasses

import numpy as np

from rapi_jax.readout._fringe_signal import FringeSignal
from rapi_jax.recording._drive import Drive

from ._given_fringe import turn_on_fringe
from ._laser_turn import LaserTurn
from ._thresholds import THRESHOLDS


def is_visible(turn: LaserTurn) -> bool:
    """Whether the fringes, or the cavity, tell this turn from none."""
    return turn.fringe_orders is not None or turn.evidence > THRESHOLDS.visible_evidence


def usual_lag(found: list[LaserTurn], rising_after: bool) -> float:
    """How late the laser turned elsewhere, s: in the same direction, where there are such turns."""
    same = [turn.lag_s for turn in found if turn.rising_after == rising_after]
    return float(np.median(same or [turn.lag_s for turn in found]))


def place_hidden_turns(
    signal: FringeSignal,
    drive: Drive,
    visible: list[LaserTurn],
    hidden: list[LaserTurn],
    latest_s: float,
) -> list[LaserTurn]:
    """`hidden` turns on the extreme of a fringe that is nearest to where they are expected.

    Between two visible turns a period apart, that is where as many fringes lie before as after:
    a scan that repeats comes back as far as it went. Else it is as late after the drive as the
    visible turns are; where there are none, with the drive. `latest_s`: the longest latency, which
    is then how wrong the place may be.
    """
    return [_place(signal, drive, visible, turn, latest_s) for turn in hidden]


def _place(
    signal: FringeSignal,
    drive: Drive,
    visible: list[LaserTurn],
    turn: LaserTurn,
    latest_s: float,
) -> LaserTurn:
    fringe_s = float(signal.time[-1] - signal.time[0]) / max(1.0, float(signal.travel[-1]))
    between = _middle(signal, drive, visible, turn.drive_s)
    if between is not None:
        expected, error = between, 0.0
    elif visible:
        lags = [one.lag_s for one in visible]
        expected = turn.drive_s + usual_lag(visible, turn.rising_after)
        error = max(float(np.ptp(lags)), fringe_s / 2)
    else:
        expected, error = turn.drive_s, latest_s
    placed = turn_on_fringe(signal, turn, expected)
    if placed is None:
        return dataclasses.replace(turn, hidden_s=max(error, abs(turn.fit.time_s - expected)))
    return dataclasses.replace(placed, hidden_s=max(error, 1e-9))


def _middle(
    signal: FringeSignal, drive: Drive, visible: list[LaserTurn], drive_s: float
) -> float | None:
    """Half-way in fringes between the visible turns before and after, a period apart; or none."""
    before = max((v for v in visible if v.drive_s < drive_s), key=lambda v: v.drive_s, default=None)
    after = min((v for v in visible if v.drive_s > drive_s), key=lambda v: v.drive_s, default=None)
    if before is None or after is None or not drive.repeats:
        return None
    if abs((after.drive_s - before.drive_s) * drive.rate - 1.0) > 0.01:
        return None
    ends = np.interp([before.fit.time_s, after.fit.time_s], signal.time, signal.travel)
    return float(np.interp(ends.mean(), signal.travel, signal.time))


def describe_hidden(times: list[float], errors: list[float], turns: int) -> list[str]:
    """What to say of turns (s) that neither fringes nor cavity showed, placed within `errors`."""
    if not times:
        return []
    part = f"{len(times)} of {turns} turns of the laser, the first at {times[0]:.6g} s, do not show"
    which = "none of the laser's turns shows" if len(times) == turns else part
    return [
        f"{which} in the interferometer: the laser turns there where a fringe is at its extreme, "
        "as steeply before as after. Placed by the drive and the other turns, within "
        f"{1e3 * max(errors):.2g} ms; change the swing or the interferometer's path a little, or "
        "record a cavity too"
    ]
