"""The proof that no step in integers overflows, whatever the targets."""

from ._words import Formats, Words, shifted

Range = tuple[int, int]


def prove(formats: Formats, words: Words) -> tuple[int, str]:
    """Bits of the widest intermediate over all histories, and what overflows (or nothing).

    Interval arithmetic in Python's integers, which have no length. By induction a play stays
    between its rising bound at `low` and the larger of that at `high` and where it started.
    """
    f, w = formats, words
    point = 1 << (f.bits - 1)
    weight = f.weight + f.volts - f.response - f.guard
    if not w.low < w.high:
        return 0, "the range of the drive is less than two steps"
    if min(f.slope, weight) < 1:
        return 0, "the formats of drive and response lie too far apart"
    widest = max(point << f.guard, *map(abs, w.d))

    def back(product: Range, by: int) -> Range:
        """A product moved back, noted with what rounding adds to it."""
        nonlocal widest
        widest = max(widest, *(abs(end) + (1 << (by - 1)) for end in product))
        return shifted(product[0], by), shifted(product[1], by)

    x = (w.low, w.high)
    tilt = back(_times((w.bow, w.bow), x), f.bits - 1)
    numbers = [*x, *w.r, *w.p, *w.lam, *w.offset, w.bow]
    total = 0  # of magnitudes, so that it also bounds the sums in between, in any order
    for i, r in enumerate(w.r):
        slope = (tilt[0] + w.lam[i], tilt[1] + w.lam[i])
        bound = back(_times(slope, x), f.slope)
        widest = max(widest, *(abs(end + w.offset[i]) for end in bound))
        play = (w.low - r, max(w.high - r, w.start[i]))
        total += max(map(abs, back(_times((w.p[i], w.p[i]), play), weight)))
        numbers += play
    value = (w.d[-1], w.d[-1])
    for c in w.d[-2::-1]:
        value = back(_times(value, x), f.bits - 1)
        value = (value[0] + c, value[1] + c)
        widest = max(widest, *map(abs, value))
    # The difference to the target is taken, too.
    widest = max(widest, total + max(map(abs, value)) + (point << f.guard))
    if not all(-point <= n < point for n in numbers):
        return 0, f"a number does not fit a word of {f.bits} bits"
    length = widest.bit_length() + 1
    return length, "" if length <= 64 else f"an intermediate would need {length} bits, not 64"


def _times(a: Range, b: Range) -> Range:
    ends = [m * n for m in a for n in b]
    return min(ends), max(ends)
