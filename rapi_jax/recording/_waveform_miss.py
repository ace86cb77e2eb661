"""How near a column is to a commanded waveform, and columns that are likely swapped."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from rapi_jax.recording._run import Run


def waveform_miss(run: Run, value: Float[np.ndarray, " samples"]) -> float:
    """Rms distance of a column from the nearest triangle or sine of the run's rate, over its span.

    0 of a column that rests, or a run without a rate.
    """
    inside = np.isfinite(value) & (run.drive.period >= 0)
    y = value[inside]
    if not inside.any() or not np.ptp(y) > 0:
        return 0.0
    cycles = run.drive.time[inside] * run.drive.rate
    phase = 2.0 * np.pi * cycles
    columns = np.stack([np.ones(y.size), np.cos(phase), np.sin(phase)], axis=1)
    _, even, odd = np.linalg.lstsq(columns, y, rcond=None)[0]
    angle = np.arctan2(-odd, even)
    y = y - y.mean()
    turned = cycles + angle / (2.0 * np.pi)  # both shapes have their maximum where this is whole
    shapes = np.cos(2.0 * np.pi * turned), 4.0 * np.abs(np.mod(turned, 1.0) - 0.5) - 1.0
    misses = []
    for shape in shapes:
        shape = shape - shape.mean()
        left = y - float(shape @ y) / max(float(shape @ shape), 1e-300) * shape
        misses.append(float(np.sqrt(np.mean(left**2))))
    return min(misses) / float(np.ptp(y))


def describe_swap(runs: Sequence[Run], ratio: float, least: float) -> str | None:
    """What to say where responses are commanded waveforms and drives are not; else `None`.

    `ratio`: by what factor the responses have to be nearer to one; `least`: how near, as a share of
    the span. A drive that was made to straighten its response looks the same.
    """
    known = [run for run in runs if run.drive.repeats and run.drive.periods]
    if not known or len(known) < len(runs):
        return None
    drive = float(np.mean([waveform_miss(run, run.drive.value) for run in known]))
    response = float(np.mean([waveform_miss(run, run.response) for run in known]))
    if not (response < least and drive > ratio * response):
        return None
    return (
        f"the response departs from a triangle or a sine by only {100 * response:.2g} % of its "
        f"span, the drive by {100 * drive:.2g} %. Most likely the columns `drive` and `response` "
        "are swapped: exchange them. Only of a drive that was made to straighten the response are "
        "they right"
    )
