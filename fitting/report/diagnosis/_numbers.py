"""Formatting of numbers: one unit a page, significant digits by standard error, intervals."""

import dataclasses
import math
from typing import Any

from fitting._units import readable_unit
from fitting.report.fit._table import round_with_error
from rapi_jax.internal import unit_text as unit_text

DASH = "\N{EN DASH}"
UNDETERMINED = "not determined"
SPACE = "\N{NO-BREAK SPACE}"
_MINUS = "\N{MINUS SIGN}"
_EXPONENT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def finite_or_none(value: Any) -> float | None:
    """`value` as a float where it is a finite number, else None."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def format_number(value: Any, digits: int = 3, *, sign: bool = False) -> str:
    """A number with `digits` significant digits and no `1e+03`; a dash where there is none."""
    x = finite_or_none(value)
    if x is None:
        return DASH
    # The power of ten after rounding: 9.9996 is 10.0.
    power = int(f"{x:.{digits - 1}e}".split("e")[1]) if x else 0
    if x and not -4 <= power < 6:
        mantissa, exponent = f"{abs(x):.{digits - 1}e}".split("e")
        text = f"{mantissa}×10{str(int(exponent)).translate(_EXPONENT)}"
    else:
        text = f"{abs(round(x, digits - 1 - power)):.{max(0, digits - 1 - power)}f}"
        if not text.strip("0."):
            text = "0"
    return (_MINUS if x < 0 and text != "0" else "+" if sign and x > 0 else "") + text


def format_quantity(value: Any, unit: str, *, digits: int = 3, sign: bool = False) -> str:
    """A number and its unit, kept on one line; the unit 1 is not written."""
    text = format_number(value, digits, sign=sign)
    bare = finite_or_none(value) is None or unit in ("", "1")
    return text if bare else f"{text}{SPACE}{unit_text(unit)}"


def format_setting(value: Any, unit: str) -> str:
    """A number that was set, not measured: without trailing zeros."""
    x = finite_or_none(value)
    if x is None:
        return DASH
    text = f"{x:.4g}".replace("-", _MINUS)
    return text if unit in ("", "1") else f"{text}{SPACE}{unit_text(unit)}"


def format_percent(value: Any) -> str:
    """A probability or a fraction in percent; close to 0 or 1 as a bound, never as 0 or 100 %."""
    x = finite_or_none(value)
    if x is None:
        return DASH
    if 0.0 < x < 0.001:
        return f"<{SPACE}0.1{SPACE}%"
    if 0.9995 <= x <= 1.0:
        return f">{SPACE}99.9{SPACE}%"
    places = 1 if 0.0 < x < 0.01 or 0.99 < x < 0.9995 else 0
    text = f"{100 * abs(x):.{places}f}"
    return f"{_MINUS if x < 0 and float(text) else ''}{text}{SPACE}%"


def format_interval(fraction: Any) -> str:
    """`{"value", "low", "high"}` as `94 % (90 to 96 %)`; a dash where there is no value.

    An end beyond all of it is none: `99 % (at least 97 %)`; nor is one below nothing where the
    other is beyond all.
    """
    if not isinstance(fraction, dict) or finite_or_none(fraction.get("value")) is None:
        return DASH
    low, high = finite_or_none(fraction.get("low")), finite_or_none(fraction.get("high"))
    value = format_percent(min(fraction["value"], 1.0))
    if low is None or high is None:
        return value
    if high >= 0.9995 and low <= 0.0:
        return f"{value} (perhaps nothing)"
    if high >= 0.9995:
        return f"{value} (at least{SPACE}{format_percent(min(low, 1.0))})"
    start = format_percent(low).removesuffix(f"{SPACE}%")
    return f"{value} ({start}{SPACE}to{SPACE}{format_percent(high)})"


def format_with_error(value: Any, stderr: Any, unit: str) -> str:
    """`0.0210 ± 0.0012 1/decade`, in the digits of its standard error; `104.0 ± 3.0 μs`.

    Without a finite standard error the data say nothing of the value, and it is not shown.
    """
    x, error = finite_or_none(value), finite_or_none(stderr)
    if x is not None and error is None:
        return UNDETERMINED
    if x is None or not error or error < 0:
        return format_quantity(value, unit, digits=4)
    unit, factor = readable_unit(unit, (x,))
    x, error = factor * x, factor * error
    power = math.floor(math.log10(max(abs(x), error)))
    power = 0 if -4 < power < 6 else power
    shown, spread = round_with_error(x / 10.0**power, error / 10.0**power)
    text = f"{shown.replace('-', _MINUS)}{SPACE}±{SPACE}{spread}"
    text = f"({text})×10{str(power).translate(_EXPONENT)}" if power else text
    return text + ("" if unit in ("", "1") else f"{SPACE}{unit_text(unit)}")


@dataclasses.dataclass(frozen=True)
class Scale:
    """The unit in which a page shows residuals, and the factor from the recorded unit."""

    recorded: str
    unit: str  # as shown
    factor: float

    @classmethod
    def of(cls, recorded: str, sizes: list[Any]) -> "Scale":
        """The largest unit of the same dimension in which the largest of `sizes` is at least 1."""
        known = (x for x in map(finite_or_none, sizes) if x is not None)
        unit, factor = readable_unit(recorded, known)
        return cls(recorded, unit_text(unit), factor)

    @property
    def axis(self) -> str:
        """The recorded unit as shown, for axes over the response itself."""
        return unit_text(self.recorded)

    def value(self, recorded: Any) -> float | None:
        """A recorded number in the page's unit."""
        x = finite_or_none(recorded)
        return None if x is None else x * self.factor

    def bare(self, recorded: Any, *, digits: int = 3, sign: bool = False) -> str:
        """A recorded number in the page's unit, without the unit."""
        return format_number(self.value(recorded), digits, sign=sign)

    def convert(self, value: Any, unit: str) -> tuple[float | None, str]:
        """A number in `unit` and its unit as shown: the page's, or that in which it reads best."""
        x = finite_or_none(value)
        if x is None or (unit and unit == self.recorded):
            return self.value(value), self.unit
        unit, factor = readable_unit(unit, (x,))
        return factor * x, unit

    def with_error(self, value: Any, stderr: Any, unit: str) -> str:
        """A number in `unit` with its standard error, both in the unit as `convert` has it."""
        if unit and unit == self.recorded:
            return format_with_error(self.value(value), self.value(stderr), self.unit)
        return format_with_error(value, stderr, unit)

    def __call__(self, recorded: Any, *, digits: int = 3, sign: bool = False) -> str:
        return format_quantity(self.value(recorded), self.unit, digits=digits, sign=sign)


def page_scale(diagnosis: dict) -> Scale:
    """The unit of a diagnosis: that in which its verdict gives the residuals, else that of the gap.

    The verdict's sentence is in the file as text, so all else takes its unit.
    """
    refit, gap = diagnosis.get("shrinkage") or {}, diagnosis.get("gap") or {}
    held_out = [finite_or_none(refit.get(key)) for key in ("before", "after")]
    sizes = held_out if any(held_out) else [finite_or_none(gap.get("total"))]
    return Scale.of(str(diagnosis.get("unit") or ""), sizes)
