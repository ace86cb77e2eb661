"""Whether more is left at the harmonics of a scan than the noise between them explains."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ._lines import PowerBins
from ._relaxations import NoiseModel
from ._thresholds import THRESHOLDS
from ._variance_components import collect


def excess_probability(
    noise: NoiseModel,
    residuals: Sequence[Float[np.ndarray, " _"]],
    columns: Sequence[Float[np.ndarray, "_ columns"]],
    weights: Sequence[float],
    harmonics: Sequence[PowerBins],
    between: Sequence[PowerBins],
) -> float:
    """The probability that `noise`, as seen between harmonics, leaves as much power at them.

    By Fisher's F over all harmonics and over the first of them, where models miss most; the smaller
    of both counts twice (Bonferroni). 1 where no run shows both.
    """
    from scipy.special import fdtrc

    found = [collect(residuals, columns, weights, bins, noise) for bins in (harmonics, between)]
    at, beside = [
        one.pick(np.isin(one.run, other.run)) for one, other in zip(found, found[::-1], strict=True)
    ]
    ratio = at.power / np.maximum(at.expected[0], 1e-300)
    probabilities = []
    for first in (np.inf, THRESHOLDS.first_harmonics):
        low, near = at.harmonic < first, beside.harmonic < first
        if low.any() and near.any():
            count, other = float(at.freedom[low].sum()), float(beside.freedom[near].sum())
            square = float(ratio[low] @ at.freedom[low]) / count
            probabilities.append(float(fdtrc(count, other, square)))
    return min(1.0, len(probabilities) * min(probabilities)) if probabilities else 1.0
