"""Whether what a model leaves can be noise, where no repeated period has measured the noise.

White noise changes from sample to sample as much as it is large, and knows nothing of the drive.
Slow noise looks like an effect that is missing: one recording without repeats cannot tell them
apart, and must not be said to.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax.internal import white_noise_rms

from ._periods import PeriodBlock
from ._thresholds import THRESHOLDS

_TINY = 1e-300


@dataclasses.dataclass(frozen=True)
class ResidualWhiteness:
    """What is left, over all runs.

    - `rms`: in the response's unit. `span`: of the readings, likewise.
    - `slow`: share of the mean square that does not change from sample to sample; `slow_error`: one
      standard error of it, were all of it white.
    - `of_drive`: share that bins of the drive and its direction explain, beyond chance.
    - `of_signal`: mean square over the variance of the readings.
    """

    rms: float
    span: float
    slow: float
    slow_error: float
    of_drive: float
    of_signal: float

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why it cannot be taken for noise; empty where it can."""
        limits, out = THRESHOLDS, []
        if self.rms < limits.resolution * self.span:
            return ()
        if self.of_signal > limits.noise_signal:
            out.append(f"it is {100 * self.of_signal:.0f} % of the readings' variance")
        if self.slow > max(limits.noise_slow, limits.noise_sigmas * self.slow_error):
            out.append(f"{100 * self.slow:.0f} % of it does not change from sample to sample")
        if self.of_drive > limits.noise_drive:
            out.append(f"{100 * self.of_drive:.0f} % of it follows the drive and its direction")
        return tuple(out)


def measure_whiteness(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock]
) -> ResidualWhiteness:
    """The whiteness of `errors`, model less data, "periods phases" a run, less each run's mean."""
    count, square, white, follows, signal, span = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for error, block in zip(errors, blocks, strict=True):
        use = block.use.ravel() > 0
        if not use.any():
            continue
        e, y = error.ravel()[use], block.data.ravel()[use]
        e = e - e.mean()
        count += e.size
        square += float(e @ e)
        white += e.size * _white_variance(e)
        follows += _explained_by_drive(e, block.drive.ravel()[use])
        signal += e.size * float(np.var(y))
        span = max(span, float(np.ptp(y)))
    return ResidualWhiteness(
        rms=float(np.sqrt(square / max(count, 1.0))),
        span=span,
        slow=1.0 - white / max(square, _TINY),
        slow_error=THRESHOLDS.white_error / float(np.sqrt(max(count, 1.0))),
        of_drive=follows / max(square, _TINY),
        of_signal=square / max(signal, _TINY),
    )


def _white_variance(error: Float[np.ndarray, " samples"]) -> float:
    return white_noise_rms(error) ** 2 if error.size >= 4 else float(np.mean(error**2))


def _explained_by_drive(
    error: Float[np.ndarray, " samples"], drive: Float[np.ndarray, " samples"]
) -> float:
    """Sum of squares of the means in bins of the drive, rising and falling, beyond chance.

    Zero where each bin is passed only once: what is slow then follows any drive.
    """
    swing = float(np.ptp(drive))
    if swing == 0 or error.size < 4:
        return 0.0
    bins = THRESHOLDS.drive_bins
    place = np.minimum(((drive - drive.min()) / swing * bins).astype(int), bins - 1)
    place = place + bins * (np.gradient(drive) < 0)
    passes = 1 + np.count_nonzero(np.diff(place)) / (2 * bins)
    if passes < THRESHOLDS.drive_passes:
        return 0.0
    size = np.bincount(place, minlength=2 * bins)
    mean = np.bincount(place, error, minlength=2 * bins) / np.maximum(size, 1)
    found, groups = float(size @ mean**2), int(np.count_nonzero(size))
    left = float(error @ error) - found
    return max(found - groups * left / max(error.size - groups, 1), 0.0)
