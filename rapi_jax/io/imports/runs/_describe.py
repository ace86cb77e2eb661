"""What became of a record, in sentences: its runs, and the samples that are in none."""

import numpy as np
from jaxtyping import Float

from rapi_jax.recording._drive import Drive

from ._piece import Piece

_RESTS = 1e-3  # of the drive's range: rounding of a converter


def describe_run(drive: Drive, name: str, first: int, unit: str) -> str:
    """What a run is, in a sentence.

    `first`: its first sample in the record; `unit`: of its drive.
    """
    where = f"samples {first}-{first + drive.size - 1}"
    if not drive.repeats:
        return f"{name}: {where}, {drive.size * drive.step_s:.4g} s, not periodic"
    inside = np.flatnonzero(drive.period >= 0)
    ends = (int(inside[0]), drive.size - 1 - int(inside[-1])) if inside.size else (0, 0)
    a_period = drive.step_s * drive.rate
    parts = [
        f"{n * a_period:.2g} of one {where}" if n * a_period < 0.995 else f"nearly one {where}"
        for n, where in zip(ends, ("before them", "after them"), strict=True)
        if n * a_period >= 0.01
    ]
    incomplete = " and ".join(parts)
    broken = f"; incomplete periods are kept, but not fitted: {incomplete}" if parts else ""
    return (
        f"{name}: {where}, {drive.periods} period(s) of a {drive.waveform} at "
        f"{drive.rate:.6g} Hz, swing {drive.u_pp:.4g} {unit}{broken}"
    )


def describe_dropped(
    pieces: list[Piece], drive: Float[np.ndarray, " samples"], step_s: float
) -> list[str]:
    """The samples that are in no run, in a sentence; empty where there are none."""
    size = drive.size
    edges = [(-1, -1), *((p.first, p.last) for p in pieces), (size, size)]
    lost = [
        (before[1] + 1, after[0] - 1)
        for before, after in zip(edges[:-1], edges[1:], strict=True)
        if after[0] - before[1] > 1
    ]
    if not lost:
        return []
    shown = ", ".join(f"{a}-{b}" for a, b in lost[:4])
    more = f" and {len(lost) - 4} more" if len(lost) > 4 else ""
    samples = sum(b - a + 1 for a, b in lost)
    least = _RESTS * float(np.ptp(drive))
    rests = all(np.ptp(drive[a : b + 1]) <= least for a, b in lost)
    why = "in which the drive rests" if rests else "that belong to no whole period of one rate"
    return [f"dropped {samples} samples ({samples * step_s:.4g} s) {why}: {shown}{more}"]
