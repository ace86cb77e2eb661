"""Stretches in which the drive moves and no fringes pass: light blocked, laser off or standing."""

import numpy as np
from scipy import ndimage

from rapi_jax.recording._drive import Drive

from ._decimate import decimate
from ._fringes import Fringes, mask_clipped
from ._thresholds import THRESHOLDS


def find_vanished(fringes: Fringes, drive: Drive) -> list[tuple[float, float]]:
    """Times (s after the drive's start) from and to which the fringes are gone.

    Blocks of four fringes in which the signal spans a small part of what it spans in others,
    although the drive moves there as it does elsewhere: at a turn fringes are slow for both, and
    the laser's turn may be late.

    Raises `DataError` where there are no fringes at all.
    """
    mask = mask_clipped(fringes.interferometer, fringes.full_scale)
    data = decimate(fringes.interferometer, fringes.sample_hz, fringes.start_s, mask, drive)
    block = max(8, int(4.0 / (data.fringe_hz * data.step_s)))
    blocks = data.value.size // block
    if blocks < 3 * THRESHOLDS.vanished_blocks:
        return []
    edges = data.time[0] + (np.arange(blocks + 1) * block - 0.5) * data.step_s
    span = np.ptp(data.value[: blocks * block].reshape(blocks, block), axis=1)
    moved = np.abs(np.diff(_drive_at(drive, edges)))
    gone = span < THRESHOLDS.vanished_span * float(np.median(span))
    gone &= moved > THRESHOLDS.vanished_move * float(np.median(moved))
    late = THRESHOLDS.vanished_lag / drive.rate if drive.repeats else 0.0
    near = 2 * int(np.ceil(late / (block * data.step_s))) + 1
    fast = ndimage.minimum_filter1d(moved, near) > THRESHOLDS.vanished_move * np.median(moved)
    stretches = np.flatnonzero(np.diff(np.r_[0, gone.astype(int), 0])).reshape(-1, 2)
    sure = [s for s in stretches if (gone & fast)[slice(*s)].sum() >= THRESHOLDS.vanished_blocks]
    return [(float(edges[first]), float(edges[after])) for first, after in sure]


def _drive_at(drive: Drive, time: np.ndarray) -> np.ndarray:
    if drive.repeats:
        return np.interp(time, drive.time, drive.value, period=1.0 / drive.rate)
    return np.interp(time, drive.time, drive.value)
