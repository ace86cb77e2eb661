"""`read_fringes`: from raw photodiode records to optical frequency against time."""

import dataclasses
from typing import Any

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.display._results import readout_dataset, summarise_readout
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._run import Run

from ._sample import resample_drive, sample_reading
from .turns._drive_turns import drive_turns


@dataclasses.dataclass(frozen=True, eq=False)
class Turn:
    """A turn of the laser: where the fringe rate passes zero.

    - `time_s`, `stderr_s`: when, s after the drive's start. `drive_s`: the drive's turn it answers.
    - `rising_after`: whether the frequency rises after it.
    - `rounding_s`: time constant of its corner, 0 where that is too short to tell.
    - `checked`: whether cavity peaks on both sides confirm its fringe count.

    >>> from rapi_jax.readout import Turn
    >>> turn = Turn(time_s=0.0251, stderr_s=1e-6, drive_s=0.0250, rising_after=False)
    >>> round(turn.lag_s, 7)  # s
    0.0001
    """

    time_s: float
    stderr_s: float
    drive_s: float
    rising_after: bool
    rounding_s: float = 0.0
    checked: bool = False

    @property
    def lag_s(self) -> float:
        """How much later the laser turns than the drive, s."""
        return self.time_s - self.drive_s


@dataclasses.dataclass(frozen=True, eq=False)
class Peaks:
    """Cavity peaks on the comb: time (s), order, and distance from the comb with error (GHz).

    >>> import numpy as np
    >>> from rapi_jax.readout import Peaks
    >>> at = np.array([0.001, 0.002])
    >>> peaks = Peaks(at, order=np.array([0, 1]), residual_ghz=0.0 * at, stderr_ghz=0.0 * at + 1e-3)
    >>> peaks.size
    2
    """

    time_s: np.ndarray
    order: np.ndarray
    residual_ghz: np.ndarray
    stderr_ghz: np.ndarray

    @property
    def size(self) -> int:
        """Number of peaks."""
        return self.time_s.size


@dataclasses.dataclass(frozen=True, eq=False)
class Readout:
    """Optical frequency of one run, read from its fringes.

    - `time`: s after the drive's start. `frequency`: GHz, from an origin of its own (fringes give
      relative frequency only), rising with the drive. `stderr`: of each value, GHz.
    - `turns`: the laser's turns. `peaks`: the cavity's peaks.
    - `delay_s`, `delay_stderr_s`: delay of the auxiliary interferometer, calibrated by the cavity;
      as given, with an infinite error, where there is none.
    - `fringe_noise`: rms of what the phase does not explain, in fringe amplitudes.
    - `faults`: what is wrong or doubtful with the record, one line each.

    >>> import numpy as np
    >>> from rapi_jax.readout import Peaks, Readout, Turn
    >>> time, none = np.linspace(0.0, 0.02, 5), np.zeros(0)
    >>> found = Readout(
    ...     time, 1500.0 * time, np.full(5, 1e-3), (Turn(0.025, 1e-6, 0.0249, False),),
    ...     Peaks(none, none, none, none), 2.45e-8, 1e-12, 0.01, (),
    ... )
    >>> found.frequency.tolist(), found.faults  # GHz
    ([0.0, 7.5, 15.0, 22.5, 30.0], ())
    """

    time: np.ndarray
    frequency: np.ndarray
    stderr: np.ndarray
    turns: tuple[Turn, ...]
    peaks: Peaks
    delay_s: float
    delay_stderr_s: float
    fringe_noise: float
    faults: tuple[str, ...]

    def summary(self) -> str:
        """The reading as text for people."""
        return summarise_readout(self).text()

    def _repr_html_(self) -> str:
        return summarise_readout(self).html()

    def to_dataset(self) -> Any:
        """An xarray `Dataset` of frequency and standard error (GHz) over time (s)."""
        return readout_dataset(self)

    def run(self, drive: Drive, samples: int | None = None, name: str = "run00") -> Run:
        """The run of `drive` with the frequency at its sample times, GHz.

        Each value comes from a straight line through the readings within half a sample, never
        across a turn. `samples`: put drive and response on so many samples instead. Where the
        record does not reach, a drive that repeats is read a period later or earlier; else the
        response is NaN.
        """
        if samples is not None:
            drive = resample_drive(drive, samples)
        cuts = np.array([turn.time_s for turn in self.turns])
        value = sample_reading(self.time, self.frequency, self.stderr, cuts, drive)
        return Run(drive, value, name)

    def latency(self, drive: Drive) -> tuple[float, float]:
        """How much later than `drive` the laser turns, mean over turns, and standard error (s).

        The error grows with the turns' scatter where that exceeds their own errors. Raises
        `DataError` where no turn was read.
        """
        found = []
        reach = 0.25 * (1.0 / drive.rate if drive.rate > 0 else float(drive.time[-1]))
        for turn in self.turns:
            near = drive_turns(drive, turn.drive_s - reach, turn.drive_s + reach)
            same = [t for t, up in near if up == turn.rising_after]
            if same:
                own = min(same, key=lambda t, at=turn.drive_s: abs(t - at))
                found.append((turn.time_s - own, turn.stderr_s))
        if not found:
            raise DataError(
                "No turn of the laser was read that belongs to a turn of this drive, so there is "
                "no latency. Record at least one turn with several fringes on both sides."
            )
        lag, stderr = np.array(found).T
        weight = 1.0 / np.maximum(stderr, 1e-12) ** 2
        mean = float(weight @ lag / weight.sum())
        chi2 = float(weight @ (lag - mean) ** 2)
        scatter = np.sqrt(max(1.0, chi2 / max(1, lag.size - 1)))
        return mean, float(scatter / np.sqrt(weight.sum()))
