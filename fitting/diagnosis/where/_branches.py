"""Branches of the drive: rising or falling, and how far along, at each phase of a run."""

import numpy as np
from jaxtyping import Bool, Float

from fitting.diagnosis.noise._periods import PeriodBlock
from rapi_jax import Drive
from rapi_jax.internal import branch_fraction


def branches(
    drive: Drive, block: PeriodBlock
) -> tuple[Bool[np.ndarray, " phases"], Float[np.ndarray, " phases"]]:
    """Whether each phase of a block is on a rising branch, and how far along it (0 to 1)."""
    if not block.repeats:  # the phase of a free drive is along its branches
        up = block.phase < 0.5
        return up, np.clip(2.0 * np.mod(block.phase, 0.5), 0.0, 1.0)
    low, high = drive._turning
    return branch_fraction(scan_phase(drive, block), 0.0, float(np.mod(high - low, 1.0)))


def scan_phase(drive: Drive, block: PeriodBlock) -> Float[np.ndarray, " phases"]:
    """Phase of each value since the drive's minimum, also where periods begin elsewhere."""
    if not block.repeats:
        return block.phase
    first = int(np.flatnonzero(drive.period >= 0)[0])
    begin = float(np.mod(drive.phase[first] + 0.5, 1.0)) - 0.5  # below 0 just before the minimum
    near = 0.5 / block.phase.size
    # A period that begins within half a sample of the minimum begins on the rising branch.
    if abs(begin) <= near:
        return np.maximum(block.phase + begin, 0.0)
    return np.mod(block.phase + begin, 1.0)
