"""Units as files write them, and the factors to those of a recording."""

import re

from rapi_jax._errors import DataError
from rapi_jax.io._safe import printable

_MICRO = "\u00b5\u03bc"  # the micro sign and the Greek letter
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
VOLTS = {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "kV": 1e3}
_LENGTH = {"m": 1e6, "mm": 1e3, "um": 1.0, "nm": 1e-3, "pm": 1e-6}  # in um
_CHARGE = {"C": 1e6, "mC": 1e3, "uC": 1.0, "nC": 1e-3, "pC": 1e-6}  # in uC
_ANGLE = {"rad": 1e3, "mrad": 1.0, "urad": 1e-3, "deg": 17.453292519943295}  # in mrad
_FORCE = {"N": 1e3, "mN": 1.0, "uN": 1e-3, "nN": 1e-6}  # in mN
_CURRENT = {"A": 1e3, "mA": 1.0, "uA": 1e-3}  # in mA
_FIELD = {"T": 1e3, "mT": 1.0, "uT": 1e-3}  # in mT
_POLARISATION = {"uC/cm2": 1.0, "C/m2": 100.0}  # in uC/cm2
_OPTICAL = {"GHz": 1.0, "MHz": 1e-3, "kHz": 1e-6, "Hz": 1e-9, "THz": 1e3}
_WORDS = {
    "second": "s", "seconds": "s", "sec": "s", "volt": "V", "volts": "V", "v": "V",
    "millivolt": "mV", "millivolts": "mV", "micron": "um", "microns": "um", "hertz": "Hz",
    "msec": "ms", "usec": "us", "minutes": "min", "hours": "h", "degree": "deg", "degrees": "deg",
    "newton": "N", "tesla": "T", "ampere": "A", "c/m^2": "C/m2", "uc/cm^2": "uC/cm2",
    "gigahertz": "GHz", "megahertz": "MHz", "kilohertz": "kHz", "terahertz": "THz",
    "metre": "m", "meter": "m", "metres": "m", "meters": "m", "millisecond": "ms",
    "milliseconds": "ms", "microsecond": "us", "microseconds": "us", "nanometre": "nm",
    "nanometres": "nm", "nanometer": "nm", "nanometers": "nm", "micrometre": "um",
    "micrometres": "um", "micrometer": "um", "micrometers": "um", "millimetre": "mm",
    "millimetres": "mm", "millimeter": "mm", "millimeters": "mm",
}  # fmt: skip
_EITHER = {  # a diode's current, a coil's field, a motor's angle and a press's force drive, too
    **{unit: ("mrad", factor) for unit, factor in _ANGLE.items()},
    **{unit: ("mN", factor) for unit, factor in _FORCE.items()},
    **{unit: ("mA", factor) for unit, factor in _CURRENT.items()},
    **{unit: ("mT", factor) for unit, factor in _FIELD.items()},
}
_OTHER = {**_EITHER, **{unit: ("uC/cm2", factor) for unit, factor in _POLARISATION.items()}}
_KNOWN = {*TIMES, *VOLTS, *_LENGTH, *_CHARGE, *_OPTICAL, *_OTHER}

DRIVES = {
    **{unit: ("V", factor) for unit, factor in VOLTS.items()},
    **{unit: ("um", factor) for unit, factor in _LENGTH.items()},
    **_EITHER,
}
RESPONSES = {
    **{unit: ("GHz", factor) for unit, factor in _OPTICAL.items()},
    **{unit: ("V", factor) for unit, factor in VOLTS.items()},
    **{unit: ("um", factor) for unit, factor in _LENGTH.items()},
    "nm": ("nm", 1.0),
    "pm": ("nm", 1e-3),
    **{unit: ("uC", factor) for unit, factor in _CHARGE.items()},
    **_OTHER,
}

_CHANNELS = ("A", "N", "T")  # behind a sign that separates they more often number a channel


def known_unit(text: str) -> str | None:
    """The unit that `text` is, in this package's spelling; `None` where it is none of them."""
    plain = text.strip().strip("()[]").strip()
    for sign in _MICRO:
        plain = plain.replace(sign, "u")
    return plain if plain in _KNOWN else _WORDS.get(plain.lower())


_FORMS = (
    re.compile(r"(?P<name>.*?)\s*[(\[]\s*(?P<unit>[^()\[\]]{1,12})\s*[)\]]"),
    re.compile(r"(?P<name>.*?)\s*\bin\s+(?P<unit>\S{1,12})"),
    re.compile(r"(?P<name>.+?)\s*[/_,]\s*(?P<unit>[^\s/_,]{1,12})"),
)


def split_unit(name: str) -> tuple[str, str | None]:
    """A name without the unit in it, and that unit: "CH1 (mV)", "C1 in V", "time_s", "Ch1,V".

    "Input_A" names a channel.
    """
    for form in _FORMS:
        found = form.fullmatch(name)
        unit = known_unit(found["unit"]) if found else None
        if found and unit and not (form is _FORMS[-1] and unit in _CHANNELS):
            return found["name"].strip(), unit
    return name, None


def time_factor(unit: str) -> float:
    """Seconds in one `unit`. Raises `DataError` where that is no unit of time."""
    found = known_unit(unit)
    if found not in TIMES:
        raise DataError(_refusal("--time-unit", unit, TIMES))
    return TIMES[found]


def drive_factor(unit: str) -> tuple[str, float]:
    """The drive unit of a recording that `unit` becomes, and the factor; or `DataError`."""
    found = known_unit(unit)
    if found not in DRIVES:
        raise DataError(_refusal("--drive-unit", unit, DRIVES))
    return DRIVES[found]


def response_factor(unit: str) -> tuple[str, float]:
    """The response unit of a recording that `unit` becomes, and the factor; or `DataError`."""
    found = known_unit(unit)
    if found not in RESPONSES:
        raise DataError(_refusal("--response-unit", unit, RESPONSES))
    return RESPONSES[found]


def _refusal(option: str, unit: str, allowed: dict) -> str:
    scale = option.replace("unit", "scale")
    near = [one for one in allowed if one.lower() == unit.strip().lower()]
    meant = f" Did you mean {' or '.join(near)}?" if near else ""
    others = "a charge, a magnetising field, a pressure"
    if option == "--drive-unit" and known_unit(unit) in RESPONSES:
        meant = f"{meant} That is a unit of a response: are --drive and --response exchanged?"
    cure = (
        ""
        if option == "--time-unit"
        else f" Of another quantity ({others}) name the unit of the "
        f"signal that it was read or set by, such as V, and the factor to it by {scale}."
    )
    return (
        f"{option} must be one of {', '.join(allowed)}, not '{printable(unit, 30)}'.{meant}{cure}"
    )
