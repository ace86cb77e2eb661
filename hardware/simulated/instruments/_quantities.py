"""Numbers of SCPI with a unit behind them, such as `1.5`, `500mV`, `40 HZ`, `50OHM`.

Multipliers after IEEE 488.2: `M` is a thousandth, but a million before HZ and OHM, where `MA` may
be written, too.
"""

import math
import re

from ._status import ScpiFault

_NUMBER = re.compile(
    r"([+-]?(?:\d{1,30}(?:\.\d{0,30})?|\.\d{1,30})(?:E[+-]?\d{1,3})?)\s*([A-Z]*)", re.IGNORECASE
)
_MULTIPLIERS = {
    "": 1.0, "N": 1e-9, "U": 1e-6, "M": 1e-3, "K": 1e3, "MA": 1e6, "G": 1e9,
}  # fmt: skip
_UNITS = {"V": ("V", "VPP"), "HZ": ("HZ",), "S": ("S",), "OHM": ("OHM",), "RAD": ("RAD", "DEG")}
_UNITS |= {"PCT": ("PCT",), "": ()}


def parse_quantity(word: str, quantity: str = "") -> float:
    """The number in `word`, in the unit `quantity` (V, HZ, S, OHM, RAD, PCT; "" for none).

    Raises `ScpiFault`: -224 for what is no number, -131 for another unit.
    """
    found = _NUMBER.fullmatch(word.strip())
    if not found:
        raise ScpiFault(-224, word)
    value, suffix = float(found[1]), found[2].upper()
    if not suffix:
        return value
    for unit in _UNITS[quantity]:
        prefix = suffix.removesuffix(unit)
        if suffix.endswith(unit) and prefix in _MULTIPLIERS:
            prefix = "MA" if prefix == "M" and quantity in ("HZ", "OHM") else prefix
            return value * _MULTIPLIERS[prefix] * (math.pi / 180 if unit == "DEG" else 1.0)
    raise ScpiFault(-131, word)
