"""Drives of any shape that repeat, though their recording does not say so.

A drive with a rate whose waveform is "other" need not repeat. Where its record shows that it does,
and that its response does, it is taken for what it is: then its periods tell noise from error, and
what came before its first sample is known.
"""

import dataclasses

import numpy as np

from fitting.identification.data_checks._first_period import check_start
from fitting.identification.data_checks._period import check_period
from rapi_jax import Drive, Recording, Run

from ._thresholds import THRESHOLDS


def with_repetition(recording: Recording) -> Recording:
    """The recording, drives that are seen to repeat said to be periodic."""
    return dataclasses.replace(recording, runs=tuple(map(_with_repetition, recording.runs)))


def _with_repetition(run: Run) -> Run:
    drive = run.drive
    if drive.waveform != "other" or drive.excitation_hz is None:
        return run
    periodic = dataclasses.replace(drive, waveform="multisine")
    said = dataclasses.replace(run, drive=periodic)
    if not periodic.periods or not _repeats(periodic):
        return run
    return run if check_period(said) or check_start(said) else said


def _repeats(drive: Drive) -> bool:
    """Whether the drive is what it was a period before; of one period, whether it closes on itself.

    A step beyond its last sample it would then be where it began.
    """
    period, u = 1.0 / (drive.rate * drive.step_s), drive.value
    least = THRESHOLDS.repeats * drive.u_pp
    at = np.arange(u.size)
    again = at + period <= u.size - 1 + 1e-6
    if again.sum() >= period / 2.0:
        later = np.interp(at[again] + period, at, u)
        corner = float(np.abs(np.diff(u, 2)).max(initial=0.0)) if abs(period % 1.0) > 1e-6 else 0.0
        return bool(np.abs(later - u[again]).max() <= least + corner)
    if abs(u.size - period) > 1.0:
        return False
    beyond = u[-1] + (u[-1] - u[-2])
    step = max(abs(u[1] - u[0]), abs(u[-1] - u[-2]))
    return bool(abs(beyond - u[0]) <= least + step)
