"""Noise as a sum of few processes, whose variances are all that is to be known."""

from ._excess import excess_probability
from ._lines import Pick, PowerBins
from ._relaxations import NoiseModel, Processes
from ._variance_components import estimate_noise

__all__ = ["NoiseModel", "Pick", "PowerBins", "Processes", "estimate_noise", "excess_probability"]
