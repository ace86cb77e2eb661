"""A fault of a recording: what is wrong, in which run and at which samples."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Fault:
    """Something wrong in one run: `samples` are the first and last (inclusive) of each stretch.

    `left_out`: those were left out of the fit, and say nothing against it.
    """

    kind: str
    run: str
    message: str
    samples: tuple[tuple[int, int], ...] = ()
    left_out: bool = False


def format_intervals(stretches: list[tuple[int, int]]) -> str:
    shown = ", ".join(f"{a}-{b}" if b > a else f"{a}" for a, b in stretches[:3])
    return shown + (f" and {len(stretches) - 3} more" if len(stretches) > 3 else "")
