"""Linear filters on the fine clock, exact for inputs that are straight between its points."""

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import signal

Array = npt.NDArray[np.float64]


def lag(x: Array, step: float, tau: float, before: tuple[float, float]) -> Array:
    """First-order lag `1/(tau s + 1)`; `before`: input and output one step before the first."""
    m = step / tau
    a = float(np.exp(-m))
    fresh = 1 + float(np.expm1(-m)) / m
    late = 1 - a - fresh
    y, _ = signal.lfilter([fresh, late], [1, -a], x, zi=[a * before[1] + late * before[0]])
    return np.asarray(y)


def lowpass(x: Array, step: float, tau: float) -> Array:
    """First-order lag that had settled at the first value."""
    return lag(x, step, tau, (float(x[0]), float(x[0])))


def rational_filter(x: Array, step: float, top: list[float], bottom: list[float]) -> Array:
    """`top(s)/bottom(s)`, highest power first, settled at the first value."""
    made: Any = signal.cont2discrete((top, bottom), step, method="foh")
    b, a = np.ravel(made[0]), np.ravel(made[1])
    # The settled state from the gain at rest: subtract the first value, filter, add its image.
    gain = top[-1] / bottom[-1]
    return gain * x[0] + np.asarray(signal.lfilter(b, a, x - x[0]))


def second_order(frequency: float, damping: float) -> list[float]:
    """`s^2/w^2 + 2 z s/w + 1` as coefficients, highest power first; frequency in Hz."""
    w = 2 * np.pi * frequency
    return [1 / w**2, 2 * damping / w, 1.0]


def delay_signal(x: Array, step: float, tau: Array | float) -> Array:
    """`x(t - tau)`, by straight lines; before the first point its value is held."""
    t = np.arange(len(x)) * step
    return np.interp(t - tau, t, x)


def derivative(x: Array, step: float) -> Array:
    """Time derivative by central differences."""
    return np.gradient(x, step)


def limit_slope(x: Array, step: float, limit: float) -> Array:
    """`x` followed at no more than `limit` a second."""
    most = limit * step
    if np.max(np.abs(np.diff(x))) <= most:
        return x
    followed = float(x[0])
    out = []
    for target in x.tolist():
        followed += min(max(target - followed, -most), most)
        out.append(followed)
    return np.array(out)
