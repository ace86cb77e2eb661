"""The estimators by name."""

from typing import Literal

from rapi_jax._errors import DataError

from ._counting import Counting
from ._estimates import AbstractEstimator
from ._resample_fft import ResampleFFT
from ._resample_phase import ResamplePhase

Method = Literal["counting", "counting-region", "resample-fft", "resample-phase"]
ESTIMATORS: dict[str, AbstractEstimator] = {
    one.name: one for one in (Counting(), Counting("region"), ResampleFFT(), ResamplePhase())
}
BEST: Method = "resample-phase"


def estimator(method: str) -> AbstractEstimator:
    """The estimator of that name. Raises `DataError` for another."""
    if method not in ESTIMATORS:
        raise DataError(f"`method` must be one of {', '.join(ESTIMATORS)}, not {method!r}.")
    return ESTIMATORS[method]
