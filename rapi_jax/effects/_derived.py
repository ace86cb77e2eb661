"""Quantities of the field that follow from an effect's parameters: bandwidth, bits, quality."""

from collections.abc import Callable
from typing import NamedTuple


class ScanRange(NamedTuple):
    """What was scanned: the whole range of the drive (V), and the fastest rate (Hz)."""

    drive: float
    fastest_hz: float


class Derived(NamedTuple):
    """A quantity that follows from one parameter.

    - `name`, `unit`: as people write them.
    - `parameter`: the parameter that it follows from; `of`: its value there.
    - `optical`: whether it says something only where the response is an optical frequency in GHz.
    """

    name: str
    unit: str
    parameter: str
    of: Callable[[float], float]
    optical: bool = False


HALF_LIGHT_MM_GHZ = 149.896229  # c / 2: length of a cavity times its free spectral range
