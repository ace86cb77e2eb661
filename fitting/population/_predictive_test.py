r"""Whether a difference fits its predictive distribution, whose variance is estimated.

$F = \lambda\,d'V^{-1}d/l$ on $l$ and $m$ degrees of freedom, $\lambda$ and $m$ from the first two
moments of $d'V^{-1}d/l$ (Kenward and Roger 1997, section 3): for a variance known exactly that is
chi-square, for a Wishart one Hotelling's $T^2$, for a single difference Student's t.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy import stats


@dataclasses.dataclass(frozen=True)
class PredictiveTest:
    """`p_value` of `statistic` = d'V^-1 d, by F on `numerator` and `denominator` degrees.

    `wishart`: degrees of freedom of a Wishart variance that would be as uncertain.
    """

    statistic: float
    numerator: int
    denominator: float
    p_value: float
    wishart: float


def predictive_test(
    difference: Float[np.ndarray, " parameters"],
    variance: Float[np.ndarray, "parameters parameters"],
    slopes: Float[np.ndarray, "pairs parameters parameters"],
    pair_covariance: Float[np.ndarray, "pairs pairs"],
) -> PredictiveTest:
    """The test of `difference`, whose covariance `variance` has derivatives `slopes`.

    `pair_covariance`: of what the derivatives are with respect to.
    """
    inverse = np.linalg.inv(variance)
    statistic = float(difference @ inverse @ difference)
    size = difference.size
    scaled = inverse @ slopes
    traces = np.einsum("raa->r", scaled)
    both = np.einsum("rab,sba->rs", scaled, scaled, optimize=True)
    a1 = float(traces @ pair_covariance @ traces)
    a2 = float(np.sum(pair_covariance * both))
    factor, degrees = moments_of_f(a1, a2, size)
    p_value = float(stats.f.sf(factor * statistic / size, size, degrees))
    if not np.isfinite(degrees):
        p_value = float(stats.chi2.sf(statistic, size))
    return PredictiveTest(statistic, size, degrees, p_value, degrees + size - 1.0)


def moments_of_f(a1: float, a2: float, size: int) -> tuple[float, float]:
    """Factor and denominator degrees of freedom, from the two sums of Kenward and Roger."""
    if a2 <= 1e-9 * size:  # the variance is known
        return 1.0, np.inf
    hotelling = max(size * (size + 1) / a2 - size + 1.0, 1.0)
    fallback = hotelling / (hotelling + size - 1.0), hotelling
    b = (a1 + 6.0 * a2) / (2.0 * size)
    g = ((size + 1.0) * a1 - (size + 4.0) * a2) / ((size + 2.0) * a2)
    below = 3.0 * size + 2.0 * (1.0 - g)
    c1, c2, c3 = g / below, (size - g) / below, (size + 2.0 - g) / below
    if a2 >= size or c2 * b >= 1.0 or c3 * b >= 1.0 or 1.0 + c1 * b <= 0.0:
        return fallback
    mean = 1.0 / (1.0 - a2 / size)
    variance = 2.0 / size * (1.0 + c1 * b) / ((1.0 - c2 * b) ** 2 * (1.0 - c3 * b))
    ratio = variance / (2.0 * mean**2)
    if size * ratio <= 1.0:
        return 1.0 / mean, np.inf
    degrees = 4.0 + (size + 2.0) / (size * ratio - 1.0)
    return degrees / (mean * (degrees - 2.0)), degrees
