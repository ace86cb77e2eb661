"""A recording: the runs of one session on one device, their units and their provenance."""

import dataclasses
import hashlib
from collections.abc import Sequence
from datetime import datetime
from typing import Any, Literal, get_args

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax._thresholds import THRESHOLDS
from rapi_jax.display._one_line import describe_recording
from rapi_jax.display._recording import (
    recording_dataframe,
    recording_dataset,
    summarise_recording,
)

from ._conditions import parse_recorded_at, parse_temperature
from ._drive import Drive
from ._run import Run

Origin = Literal["session", "run"]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """Runs of one session on one device; they may differ in length, rate and sampling.

    - `response_unit`, `drive_unit`: "GHz" for optical frequency ("um", "nm", "V", "uC", "mrad",
      "mN", "mA", "mT", "uC/cm2" for others), and "V", "um", "mA",
      "mT", "mrad" or "mN"; conversion happens where files are read.
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
    def one_rate(self) -> bool:
        """Whether all runs have about one scan rate: within a factor of 1.2, or none at all.

        Hysteresis that grows with the rate cannot then be told from a lag.
        """
        return max(self.rates) <= THRESHOLDS.one_rate * min(self.rates)

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
        return describe_recording(self)

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
