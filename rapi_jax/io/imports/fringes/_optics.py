"""What the optics of a fringe record are, from numbers with their unit."""

import re

from rapi_jax._errors import DataError
from rapi_jax.io._safe import printable

LIGHT = 299_792_458.0  # m/s
_HZ = {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "GHz": 1e9}
_S = {"s": 1.0, "us": 1e-6, "ns": 1e-9, "ps": 1e-12}
_M = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
DELAYS_S = (1e-13, 1e-3)  # 30 um to 300 km of path
SPACINGS_HZ = (1e5, 1e13)
INTERFEROMETER_EXAMPLES = '"40.8 MHz" (free spectral range), "24.5 ns" (delay) or "7.34 m" (path)'
CAVITY_EXAMPLE = '"1.5 GHz"'


def interferometer_delay_s(text: str) -> float:
    """Delay of an interferometer from its free spectral range, delay or optical path difference.

    Raises `DataError` unless `text` is a positive number with a unit of one of these.
    """
    value, unit = _quantity("--interferometer", text, {**_HZ, **_S, **_M}, INTERFEROMETER_EXAMPLES)
    delay = 1.0 / value if unit in _HZ else value / LIGHT if unit in _M else value
    if not DELAYS_S[0] <= delay <= DELAYS_S[1]:
        raise DataError(
            f"--interferometer {printable(text, 30)} is a delay of {delay:.3g} s, a path of "
            f"{delay * LIGHT:.3g} m: no interferometer has that. Check its unit."
        )
    return delay


def cavity_spacing_ghz(text: str) -> float:
    """Free spectral range of a cavity, GHz. Raises `DataError` unless `text` has a unit of it."""
    value, _ = _quantity("--cavity-spacing", text, _HZ, CAVITY_EXAMPLE)
    if not SPACINGS_HZ[0] <= value <= SPACINGS_HZ[1]:
        raise DataError(
            f"--cavity-spacing {printable(text, 30)} is no free spectral range of a cavity. "
            "Check its unit."
        )
    return value / 1e9


def _quantity(option: str, text: str, units: dict[str, float], examples: str) -> tuple[float, str]:
    found = re.fullmatch(r"\s*([-+.0-9eE]+)\s*([A-Za-z\u00b5\u03bc]+)\s*", str(text))
    try:
        number = float(found[1]) if found else 0.0
    except ValueError:
        number = 0.0
    unit = found[2].replace("\u00b5", "u").replace("\u03bc", "u") if found else ""
    if unit not in units or not 0.0 < number < float("inf"):
        near = [one for one in units if one.lower() == unit.lower()]
        meant = f" Did you mean {' or '.join(near)}?" if near and unit not in units else ""
        raise DataError(
            f"{option} must be a positive number with its unit, such as {examples}, but is "
            f"'{printable(text, 30)}'.{meant}"
        )
    return number * units[unit], unit
