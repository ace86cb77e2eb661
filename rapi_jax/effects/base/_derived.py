"""Quantities of the field that follow from an effect's parameters: bandwidth, bits, quality."""

from collections.abc import Callable
from typing import NamedTuple


class ScanRange(NamedTuple):
    """What was scanned: the whole range of the drive (V), and the fastest rate (Hz).

    >>> from rapi_jax.effects import Quantisation, ScanRange
    >>> (bits,) = Quantisation.at(step=0.01).derived(ScanRange(drive=5.11, fastest_hz=40.0))
    >>> bits.name, float(bits.of(0.01).round(1)), bits.unit
    ('resolution', 9.0, 'bit')
    """

    drive: float
    fastest_hz: float


class Derived(NamedTuple):
    """A quantity that follows from one parameter.

    - `name`, `unit`: as people write them.
    - `parameter`: the parameter that it follows from; `of`: its value there.
    - `optical`: whether it says something only where the response is an optical frequency in GHz.

    >>> from rapi_jax.effects import Etalon, ScanRange
    >>> etalon = Etalon.at(amplitude=0.1, spacing=5.0)
    >>> (length,) = etalon.derived(ScanRange(4.5, 40.0))
    >>> length.name, length.unit, round(length.of(5.0), 1)
    ('optical length', 'mm', 30.0)
    """

    name: str
    unit: str
    parameter: str
    of: Callable[[float], float]
    optical: bool = False


HALF_LIGHT_MM_GHZ = 149.896229  # c / 2: length of a cavity times its free spectral range
