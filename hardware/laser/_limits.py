"""Limits of a laser head: wavelength, piezo, current and temperatures."""

import math
from dataclasses import dataclass, fields

from rapi_jax import LimitError

Range = tuple[float, float]


@dataclass(frozen=True)
class LaserLimits:
    """Lowest and highest of each, from the head's data sheet; there are no defaults.

    - `wavelength_nm`: TLB-6712: 765 to 781. `piezo_percent`: of the controller's range.
    - `current_ma`: of the diode. `diode_c`, `cavity_c`: temperatures between which it may be used.

    >>> from hardware import LaserLimits
    >>> limits = LaserLimits(
    ...     (765.0, 781.0), (0.0, 100.0), (30.0, 140.0), diode_c=(15.0, 30.0), cavity_c=(20.0, 40.0)
    ... )
    >>> limits.piezo_percent
    (0.0, 100.0)
    """

    wavelength_nm: Range
    piezo_percent: Range
    current_ma: Range
    diode_c: Range
    cavity_c: Range

    def __post_init__(self) -> None:
        for field in fields(self):
            low, high = getattr(self, field.name)
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise LimitError(
                    f"`{field.name}` must be two finite numbers, the lower first, but is "
                    f"{(low, high)}."
                )
        if self.piezo_percent[0] < 0 or self.piezo_percent[1] > 100:
            raise LimitError(f"`piezo_percent` lies in 0 to 100, but is {self.piezo_percent}.")

    def check(self, name: str, value: float) -> None:
        """Raise `LimitError` where `value` is not within the limit of that name."""
        low, high = getattr(self, name)
        if not low <= value <= high:
            raise LimitError(
                f"{value:g} is not within the limit `{name}` of {low:g} to {high:g}. Nothing was "
                "sent. Choose a value within it, or widen the limit if the data sheet allows."
            )
