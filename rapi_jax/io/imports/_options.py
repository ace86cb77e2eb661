"""What is known of files that a recording is to be made from."""

import dataclasses
from typing import Literal, get_args

from rapi_jax.io.recordings._build import NanPolicy, check_nan_policy
from rapi_jax.recording._drive import WAVEFORMS, Waveform
from rapi_jax.recording._recording import Origin

from .cleaning._clean import DriveAs

MOST_SAMPLES = 400_000  # what a fit looks at; more only slows reading


@dataclasses.dataclass(frozen=True)
class MadeDrive:
    """A drive that was sent and not recorded: it begins `phase` periods after its minimum.

    `amplitude` is peak to peak and `offset` the centre, both in the drive's unit; `rate` is in Hz.

    >>> from rapi_jax.io import MadeDrive
    >>> sent = MadeDrive(amplitude=4.5, rate=10.0, offset=3.0, waveform="sine")
    >>> sent.amplitude, sent.rate  # V peak to peak, Hz
    (4.5, 10.0)
    """

    amplitude: float
    rate: float
    offset: float = 0.0
    phase: float = 0.0
    waveform: Literal["triangle", "sine"] = "triangle"

    def __post_init__(self) -> None:
        for name in ("amplitude", "rate"):
            if not getattr(self, name) > 0:
                raise ValueError(f"Argument `{name}` of a drive must be positive.")


@dataclasses.dataclass(frozen=True)
class ImportOptions:
    """Which columns of a file are what, and how they become runs.

    Columns are names, or numbers from 0 as text.

    - `time`, `drive`, `response`: columns; by default those called so. `drive_file`: another file
      that holds the drive (with its own clock), for one response file.
    - `time_unit`, `drive_unit`, `response_unit`: by default what the file says; a time without a
      unit is in s. `drive_scale`, `response_scale`: factors, after which the unit holds.
    - `sample_rate`: Hz, where no column is a time. `made`: a drive that was not recorded.
    - `drive_as`: "measured" keeps the readings of a drive; "averaged" puts the mean of its periods
      in their place, and "fitted" the nearest triangle or sine, where the drive repeats.
    - `tables`: of a file that holds several, those to take, counted from 1; by default all.
    - `rates`: scan rates, Hz; by default found in the drive. `waveform`: by default found.
    - `cut`: whether to make a run of each stretch of one rate and swing. `skip_periods`,
      `skip_seconds`: what is left out at the beginning of each run.
    - `decimate`: of how many samples one is made, by their average; by default one, or as many as
      bring all runs below `max_samples`.
    - `nan`: "raise" refuses readings that are not finite, "mask" keeps them as NaN.
    - `fringes`: the column of an interferometer's detector in place of a `response`, from which the
      optical frequency is read; `interferometer` is its free spectral range, delay or optical path
      difference with the unit, such as "40.8 MHz", "24.5 ns" or "7.34 m". `cavity`: the column of a
      Fabry-Perot cavity's detector, with its free spectral range in `cavity_spacing`. Fringes do
      not tell the sign of a tuning: `response_scale=-1` where the frequency falls with the drive.
    - `response_origin`, `response_lag_s`: as in a `Recording`. `recorded_at`, `temperature_c`: as
      in its provenance; the temperature may also be a column (deg C), whose mean is taken.
    - `units_checked`: that the units are right, also where the numbers look as if they were not,
      such as those of a laser of less than 10 MHz/V.

    >>> from rapi_jax.io import ImportOptions, MadeDrive
    >>> sent = MadeDrive(amplitude=4.5, rate=10.0, offset=3.0)
    >>> options = ImportOptions(response="CH2", response_unit="GHz", drive_unit="V", made=sent)
    >>> options.nan, options.cut
    ('raise', True)
    """

    time: str | None = None
    drive: str | None = None
    response: str | None = None
    drive_file: str | None = None
    time_unit: str | None = None
    drive_unit: str | None = None
    response_unit: str | None = None
    drive_scale: float = 1.0
    response_scale: float = 1.0
    sample_rate: float | None = None
    made: MadeDrive | None = None
    drive_as: DriveAs = "measured"
    tables: tuple[int, ...] = ()
    rates: tuple[float, ...] = ()
    waveform: Waveform | None = None
    cut: bool = True
    skip_periods: int = 0
    skip_seconds: float = 0.0
    decimate: int | None = None
    max_samples: int = MOST_SAMPLES
    nan: NanPolicy = "raise"
    response_origin: Origin = "session"
    response_lag_s: float = 0.0
    recorded_at: str | None = None
    temperature_c: str | None = None
    fringes: str | None = None
    interferometer: str | None = None
    cavity: str | None = None
    cavity_spacing: str | None = None
    units_checked: bool = False

    @property
    def measured(self) -> Literal["response", "fringes"]:
        """What a file holds beside the drive: a response, or fringes to read one from."""
        return "response" if self.fringes is self.interferometer is None else "fringes"

    def __post_init__(self) -> None:
        check_nan_policy(self.nan)
        if self.waveform is not None and self.waveform not in WAVEFORMS:
            raise ValueError(f"Argument `waveform` must be one of {', '.join(WAVEFORMS)}.")
        if self.response_origin not in get_args(Origin):
            raise ValueError('Argument `response_origin` must be "session" or "run".')
        for name in ("sample_rate", "decimate"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise ValueError(f"Argument `{name}` must be positive, but is {value}.")
        if self.drive_as not in get_args(DriveAs):
            raise ValueError(
                f"Argument `drive_as` must be one of {', '.join(get_args(DriveAs))}, but is "
                f"{self.drive_as!r}."
            )
        if self.skip_periods < 0 or not 0.0 <= self.skip_seconds < float("inf"):
            raise ValueError("Arguments `skip_periods` and `skip_seconds` must be 0 or more.")
        if self.skip_periods and self.skip_seconds:
            raise ValueError("Give `skip_periods` or `skip_seconds`, not both.")
        if any(number < 1 for number in self.tables):
            raise ValueError("Argument `tables` counts from 1.")
        if any(not rate > 0 for rate in self.rates):
            raise ValueError("Argument `rates` must be positive.")
        if self.made is not None and (self.drive or self.drive_file):
            raise ValueError("Give a column of the drive, or a drive that is made, not both.")
        if self.made is not None and self.drive_as != "measured":
            raise ValueError("A drive that is made has no noise: leave `drive_as` out.")
        if self.measured == "response" and (self.cavity or self.cavity_spacing):
            raise ValueError("`cavity` and `cavity_spacing` go with `fringes`.")
        if self.measured == "fringes":
            if self.response is not None or self.response_unit not in (None, "GHz"):
                raise ValueError("Give a column of the response, or of fringes, not both.")
            if abs(self.response_scale) != 1.0:
                raise ValueError("`response_scale` of fringes must be 1 or -1, the tuning's sign.")
