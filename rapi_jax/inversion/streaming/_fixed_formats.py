"""Where the binary points stand, and the words that follow."""

import dataclasses
from collections.abc import Iterable

import numpy as np

from rapi_jax._precision import as_float64

from ._frozen_operator import FrozenOperator
from ._overflow import prove
from ._thresholds import THRESHOLDS
from ._words import Formats, Words, upper


def choose(
    frozen: FrozenOperator, low: float, high: float, bits: int
) -> tuple[Formats, Words, int]:
    """Formats, words, and the bits of the widest intermediate, at most 64.

    Raises `ValueError` for a word length out of bounds, or where some history within `low` and
    `high` could overflow a word or an intermediate.
    """
    least, most = THRESHOLDS.least_bits, THRESHOLDS.most_bits
    if not least <= bits <= most:
        raise ValueError(f"Argument `bits` must lie between {least} and {most}, but is {bits}.")
    terms = len(frozen.r) + len(frozen.d)
    refused = ""
    for guard in range(terms.bit_length() + 1, -THRESHOLDS.given_up_bits - 1, -1):
        formats, words = _quantised(frozen, low, high, bits, guard)
        widest, refused = prove(formats, words)
        if not refused:
            return formats, words, widest
    raise ValueError(
        f"Argument `bits`: {bits} do not do for this model between drives of {low:g} and {high:g}: "
        f"{refused}."
    )


def _quantised(
    frozen: FrozenOperator, low: float, high: float, bits: int, guard: int
) -> tuple[Formats, Words]:
    r, p, lam, offset, d = (
        np.asarray(a) for a in (frozen.r, frozen.p, frozen.lam, frozen.offset, frozen.d)
    )
    bow = float(frozen.bow)
    ends = np.array([low, high]) - float(frozen.origin)
    first, last = as_float64(low), as_float64(high)
    rest = frozen.rest(first)
    volts = _digits([*ends, *(ends[:, None] - r).ravel(), *np.asarray(rest), *offset])
    scale = 2.0**volts
    bottom = float(frozen.respond(first, rest)[0])
    top = float(frozen.respond(last, rest)[0])
    centre, half = (bottom + top) / 2.0, abs(top - bottom) / 2.0
    formats = Formats(
        bits=bits,
        volts=bits - 1 - volts,
        slope=bits - 1 - _digits([*lam, bow * scale]),
        weight=bits - 1 - _digits(p),
        response=bits - 1 - _digits([half]) + min(guard, 0),
        guard=max(guard, 0),
        centre=centre,
    )
    powers = d * scale ** np.arange(d.size)
    powers[0] -= centre
    words = Words(
        r=_words(r, formats.volts),
        p=_words(p, formats.weight),
        lam=_words(lam, formats.slope),
        offset=_words(offset, formats.volts),
        bow=_words([bow * scale], formats.slope)[0],
        d=_words(powers, formats.response + formats.guard),
        start=(),
        low=int(np.ceil(np.ldexp(ends[0], formats.volts))),
        high=int(np.floor(np.ldexp(ends[1], formats.volts))),
    )
    start = tuple(
        max(words.low - words.r[i], upper(words, formats, i, words.low)) for i in range(r.size)
    )
    return formats, dataclasses.replace(words, start=start)


def _digits(values: Iterable[float]) -> int:
    """The smallest `n` for which all are below `2^n`, with room for rounding."""
    largest = max(abs(float(x)) for x in values)
    return int(np.frexp(largest * (1.0 + 2.0**-6))[1]) if largest > 0 else 0


def _words(values: Iterable[float], fraction: int) -> tuple[int, ...]:
    return tuple(int(np.floor(np.ldexp(float(x), fraction) + 0.5)) for x in values)
