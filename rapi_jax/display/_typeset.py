"""Units and numbers as a page or a picture sets them: μm, V², 2790, a minus sign.

Files and terminals have the plain letters of the keyboard.
"""

import re

SPACE = "\N{NO-BREAK SPACE}"
MINUS = "\N{MINUS SIGN}"
_EXPONENT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_MICRO = re.compile(r"(?<![A-Za-z])u(?=(?:m|s|V|A|C|N|T|rad)(?![A-Za-z]))")
_ONE = r"(?:[pnuμmkMGT]?(?:Hz|V|A|C|N|T|s|m|rad)|°C|deg C|decade|min|h|1)(?:\^-?\d)?"
_UNIT = rf"(?:{_ONE}(?: (?:s|V)(?=/))?(?:/(?:√Hz|{_ONE}))?|%)"
_AFTER_NUMBER = re.compile(rf"(?<=[\d⁰¹²³⁴-⁹])[ {SPACE}]({_UNIT})(?![\w/^])")
_BY_ITSELF = re.compile(rf"(?<=\()({_UNIT})(?=\))")
_POWER = re.compile(r"(?<![\w.])(\d(?:\.\d+)?)e([-+]\d{1,3})(?![\w.]\w)")
_NUMBER = r"-?\d+(?:\.\d+)?(?:e[-+]\d+)?"
_RANGE = re.compile(rf"(?<![\w.-])({_NUMBER}) to ({_NUMBER})(?![\w.])")
_ROUNDING = 1e-9  # of one end of a range: the other is 0
_NEGATIVE = re.compile(r"(?<![\w.)\]-])-(?=\d)")


def unit_text(unit: str) -> str:
    """A unit of a file as people write it: um with its letter, V^2 with a raised 2.

    >>> unit_text("um/V^2")
    'μm/V²'
    """
    raised = re.sub(r"\^(-?\d+)", lambda found: found[1].translate(_EXPONENT), unit)
    return _MICRO.sub("\N{GREEK SMALL LETTER MU}", raised)


def typeset(text: str) -> str:
    """A sentence or a cell for a page: units and numbers in it, with no line break between them.

    >>> typeset("-2.79e+03 V to 5e-06 um").replace(SPACE, "_")
    '−2790_V to 5×10⁻⁶_μm'
    """
    text = _RANGE.sub(_round_ends, text)
    text = _POWER.sub(lambda found: plain_power(found[1], int(found[2])), text)
    text = _AFTER_NUMBER.sub(lambda found: f"{SPACE}{unit_text(found[1])}", text)
    text = _BY_ITSELF.sub(lambda found: unit_text(found[1]), text)
    return _NEGATIVE.sub(MINUS, text)


def _round_ends(found: re.Match[str]) -> str:
    """A range one end of which is 0 but for rounding."""
    ends = [found[1], found[2]]
    least = _ROUNDING * max(abs(float(end)) for end in ends)
    return " to ".join("0" if abs(float(end)) < least else end for end in ends)


def plain_power(mantissa: str, power: int) -> str:
    """A number that was written with a power of ten, without it where six places hold it.

    >>> plain_power("2.79", 3), plain_power("5", -6)
    ('2790', '5×10⁻⁶')
    """
    if not -4 <= power < 6:
        return f"{mantissa}×10{str(power).translate(_EXPONENT)}"
    digits = len(mantissa.replace(".", ""))
    return f"{float(f'{mantissa}e{power}'):.{max(0, digits - 1 - power)}f}"
