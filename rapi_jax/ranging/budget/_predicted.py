"""`predicted_budget`: each source alone, from the scan and the disturbances."""

import numpy as np

from ._conditions import Budget, BudgetLine, Conditions
from ._sensitivity import (
    interpolation_spread,
    motion_weights,
    phase_noise_gain,
    vibration_response,
)


def predicted_budget(conditions: Conditions) -> Budget:
    """The standard error of one scan's distance by each source alone, m.

    Sources add in squares. `motion` is an offset, of opposite sign on up- and down-scans: a filter
    over both takes it out, and then the error of the velocity is what counts here.
    """
    lines = (
        _nonlinearity(conditions),
        _cavity(conditions),
        _motion(conditions),
        _vibration(conditions),
        _linewidth(conditions),
        _white(conditions, "detector", conditions.noise_v),
        _white(conditions, "digitizer", conditions.step_v / np.sqrt(12.0)),
        BudgetLine("air", conditions.distance_m * conditions.index_stderr),
    )
    return Budget(lines)


def _nonlinearity(conditions: Conditions) -> BudgetLine:
    if not conditions.counts:
        note = "resampled: a crooked scan acts only through motion"
        return BudgetLine("nonlinearity", 0.0, note)
    return BudgetLine("nonlinearity", interpolation_spread(conditions), "fractions of Eq. (4)")


def _cavity(conditions: Conditions) -> BudgetLine:
    ends = np.sqrt(2.0) * conditions.comb_hz * conditions.distance_m / conditions.span_hz
    if conditions.counts:
        return BudgetLine("cavity", ends)
    # One scale for all scans: the mean of their slopes, which all share.
    return BudgetLine("cavity", ends / np.sqrt(conditions.scans), "shared by all scans")


def _motion(conditions: Conditions) -> BudgetLine:
    t, g = motion_weights(conditions)
    gain = float(g @ (t - (t[0] + t[-1]) / 2))
    return BudgetLine("motion", abs(gain * conditions.velocity_m_per_s), f"{abs(gain):.1f} s")


def _vibration(conditions: Conditions) -> BudgetLine:
    vibration = conditions.vibration
    if vibration is None or vibration.rms_m == 0:
        return BudgetLine("vibration", 0.0)
    hz = np.linspace(vibration.low_hz, vibration.high_hz, 801)
    power = np.trapezoid(vibration_response(conditions, hz) ** 2, hz)
    return BudgetLine("vibration", vibration.rms_m * float(np.sqrt(power / np.ptp(hz))))


def _linewidth(conditions: Conditions) -> BudgetLine:
    """White frequency noise over both delays, and in the cavity.

    What both interferometers see of it goes out with the scan. Samples are farther apart than the
    delays, so each has its own; and noise n that is faster than the fringes acts on a phase as
    `n (1 - cos 2 phase)`, of which the second part, half the power, is each signal's own.
    """
    width, own, other = conditions.linewidth_hz, conditions.delay_s, conditions.interferometer_s
    if conditions.counts:
        phase = np.sqrt(2 * np.pi * width * own) * phase_noise_gain(conditions)
        ends = np.sqrt(2.0) * _peak_error(conditions) * conditions.distance_m / conditions.span_hz
        return BudgetLine("linewidth", float(np.hypot(phase, ends)))
    ratio = own / other
    part = own * (abs(1.0 - ratio) + (1.0 + ratio) / 2.0)
    return BudgetLine(
        "linewidth", float(np.sqrt(2 * np.pi * width * part)) * phase_noise_gain(conditions)
    )


def _peak_error(conditions: Conditions) -> float:
    """Frequency noise over a cavity's peak, rms, Hz; as if sampled with windows of the delay."""
    t, nu = conditions.region()
    rate = np.abs(np.gradient(nu, t))
    s = np.linspace(-1.7, 1.7, 401)  # half widths: what is above a quarter of the height
    slope = (2 * s / (1 + s**2) ** 2) ** 2
    used = np.trapezoid(slope, s) ** 2 / np.trapezoid(slope**2, s)
    lasts = used * conditions.spacing_hz / conditions.finesse / 2 / np.mean(rate[[0, -1]])
    white = conditions.linewidth_hz / (2 * np.pi * lasts)
    rare = max(1.0, 1.0 / (conditions.interferometer_s * conditions.sample_hz))
    return float(np.sqrt(white * rare))


def _white(conditions: Conditions, source: str, noise_v: float) -> BudgetLine:
    """Noise of both fringe signals: the interferometer's enters by the ratio of the delays."""
    own, other = (np.sqrt(2.0) * noise_v / a for a in conditions.amplitude_v)
    ratio = 0.0 if conditions.counts else conditions.delay_s / conditions.interferometer_s
    phase = float(np.hypot(own, ratio * other))
    return BudgetLine(source, phase * phase_noise_gain(conditions))
