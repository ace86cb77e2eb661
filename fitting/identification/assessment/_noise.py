"""The noise of each run: what of a residual does not repeat from period to period."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float, Int

from fitting.identification.data_checks.periods._odd_periods import find_late_starts
from fitting.identification.problem._problem import Problem
from rapi_jax import Run
from rapi_jax.internal import white_noise_rms


@dataclasses.dataclass(frozen=True, eq=False)
class Noise:
    """The rms of the noise in each run, in the response's unit, and whether periods showed it.

    Where a run does not repeat it is what changes from sample to sample: white noise alone.
    """

    rms: Float[np.ndarray, " runs"]
    repeated: Bool[np.ndarray, " runs"]
    use: Bool[np.ndarray, "runs time"]

    @property
    def total(self) -> float:
        """The rms over the samples of all runs."""
        return self.over(self.use)

    def over(self, samples: Bool[np.ndarray, "runs time"]) -> float:
        """The rms over some samples."""
        count = samples.sum(axis=1)
        return float(np.sqrt(np.average(self.rms**2, weights=count))) if count.any() else 0.0

    def gap(self, rms: float, samples: Bool[np.ndarray, "runs time"] | None = None) -> float:
        """What of the rms of an error over `samples` (by default all) is not noise."""
        noise = self.over(self.use if samples is None else samples)
        return float(np.sqrt(max(rms**2 - noise**2, 0.0)))


def measure_noise(problem: Problem, error: Float[np.ndarray, "runs time"]) -> Noise:
    """The noise under `error`, model less data at the samples of all runs.

    A first period that is unlike the later ones of its run is no part of it.
    """
    use, rms, repeated = problem.data.use, [], []
    late = find_late_starts(problem.recording.runs)
    for row, run in enumerate(problem.recording.runs):
        index = np.flatnonzero(use[row])
        if run.name in late:
            index = index[after_first_period(run, problem.data.sample[row, index])]
        one, seen = measure_run_noise(run, problem.data.sample[row, index], error[row, index])
        repeated.append(seen)
        rms.append(one)
    return Noise(np.array(rms), np.array(repeated), use)


def after_first_period(run: Run, sample: Int[np.ndarray, " used"]) -> Bool[np.ndarray, " used"]:
    """Which samples of a run lie after its first whole period."""
    return sample > np.flatnonzero(run.drive.period == 0)[-1]


def measure_run_noise(
    run: Run, sample: Int[np.ndarray, " used"], error: Float[np.ndarray, " used"]
) -> tuple[float, bool]:
    """The rms of the noise under `error` at samples of a run, and whether periods showed it."""
    found = None
    if run.drive.repeats and sample.size:
        cycles = run.drive.time[sample] * run.drive.rate
        found = _between_periods(error, cycles, run.drive.rate * run.drive.step_s)
    return (white_noise_rms(error), False) if found is None else (found, True)


def _between_periods(
    error: Float[np.ndarray, " samples"], cycles: Float[np.ndarray, " samples"], step: float
) -> float | None:
    """The rms about the mean period; `None` where no phase is seen twice."""
    phases = max(int(round(1.0 / step)), 1)
    place = np.floor((cycles % 1.0) * phases + 1e-6).astype(int) % phases
    period = np.floor(cycles + 1e-9).astype(int)
    period -= period.min()
    count = np.bincount(place, minlength=phases)

    def by_phase(values: np.ndarray) -> np.ndarray:
        return np.bincount(place, values, minlength=phases) / np.maximum(count, 1)

    # A drifting origin is no noise. Of a period that is broken, its mean alone is no origin.
    off = error - by_phase(error)[place]
    level = np.bincount(period, off) / np.maximum(np.bincount(period), 1)
    error = error - level[period]
    mean = by_phase(error)
    twice = count > 1
    left = float((count[twice] - 1).sum())
    if not left:
        return None
    square = (error - mean[place])[twice[place]] ** 2
    return float(np.sqrt(square.sum() / left))
