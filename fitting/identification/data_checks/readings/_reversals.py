"""Responses that turn back while the drive goes on, as folded readings and butterfly loops do."""

import numpy as np

from fitting.identification.data_checks._fault import Fault, format_intervals
from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Run
from rapi_jax.internal import turning_samples


def check_reversals(run: Run) -> Fault | None:
    """A response that turns back in mid-branch: folded, or that of a ferroelectric switching."""
    places = find_reversals(run)
    if not places:
        return None
    up = run.drive.up[places]
    near = [f"{np.median(run.drive.value[places][way]):.3g}" for way in (up, ~up) if way.any()]
    text = (
        f"run {run.name!r}: the response turns back in mid-branch, near a drive of "
        f"{' and '.join(near)} (samples {format_intervals([(i, i) for i in places])}), while the "
        "drive goes on. The reading is rectified or folded (a magnitude, fringes without their "
        "direction), or a piezo is driven through its coercive voltage (a butterfly loop). Correct "
        "the reading, or keep the drive on one side of there."
    )
    return Fault("response turns back", run.name, text, tuple((i, i) for i in places))


def find_reversals(run: Run) -> list[int]:
    """The samples at which the response turns back in mid-branch, if most branches have one such.

    A response that lags turns as often as its drive, later: it has none.
    """
    drive, valid = run.drive.value, np.flatnonzero(run.valid)
    if run.drive.u_pp == 0 or not valid.size or run.span == 0:
        return []
    turns = turning_samples(drive, THRESHOLDS.branch_swing)
    extremes = valid[turning_samples(run.response[valid], THRESHOLDS.reversal_swing)]
    extremes = extremes[(extremes > valid[0]) & (extremes < valid[-1])]
    most = 1.0 - THRESHOLDS.reversal_inside
    found, branches, ends = [], 0, 0
    for begin, end in zip(turns[:-1], turns[1:], strict=True):
        length = drive[end] - drive[begin]
        if abs(length) < most * run.drive.u_pp:  # cut off by the record, or a smaller loop
            continue
        branches += 1
        here = extremes[(extremes >= begin) & (extremes < end)]
        along = (drive[here] - drive[begin]) / length
        inside = (along > 1.0 - most) & (along < most)
        ends += int((~inside).sum())
        found += here[inside].tolist() if inside.sum() == 1 else []
    # All but the first and last branch also end at a turn of the response; after a lag none does.
    enough = THRESHOLDS.reversal_share * branches
    return found if branches >= 2 and min(len(found), ends + 1) >= enough else []
