"""How a distance answers to the target's motion, to noise of the phase, and to a crooked scan."""

import numpy as np

from rapi_jax._metrics import SPEED_OF_LIGHT as C

from ._conditions import Conditions


def motion_weights(conditions: Conditions) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) and weights of the distance at each, of a single estimate; they add up to 1.

    A line through the phase over optical frequency weighs every time; counting the two ends alone.
    """
    t, nu = conditions.region()
    centre = conditions.centre_hz
    if conditions.counts:
        ends = [0, -1]
        g = (centre + nu[ends]) * np.array([-1.0, 1.0]) / (nu[-1] - nu[0])
        return t[ends], g
    weight = np.abs(np.gradient(nu, t)) * _window(conditions)
    x = nu - (weight @ nu) / weight.sum()
    return t, weight * x * (centre + nu) / (weight @ (x * nu))


def _window(conditions: Conditions) -> np.ndarray:
    """Over optical frequency: Hann's for the peak of a spectrum, else even."""
    if conditions.method != "resample-fft":
        return np.ones(conditions.region()[1].size)
    _, nu = conditions.region()
    place = (nu - nu[0]) / (nu[-1] - nu[0])
    return 0.5 - 0.5 * np.cos(2 * np.pi * np.clip(place, 0.0, 1.0))


def vibration_response(conditions: Conditions, hz: np.ndarray) -> np.ndarray:
    """|H|: metres of distance for a metre of vibration at each frequency."""
    t, g = motion_weights(conditions)
    t = t - t.mean()
    return np.abs(np.exp(2j * np.pi * hz[:, None] * t[None, :]) @ g)


def phase_noise_gain(conditions: Conditions) -> float:
    """Metres for one radian of white phase noise, independent in every sample."""
    if conditions.counts:
        return _counted_noise_gain(conditions)
    t, nu = conditions.region()
    weight = np.abs(np.gradient(nu, t)) * _window(conditions)
    x = nu - (weight @ nu) / weight.sum()
    slope = np.sqrt(np.sum((weight * x) ** 2)) / np.sum(weight * x**2)  # rad/Hz a rad
    # As many samples as the digitizer gives, not as the scan is described by.
    described = (t.size - 1) / (t[-1] - t[0])
    return slope * np.sqrt(described / conditions.sample_hz) * C / (4 * np.pi)


def _counted_noise_gain(conditions: Conditions) -> float:
    """The same for two ends between extrema, each found where a filtered derivative is zero.

    Noise of the extrema is that of the derivative in the filter's band, which is 1.6 times wider
    than the fringes' rates on either side; neighbours share a part of it.
    """
    t, nu = conditions.region()
    rate = conditions.delay_s * np.abs(np.gradient(nu, t))
    low, high = rate.min() / 1.6, rate.max() * 1.6
    f = np.linspace(low, high, 2001)
    ends = []
    for own in (rate[0], rate[-1]):
        power = np.trapezoid(f**2, f) * 2.0 / conditions.sample_hz / (own**2 * 2.0)
        shared = -np.trapezoid(f**2 * np.cos(np.pi * f / own), f) / np.trapezoid(f**2, f)
        # White phase noise s is noise of s A / sqrt(2) beside the fringe; a place between extrema
        # takes u of one and 1 - u of the other.
        ends.append(power * (2.0 / 3.0 + shared / 3.0))
    return float(np.sqrt(np.sum(ends)) / (2 * np.pi) / conditions.span_hz * C / 2)


def interpolation_spread(conditions: Conditions, *, draws: int = 400, seed: int = 0) -> float:
    """Standard deviation of counting by what a crooked scan makes of fractions (Eq. 4), m.

    Over combs and fringes that lie anywhere: their places are drawn.
    """
    t = np.linspace(conditions.time[0], conditions.time[-1], 20_001)
    nu = np.interp(t, conditions.time, conditions.nu)
    sign = 1.0 if nu[-1] > nu[0] else -1.0
    nu = sign * (nu - nu[0])
    # Beyond what is given, so that there are peaks and extrema beside the ends.
    step, slopes = t[1] - t[0], (nu[1] - nu[0], nu[-1] - nu[-2])
    extra = int(0.06 * t.size)
    k = np.arange(1, extra + 1)
    nu = np.concatenate([-slopes[0] * k[::-1], nu, nu[-1] + slopes[1] * k])
    t = np.concatenate([t[0] - step * k[::-1], t, t[-1] + step * k])
    ends_t = conditions.region()[0][[0, -1]]
    rng = np.random.default_rng(seed)
    found = np.empty(draws)
    for draw in range(draws):
        comb, fringe = rng.uniform(size=2)
        peaks = _crossings(nu, t, conditions.spacing_hz, comb)
        ends = ends_t
        if conditions.method == "counting":
            inside = peaks[(peaks >= ends_t[0]) & (peaks <= ends_t[1])]
            ends = inside[[0, -1]]
        extrema = _crossings(nu, t, 0.5 / conditions.delay_s, fringe)
        orders = np.interp(ends, peaks, np.arange(peaks.size))
        halves = np.interp(ends, extrema, np.arange(extrema.size))
        span = (orders[1] - orders[0]) * conditions.spacing_hz
        found[draw] = (halves[1] - halves[0]) / 2 / span * C / 2
    return float(np.std(found))


def _crossings(nu: np.ndarray, t: np.ndarray, spacing: float, offset: float) -> np.ndarray:
    """Times at which a growing `nu` passes each multiple of `spacing`, moved by `offset` of it."""
    first = np.ceil(nu[0] / spacing - offset) + offset
    return np.interp(np.arange(first, nu[-1] / spacing) * spacing, nu, t)
