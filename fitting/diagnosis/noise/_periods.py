"""Whole periods of each run as an array, and the same of a model: what the diagnosis looks at.

A run that repeats becomes `periods` rows of equal phases, from the drive's minimum on. Where
periods are not whole numbers of samples, model and data alike are read between samples. A run that
does not repeat is one row, with nothing to tell noise from error by.
"""

import dataclasses

import numpy as np

from rapi_jax import Recording, Run
from rapi_jax.sampling._batch import Batch

_MOST, _LEAST = 1024, 512  # samples a period; of a run that does not repeat, all its samples


@dataclasses.dataclass(frozen=True, eq=False)
class PeriodBlock:
    """One run: where its values stand in the padded rows of `Sampled`.

    - `left`, `share`: "periods phases"; value = (1 - share) row[left] + share row[right].
    - `phase`: of each column, 0 to 1 since the drive's minimum; `time`: s in the session.
    - `data`: the readings; `use`: 0 where one is masked. `step_s`: between columns.
    """

    left: np.ndarray
    right: np.ndarray
    share: np.ndarray
    phase: np.ndarray
    time: np.ndarray
    data: np.ndarray
    use: np.ndarray
    drive: np.ndarray
    step_s: float
    repeats: bool

    @property
    def periods(self) -> int:
        """Number of whole periods; 1 for a run that does not repeat."""
        return self.left.shape[0]

    @property
    def size(self) -> int:
        """Number of values."""
        return self.left.size

    def of(self, row: np.ndarray) -> np.ndarray:
        """A row of `Sampled` (or several, last axis time) read at this run's periods and phases."""
        return (1.0 - self.share) * row[..., self.left] + self.share * row[..., self.right]


def decimate(recording: Recording) -> Recording:
    """Every so many samples of runs that are sampled far finer than a diagnosis can use.

    Periods stay whole numbers of samples where they were. Turning points between samples are found
    again from the straight branches beside them.
    """
    return dataclasses.replace(recording, runs=tuple(_thinned(run) for run in recording.runs))


def _thinned(run: Run) -> Run:
    drive = run.drive
    if drive.repeats and drive.periods:
        exact = 1.0 / (drive.rate * drive.step_s)
        whole = abs(exact - round(exact)) * drive.periods < 0.02
        most = int(exact // _LEAST)
        steps = [k for k in range(2, most + 1) if not whole or round(exact) % k == 0]
        every = max(steps, default=1) if exact > _MOST else 1
    else:
        every = -(-drive.size // (2 * _LEAST))
    if every == 1:
        return run
    thin = dataclasses.replace(drive, time=drive.time[::every], value=drive.value[::every])
    return dataclasses.replace(run, drive=thin, response=run.response[::every])


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
        if abs(exact - count) * periods <= 0.02:
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
    share = np.where(place - low < 1e-6, 0.0, place - low)
    high = np.minimum(low + 1, drive.size - 1)
    left, right = row_of[low], row_of[high]
    valid = recording.runs[k].valid
    use = (valid[low] & (valid[high] | (share == 0))).astype(float)
    raw = data.y[k]
    value = (1.0 - share) * raw[left] + share * raw[right]
    u = (1.0 - share) * data.u[k][left] + share * data.u[k][right]
    return PeriodBlock(
        left,
        right,
        share,
        phase,
        drive.start_s + place * drive.step_s,
        value,
        use,
        u,
        drive.step_s * exact / count,
        bool(drive.repeats and drive.periods >= 1),
    )


def slice_block(block: PeriodBlock, begin: float, end: float) -> PeriodBlock:
    """The periods of a block from one share of them to another; of one period, the phases."""
    first, last = round(begin * block.periods), round(end * block.periods)
    if block.periods > 1:
        rows, columns = slice(first, last), slice(None)
    else:
        size = block.left.shape[1]
        rows, columns = slice(None), slice(round(begin * size), round(end * size))
    return dataclasses.replace(
        block,
        **{
            name: getattr(block, name)[rows, columns]
            for name in ("left", "right", "share", "time", "data", "use", "drive")
        },
        phase=block.phase[columns],
    )
