"""The explainable fraction: how much of the gap a flexible model of other runs' errors predicts."""

import numpy as np

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.where._gap import measure_gap

from ._thresholds import THRESHOLDS


def explainable_fraction(
    errors: list[np.ndarray], blocks: list[PeriodBlock], spectrum: Spectrum, *, own_origin: bool
) -> float | None:
    """Share of the gap that the errors of the other runs predict in each run.

    At each phase of the scan the mean error of a run is predicted by a plane over rate and
    amplitude through those of the other runs. `None` with fewer than five runs that repeat.
    """
    runs = [k for k, b in enumerate(blocks) if b.repeats and b.periods > 1]
    if len(runs) < THRESHOLDS.least_runs:
        return None
    whole = measure_gap(
        [errors[k] for k in runs], [blocks[k] for k in runs], spectrum, own_origin=own_origin
    )
    if not whole.significant or whole.structural2 <= 0:
        return None
    rate = np.array([1.0 / (blocks[k].step_s * blocks[k].left.shape[1]) for k in runs])
    swing = np.array([float(np.ptp(blocks[k].drive)) for k in runs])
    columns = [np.ones(len(runs))]
    columns += [
        (v - v.mean()) / np.std(v)
        for v in (rate, swing)
        if np.std(v) > THRESHOLDS.least_spread * v.max()
    ]
    design = np.stack(columns, axis=1)
    profiles = np.stack([_profile(errors[k], blocks[k]) for k in runs])
    left = []
    for i, k in enumerate(runs):
        others = np.arange(len(runs)) != i
        plane = np.linalg.lstsq(design[others], profiles[others], rcond=THRESHOLDS.plane_rcond)[0]
        predicted = np.interp(
            blocks[k].phase,
            (np.arange(THRESHOLDS.phase_bins) + 0.5) / THRESHOLDS.phase_bins,
            design[i] @ plane,
            period=1.0,
        )
        left.append(errors[k] - predicted[None, :])
    after = measure_gap(left, [blocks[k] for k in runs], spectrum, own_origin=own_origin)
    return float(np.clip(1.0 - after.structural2 / whole.structural2, 0.0, 1.0))


def _profile(error: np.ndarray, block: PeriodBlock) -> np.ndarray:
    """Mean error in bins of the scan's phase."""
    index = np.minimum((block.phase * THRESHOLDS.phase_bins).astype(int), THRESHOLDS.phase_bins - 1)
    mean = error.mean(axis=0)
    count = np.bincount(index, minlength=THRESHOLDS.phase_bins)
    total = np.bincount(index, weights=mean, minlength=THRESHOLDS.phase_bins)
    with np.errstate(invalid="ignore"):
        profile = total / count
    bad = count == 0
    if bad.any():
        profile[bad] = np.interp(np.flatnonzero(bad), np.flatnonzero(~bad), profile[~bad])
    return profile
