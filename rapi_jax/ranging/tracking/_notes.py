"""What a reader should know of a track, as sentences."""

import numpy as np

from ._hypotheses import Best


def describe_track(
    observations, use, folded, best: Best, odds, scale, vibration, limits
) -> tuple[str, ...]:
    """What a reader should know of this track, as sentences."""
    time, notes = observations.time_s, []
    if odds < limits.ambiguous_odds:
        notes.append(
            f"Another track fits nearly as well (odds {odds:.3g} to 1). Give the range of expected "
            "distances, or record more scans."
        )
    if folded.any():
        notes.append(
            f"{folded.sum()} scan(s) are left out, their apparent distance being too near zero to "
            f"tell its sign; the first at {time[np.argmax(folded)]:.6g} s."
        )
    outliers = ~use & ~folded
    if outliers.any():
        notes.append(
            f"{outliers.sum()} scan(s) are gated as outliers; the first at "
            f"{time[np.argmax(outliers)]:.6g} s."
        )
    for k in np.flatnonzero(best.change):
        what = "the target moved to another distance" if best.change[k] == 2 else "motion changed"
        notes.append(f"Before {time[k]:.6g} s {what}.")
    if not best.use[-1]:
        notes.append("The last scan does not fit: the motion may have changed there.")
    if vibration > 0.0:
        notes.append(
            f"Scans scatter by {scale:.3g} times their errors, as where the target vibrates with "
            f"{vibration:.3g} m/s rms: velocities are those of its mean motion, their errors hold "
            "its vibration too."
        )
    elif scale > 1.0:
        notes.append(f"The stated errors are too small; they were scaled by {scale:.3g}.")
    return tuple(notes)
