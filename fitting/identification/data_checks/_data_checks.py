"""Faults of a recording that show before any fit: of its drives, and of its readings."""

from rapi_jax import DataError, Recording
from rapi_jax.internal import usable

from ._copies import find_copies
from ._fault import Fault
from ._first_period import check_start
from ._period import check_period
from .readings._levels import check_levels, find_switched
from .readings._resting import check_clipping, check_frozen, check_motion
from .readings._reversals import check_reversals


def check_usable(recording: Recording) -> None:
    """Raise `DataError` where a run holds no sample that a fit may look at."""
    for run in recording.runs:
        end, lag = float(run.drive.time[-1]), recording.response_lag_s
        if not 0.0 <= lag < end / 2:
            raise DataError(
                f"run {run.name!r}: `response_lag_s` = {lag:g} s must be short beside the run of "
                f"{end:g} s. Give the latency of the reading, in s."
            )
        if usable(run, lag).any():
            continue
        if not run.valid.any():
            raise DataError(
                f"run {run.name!r} has no valid reading. Record it again, or leave this run out."
            )
        raise DataError(
            f"run {run.name!r} holds no complete period of {run.drive.rate:g} Hz ({end:g} s "
            "recorded). Check `excitation_hz` (in Hz), or record at least one whole period."
        )


def find_faults(recording: Recording) -> list[Fault]:
    """Clipped or dead readings, dead drives and wrong periods, which show before any fit."""
    found = []
    for run in recording.runs:
        checks = (check_motion, check_levels, check_clipping, check_frozen)
        faults = [check(run) for check in checks]
        period = check_period(run)
        start = check_start(run, recording.response_unit) if period is None else None
        faults += [period, start, check_reversals(run)]
        found += [fault for fault in faults if fault is not None]
    found += find_copies(recording)
    return found or find_switched(recording)
