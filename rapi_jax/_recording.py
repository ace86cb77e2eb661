"""Drives, runs and recordings: what was sent to a device and what it answered."""

import dataclasses
import hashlib
import math
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from ._errors import DataError
from .display._recording import recording_dataframe, recording_dataset, summarise_recording
from .sampling import _phase
from .sampling._clock import check_clock

Waveform = Literal["triangle", "sine", "multisine", "step", "other"]
Origin = Literal["session", "run"]
WAVEFORMS: tuple[str, ...] = get_args(Waveform)
ROI = (0.1, 0.9)  # the middle 80 % of each branch's time
_ROUNDING = 1e-9  # of a branch: a sample that stands on an end of the region is inside
ABSOLUTE_ZERO_C = -273.15


def _column(name: str, value: Any, *, finite: bool = True) -> np.ndarray:
    array = np.array(value, dtype=np.float64)
    if array.ndim != 1:
        raise DataError(f"`{name}` must be one column of numbers, but has shape {array.shape}.")
    bad = np.flatnonzero(~np.isfinite(array))
    if finite and bad.size:
        raise DataError(
            f"`{name}` has {bad.size} value(s) that are not finite, the first ({array[bad[0]]}) at "
            f"sample {bad[0]}. A drive or a clock is never guessed: export the record again."
        )
    array.flags.writeable = False
    return array


def parse_recorded_at(text: str | None) -> datetime | None:
    """`recorded_at` in UTC. Raises `DataError` unless it is a date and time that names its offset.

    Without an offset from UTC it would be another instant in another laboratory, and twice the same
    in the night when clocks are set back.
    """
    if text is None:
        return None
    try:
        time = datetime.fromisoformat(str(text).strip())
        if time.tzinfo is not None:
            return time.astimezone(UTC)
    except (ValueError, OverflowError):
        pass
    raise DataError(
        "`recorded_at` must be a date and time with its offset from UTC, such as "
        f"2026-11-24T10:00:00Z or 2026-11-24T11:00:00+01:00, but is {ascii(text)[:60]}."
    )


def parse_temperature(text: str | float | None) -> float | None:
    """`temperature_c` as a number. Raises `DataError` unless it is one above absolute zero."""
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isfinite(value) and value > ABSOLUTE_ZERO_C:
        return value
    raise DataError(
        "`temperature_c` must be a number of degrees Celsius, such as 21.3, but is "
        f"{ascii(text)[:60]}."
    )


@dataclasses.dataclass(frozen=True, eq=False)
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
        set_(self, "time", _column("time_s", self.time))
        set_(self, "value", _column("drive", self.value))
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


