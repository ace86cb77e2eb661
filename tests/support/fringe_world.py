"""A fringe generator of the tests' own: NumPy alone, truth known at every instant."""

import dataclasses
from collections.abc import Callable

import numpy as np
from scipy import signal, special
from scipy.interpolate import CubicSpline

Curve = Callable[[np.ndarray], np.ndarray]

DELAY = 24.5e-9  # s
FSR = 1.5  # GHz
RATE = 30e6  # samples a second


def scan(hz: float, *, slopes=(1.2, 1.9, 0.6, 1.6), lag=0.0, span=75.0) -> Curve:
    """A periodic hysteretic scan (GHz): slopes (relative) at the branches' ends."""
    x = np.linspace(0.0, 1.0, 20001)
    up = slopes[0] + (slopes[1] - slopes[0]) * x
    down = slopes[2] + (slopes[3] - slopes[2]) * (1 - np.exp(-4 * x))
    rise, fall = (
        np.concatenate([[0.0], np.cumsum((f[1:] + f[:-1]) / 2)]) / x.size for f in (up, down)
    )
    rise, fall = rise * span / rise[-1], span - fall * span / fall[-1]

    def curve(t: np.ndarray) -> np.ndarray:
        along = 2 * np.mod((t - lag) * hz, 1.0)
        return np.where(along < 1, np.interp(along, x, rise), np.interp(along - 1, x, fall))

    return curve


def lagged(curve: Curve, tau: float, hz: float, points: int = 100_000) -> Curve:
    """`curve` behind a first-order lag, in its steady state."""
    step = 1.0 / hz / points
    value = curve(np.arange(3 * points) * step)
    a = np.exp(-step / tau)
    b = [1 - tau * (1 - a) / step, tau * (1 - a) / step - a]  # exact between samples of a ramp
    start = [b[1] * value[0] + a * value[0]]
    y = signal.lfilter(b, [1, -a], value, zi=start)[0][2 * points - 5 :]
    # A monotone interpolant would move each extremum onto a sample; this one does not.
    smooth = CubicSpline(np.arange(-5, points + 6) * step, np.append(y, y[5:11]))
    return lambda t: smooth(np.mod(t, 1.0 / hz))


@dataclasses.dataclass
class Record:
    """Codes of both channels, as a 12-bit digitizer gives them."""

    interferometer: np.ndarray
    cavity: np.ndarray
    time: np.ndarray
    start: float


def record(
    curve: Curve,
    start: float,
    stop: float,
    *,
    seed: int = 0,
    rate: float = RATE,
    noise: float = 0.01,
    linewidth: float = 2e5,
    phase: float | None = None,
    place: float | None = None,
    amplitude: float = 1600.0,
    visibility: Curve | None = None,
    slip_at: float | None = None,
    finesse: float = 200.0,
) -> Record:
    """Fringes of `curve` (GHz) from `start` to `stop` (s).

    White frequency noise of `linewidth` (Hz) moves both channels; `slip_at`: from then on the
    interferometer alone is a fringe ahead.
    """
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0, 2 * np.pi) if phase is None else phase
    place = rng.uniform(0, FSR) if place is None else place
    t = start + np.arange(round((stop - start) * rate)) / rate
    nu = curve(t)
    jitter = rng.standard_normal(t.size) * np.sqrt(2 * np.pi * linewidth * DELAY)
    angle = 2 * np.pi * nu * 1e9 * DELAY + phase + jitter
    if slip_at is not None:
        angle = angle + 2 * np.pi * special.expit((t - slip_at) / 1.5e-6)
    contrast = 1.0 if visibility is None else visibility(t)
    fringes = amplitude * (contrast * np.cos(angle) + noise * rng.standard_normal(t.size)) + 30
    half = np.pi * (nu + place + jitter / (2 * np.pi * DELAY * 1e9)) / FSR
    airy = 1.0 / (1.0 + (2 * finesse / np.pi) ** 2 * np.sin(half) ** 2)
    light = 1500 * (airy + noise * rng.standard_normal(t.size)) - 1000

    def codes(x: np.ndarray) -> np.ndarray:
        return np.clip(np.round(x), -2048, 2047).astype(np.int16)

    return Record(codes(fringes), codes(light), t, start)
