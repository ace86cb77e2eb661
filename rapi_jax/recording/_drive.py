"""A drive: what is sent to a device in one run, its periods and its branches."""

import dataclasses
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.display._one_line import describe_drive
from rapi_jax.sampling import _phase
from rapi_jax.sampling._clock import check_clock

from ._column import checked_column

Waveform = Literal["triangle", "sine", "multisine", "step", "other"]
WAVEFORMS: tuple[str, ...] = get_args(Waveform)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Drive:
    """What is sent to the device in one run.

    - `time`: s, evenly spaced, from 0. `value`: V (or the recording's drive unit), same length.
    - `excitation_hz`: rate of a periodic drive, Hz; `None` for one that is not periodic.
    - `waveform`: "triangle", "sine", "multisine", "step" or "other". A drive with a rate and
      waveform "other" has that rate in Eq. 11 but need not repeat.
    - `start_s`: start of the run in the session's own time, s.

    Raises `DataError` where a column is not finite, or the clock is unsorted, doubled, jittered,
    has gaps or changes its rate.

    >>> import numpy as np
    >>> from rapi_jax import Drive
    >>> time = np.arange(400) / 4000  # s
    >>> drive = Drive(time, 3.0 - 2.0 * np.cos(2 * np.pi * 20.0 * time), 20.0, "sine")
    >>> drive.periods, round(drive.u_pp, 3)  # V peak to peak
    (2, 4.0)
    """

    time: np.ndarray
    value: np.ndarray
    excitation_hz: float | None = None
    waveform: Waveform = "other"
    start_s: float = 0.0

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "time", checked_column("time_s", self.time))
        set_(self, "value", checked_column("drive", self.value))
        if self.time.size != self.value.size:
            raise DataError(
                f"`time_s` has {self.time.size} samples, but `drive` has {self.value.size}."
            )
        check_clock(self.time)
        if self.waveform not in WAVEFORMS:
            raise DataError(
                f"`waveform` must be one of {', '.join(WAVEFORMS)}, not {self.waveform!r}."
            )
        hz = self.excitation_hz
        if hz is not None and not (np.isfinite(hz) and hz > 0):
            raise DataError(f"`excitation_hz` must be a positive number, but is {hz}.")
        if not np.isfinite(self.start_s):
            raise DataError(f"`start_s` must be a number of seconds, but is {self.start_s}.")
        set_(self, "excitation_hz", None if hz is None else float(hz))
        set_(self, "start_s", float(self.start_s))

    def __repr__(self) -> str:
        return describe_drive(self)

    @property
    def size(self) -> int:
        """Number of samples."""
        return self.time.size

    @property
    def step_s(self) -> float:
        """Sampling interval, s."""
        return float(self.time[-1] - self.time[0]) / (self.size - 1)

    @cached_property
    def u_pp(self) -> float:
        """Largest less smallest drive of the run, in the drive's unit (Eq. 11)."""
        return float(np.ptp(self.value))

    @property
    def rate(self) -> float:
        """Scan rate in Eq. 11, Hz; 0 where the drive has none."""
        return 0.0 if self.excitation_hz is None else float(self.excitation_hz)

    @property
    def repeats(self) -> bool:
        """Whether the drive is periodic with `excitation_hz`."""
        return self.excitation_hz is not None and self.waveform != "other"

    @property
    def samples_a_period(self) -> float:
        """Samples a period, whole or not; 0 for a drive that does not repeat."""
        return 1.0 / (self.rate * self.step_s) if self.repeats else 0.0

    @cached_property
    def whole_period(self) -> int:
        """Samples a period, where they are whole and the drive repeats exactly; else 0."""
        if not self.repeats or self.u_pp == 0:
            return 0
        return _phase.whole_period(self.value, 1.0 / (self.rate * self.step_s), self.u_pp)

    @property
    def session_time(self) -> np.ndarray:
        """Time of each sample in the session, s."""
        return self.time + self.start_s

    @cached_property
    def _turning(self) -> tuple[float, float]:
        return _phase.turning_phases(self.time * self.rate, self.value)

    @cached_property
    def phase(self) -> np.ndarray:
        """Phase of each sample since the drive's minimum, 0 to 1; if free, along its branch."""
        if self.repeats:
            return np.mod(self.time * self.rate - self._turning[0], 1.0)
        up, along = self._segments
        return np.where(up, along / 2, 0.5 + along / 2)

    @cached_property
    def period(self) -> np.ndarray:
        """Period of each sample, from the first minimum on; -1 in a broken one, or without any."""
        if not self.repeats:
            return np.full(self.size, -1)
        return _phase.complete_periods(self.time * self.rate, self._turning[0])

    @property
    def periods(self) -> int:
        """Number of complete periods; 0 for a drive that does not repeat."""
        return int(self.period.max()) + 1

    @cached_property
    def _segments(self) -> tuple[np.ndarray, np.ndarray]:
        return _phase.segment_fraction(_phase.turning_samples(self.value), self.value)

    @cached_property
    def up(self) -> np.ndarray:
        """Whether each sample is on a rising branch of the drive."""
        if self.repeats:
            return _phase.branch_fraction(self.time * self.rate, *self._turning)[0]
        return self._segments[0]

    def lead_in(self) -> np.ndarray:
        """Drive values from the minimum to where the record begins: one settling period at most.

        With these before it, a model started by Eq. 13 is in its periodic state at the first
        sample: at the minimum Eq. 13 is that state. Empty for a drive that does not repeat.
        """
        length = round(1.0 / (self.rate * self.step_s)) if self.repeats else 0
        if not 0 < length < self.size:
            length = self.size if self.repeats else 0
        one = self.value[:length]
        at = int(np.argmin(one)) if length else 0
        return one[at:] if at > 0 else one[:0]

    def delayed(self, lag_s: float) -> "Drive":
        """The drive `lag_s` earlier at each sample: what a reading with that latency answers."""
        if lag_s == 0.0:
            return self
        if not 0.0 < lag_s < self.time[-1] / 2:
            raise DataError(
                f"`response_lag_s` = {lag_s:g} s must be positive and short beside a run of "
                f"{self.time[-1]:g} s."
            )
        time, value = self.time, self.value
        if self.repeats and self.periods:
            period = 1.0 / self.rate
            one = time < period  # wrapped round: the end of a period joins its start
            early = np.interp(time[time < lag_s] - lag_s, time[one], value[one], period=period)
            shifted = np.interp(time - lag_s, time, value)
            shifted[time < lag_s] = early
        else:
            shifted = np.interp(time - lag_s, time, value)
        return dataclasses.replace(self, value=shifted)
