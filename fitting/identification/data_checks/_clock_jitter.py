"""Noise that grows with the slope of the response: a clock that jitters under even time stamps."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax import Recording
from rapi_jax.internal import quantity, usable

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class SlopeNoise:
    """The fast part of a residual as constant noise and a timing error times the slope.

    `jitter_s`: the timing error, rms, s. `share`: of the fast part's mean square; `sigmas`: by how
    many standard errors it stands above none.
    """

    jitter_s: float
    share: float
    sigmas: float

    @property
    def clear(self) -> bool:
        """Whether most of the noise is a timing error, beyond chance."""
        limits = THRESHOLDS
        return self.share > limits.jitter_share and self.sigmas > limits.jitter_sigmas


def measure_slope_noise(
    error: Float[np.ndarray, " samples"], predicted: Float[np.ndarray, " samples"], step_s: float
) -> SlopeNoise | None:
    """Of one run, from third differences of its residual; `None` where there is too little.

    Corners of the response, where a model misses fast, are left out.
    """
    fast = np.diff(error, 3) ** 2 / 20.0
    move = np.diff(predicted)
    bend = np.abs(np.diff(move))
    near = np.maximum(bend[:-1], bend[1:])
    straight = near < THRESHOLDS.jitter_corner * float(np.median(np.abs(move)))
    square = ((move[:-2] + move[1:-1] + move[2:]) / 3.0 / step_s) ** 2
    x, y = square[straight], fast[straight]
    if x.size < THRESHOLDS.jitter_samples or not float(np.ptp(x)) > 0:
        return None
    level = float(x.mean())
    x = x - level
    slope = float(x @ y) / float(x @ x)
    left = y - y.mean() - slope * x
    # Third differences overlap: the squares of neighbours are correlated by (3/4)^2, (3/10)^2, ...
    error_of_slope = float(np.sqrt(2.3 * np.sum((x * left) ** 2))) / float(x @ x)
    share = slope * level / max(float(y.mean()), 1e-300)
    return SlopeNoise(float(np.sqrt(max(slope, 0.0))), share, slope / max(error_of_slope, 1e-300))


def describe_jitter(recording: Recording, errors: list[Float[np.ndarray, "_"]]) -> list[str]:
    """A sentence on the run with the largest timing error, with what to do; none where none is.

    `errors`: model less data of each run, at all of its samples.
    """
    found = []
    for run, error in zip(recording.runs, errors, strict=True):
        index = np.flatnonzero(usable(run, recording.response_lag_s))
        if index.size < THRESHOLDS.jitter_samples or (np.diff(index) != 1).any():
            continue
        predicted = run.response[index] + error[index]
        noise = measure_slope_noise(error[index], predicted, run.drive.step_s)
        if noise is not None and noise.clear:
            found.append((noise.jitter_s / run.drive.step_s, noise, run))
    if not found:
        return []
    part, noise, run = max(found, key=lambda one: one[0])
    names = ", ".join(repr(one[2].name) for one in found)
    return [
        f"jitter: the noise of run{'s' * (len(found) > 1)} {names} grows with the slope of the "
        f"response, as if each sample were taken {quantity(noise.jitter_s, 's')} early or late "
        f"({100 * part:.2g} % of a step in run {run.name!r}): "
        "a clock that jitters under even time stamps, or noise of the drive. Record with the "
        "converter's own clock, and its time stamps as they were."
    ]
