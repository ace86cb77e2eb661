r"""Robust fit of white and red noise to the power of spectral lines, through medians of groups.

The four numbers are `q`, the logarithms of white part, red part and corner, and the exponent:
$S(f) = e^{q_0} + k e^{q_1} / (1 + (f / e^{q_2})^{q_3})$, with `k` the density of a run's samples.
"""

from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import least_squares

from ._thresholds import THRESHOLDS

EXPONENTIAL_MEDIAN = np.log(2.0)  # of an exponential variable with mean 1
_FIXED_EXPONENT, _START_EXPONENT = 2.0, 1.2
_TINY = 1e-300


def fit_spectrum(
    hertz: Float[np.ndarray, " lines"],
    power: Float[np.ndarray, " lines"],
    density: Float[np.ndarray, " lines"],
    groups: list[Int[np.ndarray, " _"]],
) -> tuple[float, float, float, float]:
    """White part, red part, corner and exponent, from medians of groups of lines.

    The lines of a group differ in what is expected of them: by frequency, and by the sampling of
    their runs (`density`: usual sampling interval over that of the run). So after a first pass the
    median is that of power over what the pass before expects.
    """
    x = np.array([np.exp(np.mean(np.log(hertz[g]))) for g in groups])
    share = np.array([np.mean(density[g]) for g in groups])
    weight = np.sqrt([min(g.size, THRESHOLDS.most_bin_weight) for g in groups])
    expected = np.ones_like(power)
    q, before = np.zeros(4), []
    for number in range(THRESHOLDS.median_passes):
        level = np.array([np.median(power[g] / expected[g]) for g in groups]) / EXPONENTIAL_MEDIAN
        if number:
            level *= evaluate_law(q, x, share)
        q, before = _fit_medians(x, np.log(np.maximum(level, _TINY)), weight, share, before)
        expected = evaluate_law(q, hertz, density)
    scale = float(np.median(power / expected)) / EXPONENTIAL_MEDIAN  # of all lines
    white, red, corner = np.exp(q[:3])
    return float(scale * white), float(scale * red), float(corner), float(q[3])


def evaluate_law(
    q: Float[np.ndarray, " 4"],
    hertz: Float[np.ndarray, " frequencies"],
    density: Float[np.ndarray, " frequencies"],
) -> Float[np.ndarray, " frequencies"]:
    """The expected power."""
    return np.exp(q[0]) + density * np.exp(q[1]) / (1.0 + (hertz / np.exp(q[2])) ** q[3])


def log_jacobian(
    q: Float[np.ndarray, " 4"],
    hertz: Float[np.ndarray, " frequencies"],
    density: Float[np.ndarray, " frequencies"],
) -> Float[np.ndarray, "frequencies 4"]:
    """Derivatives of the logarithm of the expected power by the four numbers."""
    ratio = np.log(hertz) - q[2]
    above = 1.0 / (1.0 + np.exp(-q[3] * ratio))  # of the red part, what its corner takes away
    red = density * np.exp(q[1]) * (1.0 - above)
    by = np.stack(
        [np.full(hertz.size, np.exp(q[0])), red, red * above * q[3], -red * above * ratio]
    )
    return (by / evaluate_law(q, hertz, density)).T


def _fit_medians(
    x: np.ndarray,
    y: np.ndarray,
    weight: np.ndarray,
    share: np.ndarray,
    before: list[np.ndarray],
) -> tuple[np.ndarray, list[np.ndarray]]:
    """The four numbers through medians `y` (logarithms) at frequencies `x`.

    An exponent other than 2 is taken where it fits the medians better by more than chance. Also
    both fits, with exponent 2 and another: the next pass starts from those of the one `before`.
    """
    top, bottom = float(np.exp(y.max())), float(np.exp(y[-4:].mean()))
    lowest_corner = np.log(x[0] / THRESHOLDS.corner_below)
    low = np.array(
        [np.log(bottom) - 12.0, np.log(bottom) - 14.0, lowest_corner, THRESHOLDS.least_exponent]
    )
    high = np.array([np.log(top) + 2.0, np.log(top) + 3.0, np.log(x[-1]) + 3.0, _FIXED_EXPONENT])
    size = np.log(max(top - bottom, 0.05 * bottom))
    corners = np.log(np.geomspace(max(x[0], 1e-3), x[-1], 4))

    def best_fit(free: int) -> tuple[float, np.ndarray]:
        """The best fit with the first `free` of the four numbers moved."""
        fits = []
        exponent = _FIXED_EXPONENT if free == 3 else _START_EXPONENT
        starts = [np.array([np.log(bottom), size, corner, exponent]) for corner in corners]
        for start in [before[free - 3]] if before else starts:
            rest = start[free:]

            def errors(q: np.ndarray, rest: np.ndarray = rest) -> np.ndarray:
                return weight * (np.log(evaluate_law(np.concatenate([q, rest]), x, share)) - y)

            def jacobian(q: np.ndarray, rest: np.ndarray = rest) -> np.ndarray:
                all_columns = log_jacobian(np.concatenate([q, rest]), x, share)
                return weight[:, None] * all_columns[:, :free]

            given: Any = jacobian  # typed as a string upstream
            fit = least_squares(
                errors,
                np.clip(start, low + 1e-6, high - 1e-6)[:free],
                given,
                bounds=(low[:free], high[:free]),
                loss="soft_l1",
                f_scale=THRESHOLDS.robust_scale,
                xtol=1e-9,
                ftol=1e-9,
                gtol=1e-9,
            )
            fits.append((float(fit.cost), np.concatenate([fit.x, start[free:]])))
        return min(fits, key=lambda pair: pair[0])

    (one, relaxation), (many, flicker) = best_fit(3), best_fit(4)
    chosen = flicker if one - many > THRESHOLDS.exponent_gain else relaxation
    return chosen, [relaxation, flicker]
