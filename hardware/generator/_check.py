"""Checks of one period against the limits, as a whole, before a byte of it is sent."""

import math

import numpy as np

from rapi_jax import AfgWaveform, DataError, Drive, DriveLimits, LimitError
from rapi_jax.internal import FULL, POINTS

from ._thresholds import THRESHOLDS


def check_period(volts: np.ndarray, frequency_hz: float, limits: DriveLimits) -> np.ndarray:
    """One period as float64, if it may be played; raises `LimitError` or `DataError`."""
    volts = np.array(volts, dtype=np.float64)
    if volts.ndim != 1 or not 2 <= volts.size <= POINTS:
        raise DataError(
            f"A waveform has 2 to {POINTS} values in one column, but this has shape {volts.shape}."
        )
    if not (math.isfinite(frequency_hz) and frequency_hz >= THRESHOLDS.least_frequency_hz):
        raise DataError(f"The rate must be 1 mHz or more, but is {frequency_hz} Hz.")
    # Two periods where one is too short for a drive of its own.
    played = np.tile(volts, 2) if volts.size < 4 else volts
    time = np.arange(played.size) / (frequency_hz * volts.size)
    limits.check(Drive(time, played, frequency_hz, "multisine"))
    return volts


def check_codes(wave: AfgWaveform, limits: DriveLimits) -> np.ndarray:
    """The volts of a waveform in codes, if a drive that rounds to them keeps `limits`.

    Rounding makes stairs whose edges say nothing about the slope. The steepest drive allowed that
    stays below every sample and half a code, round the period, must not fall below any sample by
    more than half a code.
    """
    volts, half = wave.volts, (wave.high_v - wave.low_v) / FULL / 2
    no_slope = DriveLimits(limits.low_v, limits.high_v, math.inf, math.inf, limits.max_frequency_hz)
    check_period(volts, wave.frequency_hz, no_slope)
    rise = min(limits.step_v, limits.slew_v_per_s / (wave.frequency_hz * volts.size))  # a sample
    ramp = rise * np.arange(3 * volts.size)
    above = np.tile(volts + half, 3)
    ahead = np.minimum.accumulate(above - ramp) + ramp
    behind = (np.minimum.accumulate(above[::-1] - ramp) + ramp)[::-1]
    allowed = np.minimum(ahead, behind)[volts.size : 2 * volts.size]
    beyond = (volts - half) - allowed
    if beyond.max() > THRESHOLDS.slope_rounding * (limits.high_v - limits.low_v):
        at = int(np.argmax(beyond))
        raise LimitError(
            f"Around sample {at} the waveform changes by more than {rise:.4g} V a sample, the most "
            "that `step_v` and `slew_v_per_s` allow at this rate. Scan more slowly, or over a "
            "smaller range."
        )
    return volts
