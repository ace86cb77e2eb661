"""What the photodiodes of a ranging set-up recorded, and what has to be known of the set-up."""

import dataclasses
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from rapi_jax._errors import DataError

Shape = Literal["triangle", "sine", "other"]
_SHORTEST = 256  # samples; less holds no branch of a scan at any usual rate


@dataclasses.dataclass(frozen=True)
class AirState:
    """The air along the measurement arm.

    - `temperature_c` (deg C), `pressure_pa` (Pa), `relative_humidity` (0 to 1), `co2_ppm`.
    - `..._stderr`: standard errors, in the same units. By default those of a plain laboratory's
      weather station: 0.1 K, 20 Pa, 2 %, 50 ppm.

    Raises `DataError` outside -40 to 100 deg C, 10 to 140 kPa, 0 to 1, 0 to 2000 ppm: the range of
    the formulas for the index.

    >>> from rapi_jax.ranging import AirState
    >>> AirState(temperature_c=21.0, pressure_pa=101325.0, relative_humidity=0.5).co2_ppm
    450.0
    """

    temperature_c: float
    pressure_pa: float
    relative_humidity: float
    co2_ppm: float = 450.0
    temperature_stderr: float = 0.1
    pressure_stderr: float = 20.0
    humidity_stderr: float = 0.02
    co2_stderr: float = 50.0

    def __post_init__(self) -> None:
        for name, low, high in (
            ("temperature_c", -40.0, 100.0),
            ("pressure_pa", 1e4, 1.4e5),
            ("relative_humidity", 0.0, 1.0),
            ("co2_ppm", 0.0, 2000.0),
            ("temperature_stderr", 0.0, 10.0),
            ("pressure_stderr", 0.0, 1e4),
            ("humidity_stderr", 0.0, 1.0),
            ("co2_stderr", 0.0, 2000.0),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                hint = " (0.5 for 50 %)" if name == "relative_humidity" else ""
                raise DataError(f"`{name}` must be from {low:g} to {high:g}{hint}, not {value}.")


def _column(name: str, value: Any) -> np.ndarray:
    array = np.asarray(value)
    if array.ndim != 1 or array.dtype not in (np.int16, np.float32, np.float64):
        raise DataError(
            f"`{name}` must be one column of int16 codes or floating-point numbers, but has shape "
            f"{array.shape} and type {array.dtype}."
        )
    return array


@dataclasses.dataclass(frozen=True, eq=False)
class FringeRecord:
    """Photodiode records of one stretch of time, sampled together; codes or volts.

    - `measurement`: the measurement arm, `B + A cos(2 pi nu tau)` (Eq. 1).
    - `interferometer`: the auxiliary interferometer. `cavity`: the Fabry-Perot's transmission.
    - `drive`: the voltage at the piezo, where it was recorded.
    - `start_s`: session time of the first sample, s.
    - `rising_at_start`: whether the optical frequency rises there; `None` where unknown.

    Columns may be views into a file; they are read once. Raises `DataError` where a column is not
    one of numbers, is too short, or differs in length from the others.

    >>> import numpy as np
    >>> from rapi_jax.ranging import FringeRecord
    >>> record = FringeRecord(np.zeros(300, np.int16), np.ones(300, np.int16), start_s=0.1)
    >>> record.size, record.cavity is None
    (300, True)
    """

    measurement: np.ndarray
    interferometer: np.ndarray
    cavity: np.ndarray | None = None
    drive: np.ndarray | None = None
    start_s: float = 0.0
    rising_at_start: bool | None = None
    name: str = "record00"

    def __post_init__(self) -> None:
        size = np.shape(self.measurement)[0] if np.ndim(self.measurement) else 0
        for name in ("measurement", "interferometer", "cavity", "drive"):
            value = getattr(self, name)
            if value is None:
                continue
            column = _column(name, value)
            if column.size != size:
                raise DataError(
                    f"{self.name}: `{name}` has {column.size} samples, but `measurement` has {size}"
                    ". Both come from one digitizer: record them together."
                )
            object.__setattr__(self, name, column)
        if size < _SHORTEST:
            raise DataError(f"{self.name}: {size} samples are too few to read fringes.")
        if not np.isfinite(self.start_s):
            raise DataError(f"{self.name}: `start_s` must be finite, but is {self.start_s}.")

    @property
    def size(self) -> int:
        """Number of samples of each channel."""
        return self.measurement.size


# What no set-up is beyond: a value there is in another unit.
_PLAUSIBLE = (
    ("interferometer_path_m", 1e-3, 1e3, "m"),
    ("cavity_spacing_hz", 1e6, 1e13, "Hz"),
    ("wavelength_m", 1e-7, 1e-4, "m"),
)


@dataclasses.dataclass(frozen=True, eq=False)
class FringeRecords:
    """Records of one ranging set-up, and what is known of it.

    - `sample_hz`: sampling rate, Hz. `excitation_hz`, `waveform`: of the scan.
    - `interferometer_path_m`: optical path difference of the auxiliary interferometer, m.
    - `cavity_spacing_hz`: free spectral range of the cavity, Hz; `None` where there is no cavity.
    - `wavelength_m`: of the laser in vacuum at the middle of its scan, m; sets how strongly motion
      counts. `wavelength_stderr_m`: its standard error; by default 0.01 nm, a controller's display.
    - `air`: along the measurement arm; `None`: its index is taken as 1.
    - `volts_per_code`: V a code, or 1 where the records are in volts. `full_scale`: lowest and
      highest value the digitizer gives, in the records' own unit; `None` where unknown.

    Raises `DataError` where there is no record, or a number is not positive or beyond any set-up.

    >>> import numpy as np
    >>> from rapi_jax.ranging import FringeRecord, FringeRecords
    >>> record = FringeRecord(
    ...     np.zeros(300, np.int16), np.ones(300, np.int16), rising_at_start=True
    ... )
    >>> records = FringeRecords(
    ...     (record,), sample_hz=1e6, excitation_hz=10.0, interferometer_path_m=7.34
    ... )
    >>> records.waveform, records.air is None  # without the air, its index is taken for 1
    ('triangle', True)
    """

    records: tuple[FringeRecord, ...]
    sample_hz: float
    excitation_hz: float
    interferometer_path_m: float
    cavity_spacing_hz: float | None = None
    waveform: Shape = "triangle"
    wavelength_m: float = 780e-9
    wavelength_stderr_m: float = 1e-11
    air: AirState | None = None
    volts_per_code: float = 1.0
    full_scale: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.records:
            raise DataError("There is no record to range with.")
        for name in (
            "sample_hz",
            "excitation_hz",
            "interferometer_path_m",
            "cavity_spacing_hz",
            "wavelength_m",
            "volts_per_code",
        ):
            value: float | None = getattr(self, name)
            if value is None:  # no cavity
                continue
            if not (np.isfinite(value) and value > 0):
                raise DataError(f"`{name}` must be a positive number, but is {value}.")
        for name, low, high, unit in _PLAUSIBLE:
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise DataError(
                    f"`{name}` = {value:g} is not between {low:g} and {high:g}. Is it in {unit}?"
                )
        if self.cavity_spacing_hz is None and any(r.cavity is not None for r in self.records):
            raise DataError(
                "The records have a cavity, but `cavity_spacing_hz` is missing: give its free "
                "spectral range, or leave the channel out."
            )
        if self.excitation_hz * 16 > self.sample_hz:
            raise DataError(
                f"A scan of {self.excitation_hz:g} Hz cannot be read at {self.sample_hz:g} samples "
                "a second."
            )

    def __iter__(self) -> Iterator[FringeRecord]:
        return iter(self.records)

    def replace(self, **changes: Any) -> "FringeRecords":
        """A copy with other fields."""
        return dataclasses.replace(self, **changes)
