"""What one run of a recording holds: rate, swing, sampling, noise."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from fitting.identification.assessment._noise import after_first_period, measure_run_noise
from fitting.identification.data_checks.holds._sweeps import find_holds
from rapi_jax import Run
from rapi_jax.internal import usable


@dataclasses.dataclass(frozen=True)
class RunSummary:
    """One run in numbers; drive and response in the recording's units.

    - `excitation_hz`: the scan rate, Hz; `None` for a drive without one. `periods`: complete ones.
    - `samples`, `masked`: readings, and those of them that are not finite. `sample_hz`: sampling
      rate, Hz. `seconds`: length of the run, s. `start_s`: its start in the session, s.
    - `drive_low`, `drive_high`: smallest and largest drive; `swing`: peak to peak (Eq. 11); `bias`:
      the middle between them. `span`: largest less smallest reading.
    - `noise`: rms, of the response; `noise_from`: "periods" where it is what does not repeat,
      "samples" where nothing repeats and it is what changes from sample to sample. `settled`:
      whether the first period is like the later ones; one that is not is no part of the noise.
    - `holds`: how often the drive rests.
    """

    name: str
    waveform: str
    excitation_hz: float | None
    periods: int
    samples: int
    masked: int
    sample_hz: float
    seconds: float
    start_s: float
    drive_low: float
    drive_high: float
    swing: float
    bias: float
    span: float
    noise: float
    noise_from: str
    holds: int
    settled: bool = True

    @classmethod
    def of(cls, run: Run, response_lag_s: float, *, settled: bool = True) -> "RunSummary":
        """The numbers of `run`, which has a reading that is finite."""
        drive = run.drive
        low, high = float(drive.value.min()), float(drive.value.max())
        index = np.flatnonzero(usable(run, response_lag_s))
        index = index if index.size else np.flatnonzero(run.valid)
        if not settled:
            index = index[after_first_period(run, index)]
        # A drive that does not repeat is no noise of the reading, and noise of the drive is none.
        (noise, repeated), (less, _) = (
            measure_run_noise(run, index, one)
            for one in (run.response[index], _less_drive(run, index))
        )
        noise = min(noise, less)
        return cls(
            name=run.name,
            waveform=drive.waveform,
            excitation_hz=drive.excitation_hz,
            periods=drive.periods,
            samples=drive.size,
            masked=int((~run.valid).sum()),
            sample_hz=1.0 / drive.step_s,
            seconds=float(drive.time[-1]) + drive.step_s,
            start_s=drive.start_s,
            drive_low=low,
            drive_high=high,
            swing=drive.u_pp,
            bias=(low + high) / 2.0,
            span=run.span,
            noise=noise,
            noise_from="periods" if repeated else "samples",
            holds=len(find_holds(drive)),
            settled=settled,
        )

    @property
    def samples_a_period(self) -> float:
        """Samples in one period; infinite for a drive without a rate."""
        return np.inf if self.excitation_hz is None else self.sample_hz / self.excitation_hz

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and text, for a file."""
        return dataclasses.asdict(self)


def _less_drive(run: Run, index: Int[np.ndarray, " used"]) -> Float[np.ndarray, " used"]:
    """The reading less its cubic in the drive; about its mean period that is noise, too."""
    y, u = run.response[index], run.drive.value[index]
    if run.drive.u_pp == 0 or index.size < 8:
        return y - y.mean()
    scaled = (u - u.mean()) / run.drive.u_pp
    columns = np.stack([scaled**power for power in range(4)], axis=1)
    return y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
