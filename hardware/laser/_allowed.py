"""Which commands a bridge passes on, and which limit the value of each must keep."""

import functools
import math
import re

from . import _commands as commands
from ._limits import LaserLimits

# A command, and the limit of `LaserLimits` that its value must keep; None: any value.
SETTERS: dict[str, str | None] = {
    commands.CONTROL: None,
    commands.OUTPUT: None,
    commands.TRACK: None,
    commands.WAVELENGTH_INPUT: None,
    commands.CONSTANT_POWER: None,
    commands.WAVELENGTH: "wavelength_nm",
    commands.PIEZO: "piezo_percent",
    commands.CURRENT: "current_ma",
    commands.SCAN_FROM: "wavelength_nm",
    commands.SCAN_TO: "wavelength_nm",
    commands.SPEED_UP: None,
    commands.SPEED_BACK: None,
    commands.SCAN_OPTION: None,
    commands.SCANS: None,
    commands.SCAN_BEGIN: None,
    commands.SCAN_END: None,
    commands.SCAN_RESET: None,
    "*CLS": None,
}
QUERIES = (
    "*IDN?",
    commands.DONE,
    commands.STATUS,
    commands.ERROR,
    f"{commands.MODEL}?",
    commands.SENSED_WAVELENGTH,
    commands.SENSED_PIEZO,
    commands.SENSED_CURRENT,
    commands.DIODE_TEMPERATURE,
    commands.CAVITY_TEMPERATURE,
    *(f"{name}?" for name in SETTERS if not name.startswith("*")),
)


def refusal(command: str, limits: LaserLimits | None) -> str:
    """Why `command` is not passed on, in a few words; empty where it is.

    Raises `LimitError` where its value is beyond `limits`; without them no value is.
    """
    header, _, value = command.strip().partition(" ")
    if any(_pattern(one).fullmatch(header) for one in QUERIES):
        return "" if not value.strip() else "a query has no value"
    name = next((one for one in SETTERS if _pattern(one).fullmatch(header)), None)
    if name is None:
        return "the command is not on the list"
    limit = SETTERS[name]
    if limit is None or limits is None:
        return ""
    try:
        number = float(value) if value.strip().isascii() and "_" not in value else math.nan
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        return "the value is no number"
    limits.check(limit, number)
    return ""


@functools.cache
def _pattern(spec: str) -> re.Pattern[str]:
    """A header in its long or its short form, in any case."""
    parts = []
    for part in spec.rstrip("?").split(":"):
        short = re.match(r"[*A-Z]+", part)
        parts.append(f"(?:{re.escape(part)}|{re.escape(short[0] if short else part)})")
    end = r"\?" if spec.endswith("?") else ""
    return re.compile(f":?{':'.join(parts)}{end}", re.IGNORECASE)
