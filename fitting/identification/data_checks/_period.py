"""Drives that do not have the period said of them."""

import numpy as np

from rapi_jax import Run
from rapi_jax.internal import white_noise_rms

from ._drive_character import describe_drive, describe_rate, period_mismatch, rate_error
from ._fault import Fault
from ._thresholds import THRESHOLDS


def check_period(run: Run) -> Fault | None:
    """A drive said to repeat that does not, at the rate given."""
    drive = run.drive
    if not drive.repeats or drive.u_pp == 0:
        return None
    limits = THRESHOLDS
    period, step = 1.0 / drive.rate, drive.step_s
    if period < limits.period_samples * step:
        return _wrong_period(run)
    noise = white_noise_rms(drive.value) / drive.u_pp
    count = (drive.time[-1] + step) / period
    if count >= limits.several_periods:  # third differences of a fast drive are the drive itself
        noise = min(noise, period_mismatch(drive, period))
    whole = np.unique(np.geomspace(1, max(count - 0.2, 1), 8).astype(int))
    if count >= limits.several_periods:
        worst = max(period_mismatch(drive, k * period) for k in whole)
        if worst > limits.period_miss + 2.0 * noise:
            return _wrong_period(run)
        error = rate_error(drive)
        if abs(error) > limits.rate_error:
            return _wrong_period(run, describe_rate(drive, error))
    elif drive.time[-1] > period + 2.0 * step:
        if period_mismatch(drive, period) > limits.period_miss_short + 2.0 * noise:
            return _wrong_period(run)
    elif count >= limits.whole_period:
        slope = (drive.value[-1] - drive.value[-3]) / (2.0 * step)
        end = drive.value[-1] + slope * (period - drive.time[-1])
        apart = abs(end - drive.value[0]) / drive.u_pp
        least = limits.period_end_least + limits.period_end_noise * noise
        if least < apart < limits.period_end_most:
            return _wrong_period(run)
    for parts in range(2, limits.period_divisions + 1):
        if period / parts < limits.period_samples * step or count < limits.whole_period:
            break
        if period_mismatch(drive, period / parts) < limits.shorter_period_miss + 2.0 * noise:
            return _wrong_period(run)
    return None


def _wrong_period(run: Run, why: str = "") -> Fault:
    kind, words = ("wrong period", why) if why else describe_drive(run.drive)
    return Fault(
        kind,
        run.name,
        f"run {run.name!r}: the drive does not have the period of {run.drive.rate:g} Hz; {words}",
        ((0, run.drive.size - 1),),
    )
