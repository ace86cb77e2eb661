"""Ideal scans of the response: straight lines joined by smooth corners."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.display._one_line import describe_target


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Target:
    """One period of a response to reach, from its minimum.

    - `time`: s, even steps from 0, the next period beginning one step after the last.
    - `value`: response unit; the smallest is 0, since where a scan lies is set by the bias.
    - `excitation_hz`: periods a second. `unit`: the response unit, for what is said of the scan.

    >>> import numpy as np
    >>> from rapi_jax import linear_scan
    >>> (target,) = linear_scan(20.0, span=60.0, samples=512)
    >>> target.excitation_hz, round(float(np.ptp(target.value)), 6)  # Hz, GHz
    (20.0, 60.0)
    """

    time: np.ndarray
    value: np.ndarray
    excitation_hz: float
    unit: str = "GHz"

    def __post_init__(self) -> None:
        for name in ("time", "value"):
            array = np.array(getattr(self, name), dtype=float)
            if array.ndim != 1 or array.size < 8 or not np.isfinite(array).all():
                raise DataError(f"`{name}` of a target must be a column of 8 or more numbers.")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if self.time.size != self.value.size:
            raise DataError(f"a target has {self.time.size} times, but {self.value.size} values.")
        if not self.excitation_hz > 0:
            raise DataError(f"`excitation_hz` must be positive, but is {self.excitation_hz}.")
        step = 1.0 / (self.excitation_hz * self.time.size)
        if np.abs(self.time - step * np.arange(self.time.size)).max() > 1e-6 * step:
            raise DataError(
                "the times of a target must be even steps over exactly one period, from 0."
            )
        if self.value.argmin() != 0 or not self.span > 0:
            raise DataError("a target must start at its minimum, and must not be constant.")

    def __repr__(self) -> str:
        return describe_target(self)

    @property
    def span(self) -> float:
        """Peak to peak, response unit."""
        return float(np.ptp(self.value))

    @classmethod
    def of(cls, value: Any, excitation_hz: float, *, unit: str = "GHz") -> "Target":
        """A target from one period of values, turned so that it starts at its minimum."""
        value = np.asarray(value, dtype=float)
        value = np.roll(value, -int(value.argmin())) - value.min()
        time = np.arange(value.size) / (excitation_hz * value.size)
        return cls(time, value, excitation_hz, unit)


def linear_scan(
    frequencies: float | Sequence[float],
    *,
    span: float,
    rise: float = 0.5,
    corner: float = 0.02,
    samples: int = 8192,
    unit: str = "GHz",
) -> tuple[Target, ...]:
    """A straight scan up and down at each of `frequencies` (Hz).

    **Arguments:**

    - `span`: peak to peak of the whole scan, corners included, in the response's unit.
    - `rise`: share of the period on the way up: 0.5 is a triangle, 0.9 a sawtooth. Corners take
      their part of the longer branch, and move both turns by `corner * (rise - 0.5)`.
    - `corner`: share of the period over which each turn is rounded to a parabola, 0 for sharp
      turns. Between corners the scan is straight to the last bit.
    - `samples`: number in one period. `unit`: the response's, for messages.

    >>> from rapi_jax import linear_scan
    >>> slow, fast = linear_scan([10.0, 40.0], span=75.0, samples=512)
    >>> fast.excitation_hz, fast.value.shape
    (40.0, (512,))
    """
    if not (np.isfinite(span) and span > 0):
        raise ValueError(f"Argument `span` must be positive, but is {span}.")
    if not 0.0 < rise < 1.0:
        raise ValueError(f"Argument `rise` must lie between 0 and 1, but is {rise}.")
    if not 0.0 <= corner < min(rise, 1.0 - rise):
        raise ValueError(
            "Argument `corner` must be at least 0 and below the shorter branch's share "
            f"({min(rise, 1.0 - rise):g}), but is {corner}."
        )
    if samples < 8:
        raise ValueError(f"Argument `samples` must be at least 8, but is {samples}.")
    cycles = np.arange(samples) / samples + corner * (rise - 0.5)  # from the rounded minimum on
    shape = _rounded(cycles, rise, corner)
    shape = span * (shape - shape[0]) / np.ptp(shape)
    return tuple(
        Target(np.arange(samples) / (samples * float(f)), shape, float(f), unit)
        for f in np.atleast_1d(np.asarray(frequencies, dtype=float))
    )


def _rounded(cycles: np.ndarray, rise: float, corner: float) -> np.ndarray:
    """The wave from 0 up to 1 at `rise` and back, as its mean over a window of `corner`."""
    if corner == 0.0:
        x = np.mod(cycles, 1.0)
        return np.where(x < rise, x / rise, (1.0 - x) / (1.0 - rise))

    def integral(x: np.ndarray) -> np.ndarray:
        whole, part = np.floor(x), np.mod(x, 1.0)
        up = np.minimum(part, rise) ** 2 / (2.0 * rise)
        rest = np.maximum(part - rise, 0.0)
        return 0.5 * whole + up + rest - rest**2 / (2.0 * (1.0 - rise))

    return (integral(cycles + corner / 2) - integral(cycles - corner / 2)) / corner
