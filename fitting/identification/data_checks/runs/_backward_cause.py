"""Why responses come before their drives: columns swapped, a sign, or samples in reverse order."""

import numpy as np

from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Recording, Run
from rapi_jax.internal import waveform_miss


def describe_backward(recording: Recording, explained: float) -> tuple[str, str]:
    """The kind of fault and its text, of a recording whose hysteresis runs the wrong way round.

    A loop is passed the other way where drive and response are exchanged, where one of them has the
    other sign, and where time is reversed. A commanded waveform is nearer to a triangle or a sine
    than a response is, and tells the columns; the sign of the slope tells the sign. `explained`: by
    the model that fits the samples read backwards, of the squares that are left.
    """
    head = (
        f"run {recording.runs[0].name!r}, as all runs: the response comes before the drive that "
        "causes it"
    )
    beside = f"(read backwards, a model explains {100 * explained:.0f} % of what is left)"
    if all(_falls(run) for run in recording.runs):
        return "reversed time", (
            f"{head} {beside}, and falls as the drive rises. Most likely the response has the "
            "wrong sign: import it again with `--response-scale -1`. If it is right that it falls, "
            "the order of the samples is reversed: turn it round."
        )
    drive, response = (
        float(np.mean([waveform_miss(run, value) for run, value in columns]))
        for columns in (
            [(run, run.drive.value) for run in recording.runs],
            [(run, run.response) for run in recording.runs],
        )
    )
    shown = (
        f"the response departs from a triangle or a sine by {100 * response:.2g} % of its span, "
        f"the drive by {100 * drive:.2g} %"
    )
    if drive > THRESHOLDS.commanded_ratio * response:
        return "columns swapped", (
            f"{head} {beside}, and {shown}. Most likely the columns `drive` and `response` are "
            "swapped: exchange them. If the drive was made to straighten the response, the order "
            "of the samples is reversed instead: turn it round."
        )
    if response > THRESHOLDS.commanded_ratio * drive:
        return "reversed time", (
            f"{head}. Read backwards the samples fit a model, which explains {100 * explained:.0f} "
            "% of what is left: their order is reversed. Turn it round."
        )
    return "reversed time", (
        f"{head} {beside}. Either the order of the samples is reversed, or the columns `drive` and "
        f"`response` are swapped: {shown}, which does not tell. Look which column holds the "
        "waveform that was sent."
    )


def _falls(run: Run) -> bool:
    """Whether the response falls as the drive rises."""
    u, y = run.drive.value[run.valid], run.response[run.valid]
    return float((u - u.mean()) @ (y - y.mean())) < 0.0
