"""Scans that a session did not have: another rate, another amplitude, another waveform."""

import math
from collections.abc import Sequence

import numpy as np

from fitting.blind.simulator._scan import Scan, place_in_time, scan_from_samples

from ._thresholds import THRESHOLDS

KINDS = ("rate", "amplitude", "waveform")
SAMPLES = 400
PERIODS = 4
PAUSE_S = 2.0


def new_scans(scans: Sequence[Scan]) -> dict[str, Scan]:
    """One scan of each kind within the session's range, one after the other behind the session.

    - `rate`: a triangle of the full swing, in the widest gap between recorded rates.
    - `amplitude`: a triangle at a recorded rate, in the widest gap between recorded swings.
    - `waveform`: a triangle of the full swing that rises for 70 % of its period.
    """
    widest = max(scans, key=lambda scan: scan.swing)
    rates = sorted(
        scan.rate_hz for scan in scans if scan.swing > THRESHOLDS.full_swing * widest.swing
    )
    known = rates[len(rates) // 2]
    new_rate = math.exp(
        _widest_gap_middle([math.log(rate) for rate in _at_least_two({s.rate_hz for s in scans})])
    )
    new_swing = _widest_gap_middle(_at_least_two({round(scan.swing, 6) for scan in scans}))
    rise = round(THRESHOLDS.rising_fraction * SAMPLES)
    up, down = np.arange(rise) / rise, 1 - np.arange(SAMPLES - rise) / (SAMPLES - rise)
    skewed = widest.bias + widest.swing * (np.concatenate([up, down]) - 0.5)
    made = (
        Scan(new_rate, widest.swing, widest.bias, "triangle", PERIODS, SAMPLES),
        Scan(known, new_swing, widest.bias, "triangle", PERIODS, SAMPLES),
        scan_from_samples(skewed, known, periods=PERIODS, waveform="triangle"),
    )
    begin = scans[-1].start_s + scans[-1].duration_s + PAUSE_S
    return dict(zip(KINDS, place_in_time(made, begin, pause_s=PAUSE_S), strict=True))


def _at_least_two(values: set[float]) -> list[float]:
    """In order; a single value gets another below it."""
    return sorted(values) if len(values) > 1 else [0.6 * max(values), max(values)]


def _widest_gap_middle(values: Sequence[float]) -> float:
    """The middle of the widest gap."""
    at = int(np.argmax(np.diff(values)))
    return (values[at] + values[at + 1]) / 2
