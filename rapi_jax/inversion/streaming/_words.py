"""The numbers of an operator as words of integers, in Python's own, which have no length."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Formats:
    """Where the binary point stands: how many of the `bits` of a word are fractional.

    - `volts`: drive, thresholds, plays. `slope`: of the falling bounds. `weight`: of the plays.
    - `response`: of the target, which counts from `centre`. `guard`: how many more bits the sum of
      the response has, so that its roundings stay below half a step of the target.

    A word has a sign and `bits - 1` digits; a fraction beyond these has leading zeros left out.
    """

    bits: int
    volts: int
    slope: int
    weight: int
    response: int
    guard: int
    centre: float


@dataclasses.dataclass(frozen=True)
class Words:
    """The operator in integers, one per play where it says so; see `Formats`.

    `d` is the polynomial in the drive over its full scale, constant first, with guard bits. `start`
    are the plays at rest at `low`.
    """

    r: tuple[int, ...]
    p: tuple[int, ...]
    lam: tuple[int, ...]
    offset: tuple[int, ...]
    bow: int
    d: tuple[int, ...]
    start: tuple[int, ...]
    low: int
    high: int


def shifted(value: int, by: int) -> int:
    """`value / 2^by` rounded to the nearest integer, halves up: an adder and a wire."""
    return (value + (1 << by >> 1)) >> by


def upper(words: Words, formats: Formats, i: int, x: int) -> int:
    """The falling bound of play `i` at `x` (Eq. 12)."""
    slope = words.lam[i] + shifted(words.bow * x, formats.bits - 1)
    return shifted(slope * x, formats.slope) + words.offset[i]
