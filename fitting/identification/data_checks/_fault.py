"""A fault of a recording: what is wrong, in which run and at which samples."""

import dataclasses

from rapi_jax import Recording


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


# The model's drive is not the real one, or tells nothing of hysteresis.
_HIDING = ("wrong period", "broadband drive", "response turns back", "switched drive")


def hides_effects(fault: Fault, recording: Recording) -> bool:
    """Whether an effect would only imitate the fault.

    A first period from rest is told from creep by the periods after it.
    """
    if fault.kind == "unsettled start":
        return all(run.drive.periods < 2 for run in recording.runs)
    return fault.kind in _HIDING


def format_intervals(stretches: list[tuple[int, int]]) -> str:
    shown = ", ".join(f"{a}-{b}" if b > a else f"{a}" for a, b in stretches[:3])
    return shown + (f" and {len(stretches) - 3} more" if len(stretches) > 3 else "")
