"""What could be explained at all: a flexible model of the errors, which names nothing."""

import numpy as np

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.where._gap import measure_gap

_BINS = 64


def explainable_fraction(
    errors: list[np.ndarray], blocks: list[PeriodBlock], spectrum: Spectrum, *, own_origin: bool
) -> float | None:
    """Share of the gap that the errors of the other runs foretell in each run.

    At each phase of the scan the mean error of a run is foretold by a plane over rate and amplitude
    through those of the other runs. `None` with fewer than five runs that repeat.
    """
    runs = [k for k, b in enumerate(blocks) if b.repeats and b.periods > 1]
    if len(runs) < 5:
        return None
    whole = measure_gap(
        [errors[k] for k in runs], [blocks[k] for k in runs], spectrum, own_origin=own_origin
    )
    if not whole.significant or whole.structural2 <= 0:
        return None
    rate = np.array([1.0 / (blocks[k].step_s * blocks[k].left.shape[1]) for k in runs])
    swing = np.array([float(np.ptp(blocks[k].drive)) for k in runs])
    columns = [np.ones(len(runs))]
    columns += [(v - v.mean()) / np.std(v) for v in (rate, swing) if np.std(v) > 1e-9 * v.max()]
    design = np.stack(columns, axis=1)
    profiles = np.stack([_profile(errors[k], blocks[k]) for k in runs])
    left = []
    for i, k in enumerate(runs):
        others = np.arange(len(runs)) != i
        plane = np.linalg.lstsq(design[others], profiles[others], rcond=1e-6)[0]
        foretold = np.interp(
            blocks[k].phase, (np.arange(_BINS) + 0.5) / _BINS, design[i] @ plane, period=1.0
        )
        left.append(errors[k] - foretold[None, :])
    after = measure_gap(left, [blocks[k] for k in runs], spectrum, own_origin=own_origin)
    return float(np.clip(1.0 - after.structural2 / whole.structural2, 0.0, 1.0))


def _profile(error: np.ndarray, block: PeriodBlock) -> np.ndarray:
    """Mean error in bins of the scan's phase."""
    index = np.minimum((block.phase * _BINS).astype(int), _BINS - 1)
    mean = error.mean(axis=0)
    count = np.bincount(index, minlength=_BINS)
    total = np.bincount(index, weights=mean, minlength=_BINS)
    with np.errstate(invalid="ignore"):
        profile = total / count
    bad = count == 0
    if bad.any():
        profile[bad] = np.interp(np.flatnonzero(bad), np.flatnonzero(~bad), profile[~bad])
    return profile
