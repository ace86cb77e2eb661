"""The start of a run at the turn of its fitted waveform, which readings of few bits hide."""

import dataclasses

from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.recording._run import Run

from ._waveform_fit import FittedWaveform


def start_at_turn(run: Run, found: FittedWaveform) -> Run:
    """The run without the few samples before the first turn of its waveform.

    The top of a triangle in steps of a converter is flat, and a run that was cut there may begin in
    the run before. A run that does not begin just before a turn, or would lose a period, stays.
    """
    phase = found.phase % 1.0
    turn = found.rise if phase <= found.rise else 1.0
    ahead = turn - phase
    first = round(ahead / (found.rate * run.drive.step_s))
    if not 0 < first or ahead > THRESHOLDS.shared_samples or run.drive.size - first < 3:
        return run
    drive = run.drive
    later = dataclasses.replace(
        drive,
        time=drive.time[first:] - drive.time[first],
        value=drive.value[first:],
        start_s=drive.start_s + float(drive.time[first]),
    )
    if later.periods < drive.periods:
        return run
    return dataclasses.replace(run, drive=later, response=run.response[first:])
