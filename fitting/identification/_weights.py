"""The weight of each run: its hysteresis percentage (Eq. 26)."""

from collections.abc import Sequence

import numpy as np

from rapi_jax import Recording, Run
from rapi_jax.internal import takes, usable

from ._thresholds import THRESHOLDS


def hysteresis_fraction(run: Run, lag_s: float = 0.0) -> float:
    """Largest vertical width of a run's loop over its span; NaN where a branch is missing.

    Branches are means over drive bins, so noise and several periods average out.
    """
    drive = run.drive.delayed(lag_s)
    use = usable(run, lag_s)
    if drive.u_pp == 0 or use.sum() < 4:
        return float("nan")
    bins = THRESHOLDS.weight_bins
    place = (drive.value - drive.value.min()) / drive.u_pp
    # Rounding must not decide where a drive on an edge goes: an offset of the drive changes it.
    index = np.minimum((place * bins + THRESHOLDS.weight_bin_edge).astype(int), bins - 1)
    means = []
    for branch in (drive.up, ~drive.up):
        part = use & branch
        count = np.bincount(index[part], minlength=bins)
        total = np.bincount(index[part], weights=run.response[part], minlength=bins)
        means.append(np.where(count > 0, total / np.maximum(count, 1), np.nan))
    gap = np.abs(means[0] - means[1])[2:-2]  # a bin at a turning point mixes both branches
    span = float(np.ptp(run.response[use]))
    return float(np.nanmax(gap) / span) if np.isfinite(gap).any() and span > 0 else float("nan")


@takes(recording=Recording)
def hysteresis_weights(recording: Recording) -> np.ndarray:
    """`A_j` of Eq. 26, one per run: proportional to the hysteresis percentage, with mean 1.

    >>> from fitting import hysteresis_weights
    >>> from rapi_jax.examples import paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> hysteresis_weights(recording).round(2).tolist()  # more hysteresis, more weight
    [0.96, 0.99, 1.02, 1.03]
    """
    fractions = np.array(
        [hysteresis_fraction(run, recording.response_lag_s) for run in recording.runs]
    )
    if not (fractions > 0).any():
        return np.ones(fractions.size)
    fractions = np.where(np.isfinite(fractions), fractions, np.nanmean(fractions))
    fractions = np.maximum(fractions, THRESHOLDS.smallest_weight * fractions.max())
    return fractions / fractions.mean()


def run_weights(recording: Recording, weights: str | Sequence[float]) -> np.ndarray:
    """The weights asked for: "hysteresis", "uniform", or a positive number per run."""
    if isinstance(weights, str):
        if weights == "hysteresis":
            return hysteresis_weights(recording)
        if weights == "uniform":
            return np.ones(len(recording.runs))
        raise ValueError(
            f'Argument `weights` must be "hysteresis", "uniform" or numbers, not {weights!r}.'
        )
    given = np.asarray(weights, dtype=float)
    if given.shape != (len(recording.runs),) or not (np.isfinite(given) & (given > 0)).all():
        raise ValueError(
            f"Argument `weights` must be {len(recording.runs)} positive numbers, one per run, but "
            f"is {weights}."
        )
    return given / given.mean()
