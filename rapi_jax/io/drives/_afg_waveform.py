"""A drive as an arbitrary function generator holds it: 14-bit codes over one period, two levels."""

import dataclasses

import numpy as np

from rapi_jax._arguments import takes
from rapi_jax._errors import DataError, LimitError
from rapi_jax._limits import DriveLimits
from rapi_jax._thresholds import THRESHOLDS
from rapi_jax.recording._drive import Drive

FULL = 16382  # the highest code of the AFG31000 series; 0 is the low level
POINTS = 131072  # its longest waveform in basic mode
_LEVEL = 1e-4  # V: levels are set in steps of 0.1 mV
_ROUNDING = 1e-12  # V: of a level in float64


@dataclasses.dataclass(frozen=True, eq=False)
class AfgWaveform:
    """One period of a drive as codes between two levels.

    - `codes`: 0 to 16382, uint16, played in equal times over one period, each held.
    - `low_v`, `high_v`: the levels of code 0 and of code 16382, V.
    - `frequency_hz`: periods a second.

    >>> from rapi_jax import AfgWaveform, DriveLimits, triangle
    >>> (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=100)
    >>> limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    >>> wave = AfgWaveform.of(drive, limits=limits)
    >>> wave.low_v, wave.high_v, wave.frequency_hz
    (1.0, 5.0, 10.0)
    """

    codes: np.ndarray
    low_v: float
    high_v: float
    frequency_hz: float

    def __post_init__(self) -> None:
        codes = np.array(self.codes)
        if codes.ndim != 1 or not 2 <= codes.size <= POINTS:
            raise DataError(
                f"A waveform has 2 to {POINTS} codes, but this has shape {codes.shape}."
            )
        if not np.issubdtype(codes.dtype, np.integer) or codes.min() < 0 or codes.max() > FULL:
            raise DataError(f"Codes are whole numbers from 0 to {FULL}, but these are not.")
        if not self.low_v < self.high_v:
            raise DataError(f"Level {self.low_v:g} V must lie below {self.high_v:g} V.")
        codes = codes.astype(np.uint16)
        codes.flags.writeable = False
        object.__setattr__(self, "codes", codes)

    @classmethod
    @takes(drive=Drive, limits=DriveLimits | None)
    def of(
        cls, drive: Drive, points: int = POINTS, *, limits: DriveLimits | None = None
    ) -> "AfgWaveform":
        """One period of `drive`, from its first sample on, resampled to `points` codes.

        A code is held, so it takes the drive half a point after its own start: the mean of what it
        stands for, and no half point of delay. Levels are rounded outward to 0.1 mV, so no code
        lies outside the drive's own range by more than half a code. Raises `DataError` where the
        drive has no period; with `limits`, `LimitError` where a level would lie beyond them, as
        for a drive within 0.1 mV of a limit that is no multiple of 0.1 mV.
        """
        value = period_volts(drive, points)
        low = np.floor(drive.value.min() / _LEVEL + 1e-6) * _LEVEL
        high = max(np.ceil(drive.value.max() / _LEVEL - 1e-6) * _LEVEL, low + _LEVEL)
        if limits is not None:
            low = _within(float(low), float(drive.value.min()), limits.low_v, limits, sign=-1)
            high = _within(float(high), float(drive.value.max()), limits.high_v, limits, sign=1)
        rate = drive.rate  # not zero: it repeats
        return cls(codes_of(value, float(low), float(high)), float(low), float(high), rate)

    @property
    def volts(self) -> np.ndarray:
        """What the generator puts out, one value a code, V."""
        return self.low_v + self.codes * ((self.high_v - self.low_v) / FULL)


def _within(level: float, extreme: float, limit: float, limits: DriveLimits, *, sign: int) -> float:
    """`level`, or where it lies beyond `limit`, the last step before that, if it holds `extreme`.

    All in V; `sign`: 1 for the high level, -1 for the low one. Raises `LimitError`.
    """
    if sign * (level - limit) <= _ROUNDING:
        return level
    last = sign * float(np.floor(sign * limit / _LEVEL + 1e-6)) * _LEVEL
    slack = THRESHOLDS.limit_rounding * (limits.high_v - limits.low_v)
    if sign * (extreme - last) <= slack:
        return last
    raise LimitError(
        f"the drive reaches {extreme:.6g} V and the limit is {limit:.6g} V, but a generator sets "
        "its levels in steps of 0.1 mV, and none lies between the two. Scan less by 0.1 mV, or "
        "give limits in whole steps."
    )


def period_volts(drive: Drive, points: int) -> np.ndarray:
    """One period of `drive` from its first sample on, at the middle of each of `points` steps, V.

    Raises `DataError` where the drive has no period.
    """
    if drive.excitation_hz is None or drive.periods < 1:
        raise DataError(
            "Only a drive that repeats can be loaded into a generator, but this one has no "
            "complete period."
        )
    if not 2 <= points <= POINTS:
        raise DataError(f"A waveform has 2 to {POINTS} points, but {points} are asked for.")
    period = 1.0 / drive.excitation_hz
    inside = drive.time < period * (1 - 1e-9)
    at = (np.arange(points) + 0.5) * (period / points)
    return np.interp(at, drive.time[inside], drive.value[inside], period=period)


def codes_of(volts: np.ndarray, low_v: float, high_v: float) -> np.ndarray:
    """The nearest codes to `volts` between two levels, uint16; the levels must enclose `volts`."""
    return np.rint((volts - low_v) / (high_v - low_v) * FULL).astype(np.uint16)