@dataclasses.dataclass(frozen=True, eq=False)
class Run:
    """One run: a drive and the response to it.

    `response` is in the recording's response unit, NaN where the reading is masked. `name` is a
    short file stem, used in outputs.

    >>> from rapi_jax import Run, triangle
    >>> (drive,) = triangle(10.0, amplitude=4.5, bias=3.0, samples=100)
    >>> run = Run(drive, 18.0 * drive.value, name="up and down")
    >>> run.name, round(run.span, 6)  # GHz
    ('up and down', 81.0)
    """

    drive: Drive
    response: np.ndarray
    name: str = "run00"

    def __post_init__(self) -> None:
        object.__setattr__(self, "response", _column("response", self.response, finite=False))
        if self.response.size != self.drive.size:
            raise DataError(
                f"run {self.name!r}: `response` has {self.response.size} samples, but the drive "
                f"has {self.drive.size}."
            )

    @property
    def valid(self) -> np.ndarray:
        """Whether each reading is a number."""
        return np.isfinite(self.response)

    @property
    def span(self) -> float:
        """Largest less smallest reading."""
        return float(np.nanmax(self.response) - np.nanmin(self.response))

    @cached_property
    def along(self) -> np.ndarray:
        """Place of each sample between the response's turning points, 0 to 1 on each branch."""
        if self.drive.repeats:
            if not self.valid.any():
                raise DataError(f"run {self.name!r}: `response` has no reading that is a number.")
            cycles = self.drive.time * self.drive.rate
            low, high = _phase.turning_phases(cycles, self.response)
            return _phase.branch_fraction(cycles, low, high)[1]
        return self.drive._segments[1]

    @property
    def roi(self) -> np.ndarray:
        """Region of interest: the middle 80 % of the time between the response's turning points."""
        along = self.along
        return (along >= ROI[0] - _ROUNDING) & (along <= ROI[1] + _ROUNDING)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """Runs of one session on one device; they may differ in length, rate and sampling.

    - `response_unit`, `drive_unit`: "GHz" for optical frequency ("um", "nm", "V", "uC" for others),
      and "V" or "um"; conversion happens where files are read.
    - `response_origin`: whether the runs share one zero of the response ("session") or have one
      each ("run").
    - `response_lag_s`: known latency of the reading, s; taken out before fitting.
    - `provenance`: what else is known of it, as text. Three keys have a meaning and are checked:
      `recorded_at`, when it was recorded; `temperature_c`, the device's temperature; and
      `units_checked`, "true" where numbers that look like a slip of units are right.

    Raises `DataError` where a field is not what it should be.

    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> recording = Recording.of(drives, [predict(paper_device(), drive) for drive in drives])
    >>> recording.rates, recording.response_unit, round(recording.runs[1].span, 1)
    ([10.0, 20.0], 'GHz', 75.5)
    """

    runs: tuple[Run, ...]
    response_unit: str = "GHz"
    drive_unit: str = "V"
    response_origin: Origin = "session"
    response_lag_s: float = 0.0
    provenance: dict[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "runs", tuple(self.runs))
        lag = float(self.response_lag_s)
        if not (np.isfinite(lag) and lag >= 0):
            raise DataError(f"`response_lag_s` must be zero or a positive time in s, but is {lag}.")
        object.__setattr__(self, "response_lag_s", lag)
        if not self.runs:
            raise DataError("A recording needs at least one run, but has none.")
        names = [run.name for run in self.runs]
        if len(set(names)) < len(names):
            twice = next(name for i, name in enumerate(names) if name in names[:i])
            raise DataError(
                f"Two runs of the recording have the same name: {ascii(twice)[:60]}. Rename one."
            )
        if self.response_origin not in get_args(Origin):
            raise DataError(
                f'`response_origin` must be "session" or "run", not {self.response_origin!r}.'
            )
        parse_recorded_at(self.provenance.get("recorded_at"))
        parse_temperature(self.provenance.get("temperature_c"))

    @property
    def recorded_at(self) -> datetime | None:
        """When it was recorded, in UTC; `None` where the provenance has no `recorded_at`."""
        return parse_recorded_at(self.provenance.get("recorded_at"))

    @property
    def temperature_c(self) -> float | None:
        """The device's temperature, deg C; `None` where the provenance has no `temperature_c`."""
        return parse_temperature(self.provenance.get("temperature_c"))

    @property
    def drives(self) -> tuple[Drive, ...]:
        """The drive of each run."""
        return tuple(run.drive for run in self.runs)

    @property
    def rates(self) -> list[float]:
        """The distinct scan rates, Hz, ascending."""
        return sorted({run.drive.rate for run in self.runs})

    @property
    def amplitudes(self) -> list[float]:
        """The distinct peak-to-peak drives, ascending; equal within 2 %."""
        distinct: list[float] = []
        for pp in sorted(run.drive.u_pp for run in self.runs):
            if not distinct or pp > 1.02 * distinct[-1]:
                distinct.append(pp)
        return distinct

    def summary(self) -> str:
        """What the recording holds, as text for people: a row for each run."""
        return summarise_recording(self).text()

    def _repr_html_(self) -> str:
        return summarise_recording(self).html()

    def __repr__(self) -> str:
        return f"<Recording: {len(self.runs)} runs, {self.response_unit} over {self.drive_unit}>"

    def to_dataframe(self) -> Any:
        """A pandas `DataFrame` with a row for each sample; `run` names its run."""
        return recording_dataframe(self)

    def to_dataset(self) -> Any:
        """An xarray `Dataset` over `run` and `sample`; NaN where a run is shorter than others."""
        return recording_dataset(self)

    def sha256(self) -> str:
        """A hash of all numbers and of all that changes their meaning."""
        digest = hashlib.sha256()
        heads = (self.response_unit, self.drive_unit, self.response_origin, self.response_lag_s)
        digest.update(repr(heads).encode())
        for run in self.runs:
            d = run.drive
            digest.update(repr((run.name, d.excitation_hz, d.waveform, d.start_s)).encode())
            for column in (d.time, d.value, run.response):
                digest.update(np.ascontiguousarray(column).tobytes())
        return digest.hexdigest()

    @classmethod
    def of(cls, drives: Sequence[Drive], responses: Sequence[Any], **fields: Any) -> "Recording":
        """A recording from drives and responses in the same order; runs are named `run00` on."""
        pairs = zip(drives, responses, strict=True)
        runs = tuple(Run(d, np.asarray(y), f"run{i:02d}") for i, (d, y) in enumerate(pairs))
        return cls(runs, **fields)
