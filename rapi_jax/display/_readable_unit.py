"""The unit of a dimension in which a quantity is best read: 41 MHz, not 0.041 GHz."""

from collections.abc import Iterable

import numpy as np

_LADDERS = (
    {"THz": 1e12, "GHz": 1e9, "MHz": 1e6, "kHz": 1e3, "Hz": 1.0},
    {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "nV": 1e-9},
    {"C": 1.0, "mC": 1e-3, "uC": 1e-6, "nC": 1e-9, "pC": 1e-12, "fC": 1e-15},
    {"mrad": 1.0, "urad": 1e-3, "nrad": 1e-6},
    {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "nN": 1e-9},
    {"A": 1.0, "mA": 1e-3, "uA": 1e-6, "nA": 1e-9},
    {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9},
    {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "ps": 1e-12},
    {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "pm": 1e-12},
)


def readable_unit(unit: str, sizes: Iterable[float]) -> tuple[str, float]:
    """The largest unit of `unit`'s dimension in which the largest of `sizes` is at least 1.

    The smallest unit where it is below 1 in all. With the factor to it from `unit`. A unit of no
    family known stays as it is. `sizes`, in `unit`; what is not finite does not count.
    """
    largest = max((abs(x) for x in sizes if np.isfinite(x)), default=0.0)
    for ladder in _LADDERS:
        if unit in ladder and largest > 0:
            fine = min(ladder.values())
            for name, size in ladder.items():
                factor = ladder[unit] / size
                if largest * factor >= 1.0 or size == fine:
                    return name, factor
    return unit, 1.0


_MOST = 1e4  # of the largest of several sizes in one unit


def common_unit(unit: str, sizes: Iterable[float]) -> tuple[str, float]:
    """One unit for several sizes, and the factor to it: that in which the smallest reads best.

    Where the largest would have five digits before the point in it, that of the largest. What is 0
    or not finite does not count.

    >>> common_unit("GHz", [1.2, 0.008]), common_unit("GHz", [1.2, 8e-6])
    (('MHz', 1000.0), ('GHz', 1.0))
    """
    known = [abs(x) for x in sizes if np.isfinite(x) and x]
    if not known:
        return unit, 1.0
    name, factor = readable_unit(unit, (min(known),))
    return (name, factor) if max(known) * factor < _MOST else readable_unit(unit, (max(known),))


def quantity(value: float, unit: str) -> str:
    """A size with three digits, in the unit in which it reads best: 42.7 MHz, not 0.0427 GHz."""
    unit, factor = readable_unit(unit, (value,))
    return f"{significant(factor * value, 3)} {unit}"


def significant(value: float, digits: int) -> str:
    """A number with so many significant digits, below a million without a power of ten: 360."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(float(text)) < 1e6 else text


def interval_digits(value: float, width: float) -> int:
    """The significant digits of a number in an interval: down to the second digit of its `width`.

    At least 2, and 3 where the width says nothing (0, or not finite).
    """
    if not (np.isfinite(value) and np.isfinite(width) and width > 0):
        return 3
    place = _power(width) - 1  # of the last digit, as a power of ten
    nearest = round(float(value), -place)
    return min(max(_power(nearest) - place + 1, 2), 12) if nearest else 2


def in_interval(value: float, width: float) -> str:
    """A number with the digits that an interval so wide needs: 212.6 of one that is 7.4 wide."""
    if not np.isfinite(value) or value == 0:
        return f"{value:g}"
    digits = interval_digits(value, width)
    after = digits - 1 - _power(float(f"{value:.{digits - 1}e}"))
    whole = -6 < after < digits + 4
    return f"{round(value, after):z.{max(after, 0)}f}" if whole else f"{value:.{digits}g}"


def _power(value: float) -> int:
    """Of ten, in a number that is not 0."""
    return int(f"{value:e}".split("e")[1])
