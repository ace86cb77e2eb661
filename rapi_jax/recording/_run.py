"""A run: a drive and the response to it, with the region of interest between its turns."""

import dataclasses
from functools import cached_property

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.display._one_line import describe_run
from rapi_jax.sampling import _phase

from ._column import checked_column
from ._drive import Drive

ROI = (0.1, 0.9)  # the middle 80 % of each branch's time
_ROUNDING = 1e-9  # of a branch: a sample that stands on an end of the region is inside


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
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
        object.__setattr__(
            self, "response", checked_column("response", self.response, finite=False)
        )
        if self.response.size != self.drive.size:
            raise DataError(
                f"run {self.name!r}: `response` has {self.response.size} samples, but the drive "
                f"has {self.drive.size}."
            )

    def __repr__(self) -> str:
        return describe_run(self)

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
