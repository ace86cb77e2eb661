"""Noise as a sum of few processes, whose variances are all that is to be known."""

from ._excess import excess_probability
from ._lines import Pick, PowerBins
from ._relaxations import NoiseModel, Processes
from ._robust import EXPONENTIAL_MEDIAN, RunLines, estimate_shared_noise
from ._variance_components import estimate_noise

__all__ = [
    "EXPONENTIAL_MEDIAN",
    "NoiseModel",
    "Pick",
    "PowerBins",
    "Processes",
    "RunLines",
    "estimate_noise",
    "estimate_shared_noise",
    "excess_probability",
]
