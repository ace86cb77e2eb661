"""Whole periods of each run as an array, of readings and of a model alike.

A run that repeats becomes `periods` rows of equal phases, from the drive's minimum on. Where
periods are not whole numbers of samples, model and data alike are interpolated between samples. A
run that does not repeat is one row, with nothing to distinguish noise from error by.
"""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from rapi_jax import Recording, Run
from rapi_jax.internal import Batch, are_whole_samples

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class PeriodBlock:
    """One run as whole periods, with the place of its values in the padded rows of `Batch`.

    - `left`, `right`, `fraction`: a value is (1 - fraction) row[left] + fraction row[right].
    - `phase`: 0 to 1 since the drive's minimum. `time`: s in the session. `step_s`: between phases.
    - `data`: the readings. `use`: 0 where one is masked, else 1. `drive`: in the drive's unit.
    - `repeats`: whether the run is periodic.
    """

    left: Int[np.ndarray, "periods phases"]
    right: Int[np.ndarray, "periods phases"]
    fraction: Float[np.ndarray, "periods phases"]
    phase: Float[np.ndarray, " phases"]
    time: Float[np.ndarray, "periods phases"]
    data: Float[np.ndarray, "periods phases"]
    use: Float[np.ndarray, "periods phases"]
    drive: Float[np.ndarray, "periods phases"]
    step_s: float
    repeats: bool

    @property
    def periods(self) -> int:
        """Number of whole periods; 1 for a run that does not repeat."""
        return self.left.shape[0]

    @property
    def phases(self) -> int:
        """Number of values a period."""
        return self.left.shape[1]

    @property
    def size(self) -> int:
        """Number of values."""
        return self.left.size

    def interpolate(
        self, row: Float[np.ndarray, "*more time"]
    ) -> Float[np.ndarray, "*more periods phases"]:
        """A row of `Batch` read at this run's periods and phases."""
        if self._on_samples:
            return row[..., self.left]
        return (1.0 - self.fraction) * row[..., self.left] + self.fraction * row[..., self.right]

    @cached_property
    def _on_samples(self) -> bool:
        return not self.fraction.any()

    @cached_property
    def has_masked(self) -> bool:
        """Whether a reading is masked."""
        return not self.use.all()


def decimate(recording: Recording) -> Recording:
    """The recording with every n-th sample of runs that are sampled finer than a diagnosis can use.

    Periods stay whole numbers of samples where they were. Turning points between samples are found
    again from the straight branches beside them.
    """
    return dataclasses.replace(recording, runs=tuple(_decimate_run(r) for r in recording.runs))


def _decimate_run(run: Run) -> Run:
    drive = run.drive
    if drive.repeats and drive.periods:
        exact = 1.0 / (drive.rate * drive.step_s)
        whole = are_whole_samples(drive.periods, exact, drive.periods * round(exact))
        most = int(exact // THRESHOLDS.least_samples)
        steps = [k for k in range(2, most + 1) if not whole or round(exact) % k == 0]
        every = max(steps, default=1) if exact > THRESHOLDS.most_samples else 1
    else:
        every = -(-drive.size // (2 * THRESHOLDS.least_samples))
    if every == 1:
        return run
    fewer = dataclasses.replace(drive, time=drive.time[::every], value=drive.value[::every])
    return dataclasses.replace(run, drive=fewer, response=run.response[::every])


def period_blocks(recording: Recording, data: Batch) -> list[PeriodBlock]:
    """The blocks of all runs, in order."""
    return [_block(recording, data, k) for k in range(len(recording.runs))]


def _block(recording: Recording, data: Batch, k: int) -> PeriodBlock:
    drive = recording.runs[k].drive
    row_of = np.flatnonzero(data.sample[k] >= 0)  # row index of each sample of the run
    period = drive.period
    if drive.repeats and drive.periods >= 1:
        first = int(np.flatnonzero(period >= 0)[0])
        exact = 1.0 / (drive.rate * drive.step_s)
        count = round(exact)
        available = drive.size - first
        periods = int((available - 1 + 1e-6 + (exact == count)) // exact)
        periods = max(1, min(drive.periods, periods))
        if are_whole_samples(periods, exact, periods * count):
            exact = float(count)
        place = first + exact * (np.arange(periods)[:, None] + np.arange(count)[None, :] / count)
        phase = np.arange(count) / count
    else:
        place = np.flatnonzero(np.isin(row_of, np.flatnonzero(data.use[k])))
        place = np.arange(place[0], place[-1] + 1, dtype=float)[None, :]
        exact = count = place.size
        phase = drive.phase[place[0].astype(int)]
        periods = 1
    place = np.minimum(place, drive.size - 1)
    low = np.floor(place + 1e-9).astype(int)
    fraction = np.where(place - low < 1e-6, 0.0, place - low)
    high = np.minimum(low + 1, drive.size - 1)
    left, right = row_of[low], row_of[high]
    valid = recording.runs[k].valid
    use = (valid[low] & (valid[high] | (fraction == 0))).astype(float)
    raw = data.y[k]
    value = (1.0 - fraction) * raw[left] + fraction * raw[right]
    u = (1.0 - fraction) * data.u[k][left] + fraction * data.u[k][right]
    return PeriodBlock(
        left,
        right,
        fraction,
        phase,
        drive.start_s + place * drive.step_s,
        value,
        use,
        u,
        drive.step_s * exact / count,
        bool(drive.repeats and drive.periods >= 1),
    )


def slice_block(block: PeriodBlock, begin: float, end: float) -> PeriodBlock:
    """The periods of a block between two fractions of them; of a single period, the phases."""
    first, last = round(begin * block.periods), round(end * block.periods)
    if block.periods > 1:
        rows, columns = slice(first, last), slice(None)
    else:
        size = block.phases
        rows, columns = slice(None), slice(round(begin * size), round(end * size))
    return dataclasses.replace(
        block,
        **{
            name: getattr(block, name)[rows, columns]
            for name in ("left", "right", "fraction", "time", "data", "use", "drive")
        },
        phase=block.phase[columns],
    )
