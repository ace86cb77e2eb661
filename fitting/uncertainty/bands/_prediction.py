"""`prediction_band`: how far the response to a drive may be from the one predicted."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.identification._result import FitResult
from rapi_jax import Drive
from rapi_jax.internal import float64, takes

from ._draws import ModelDraws
from ._responses import Method, check_level, draws_of, responses


@dataclasses.dataclass(frozen=True, eq=False)
class PredictionBand:
    """Where the model's response lies, in the response's unit; noise of readings comes on top.

    - `predicted`: of the fitted model. `low`, `high`: hold the response at each sample alone with
      probability `level`. `all_low`, `all_high`: hold it at all samples at once.
    - `stderr`: standard deviation over the draws. `method`: what was drawn from.

    >>> from fitting import fit, prediction_band
    >>> from rapi_jax import triangle
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> (drive,) = triangle(25.0, amplitude=4.5, bias=3.0, samples=200)
    >>> band = prediction_band(result, drive, draws=50)
    >>> band.level, band.method, bool(band.stderr.max() < 0.1)  # GHz
    (0.95, 'laplace', True)
    """

    drive: Drive
    predicted: Float[np.ndarray, " time"]
    low: Float[np.ndarray, " time"]
    high: Float[np.ndarray, " time"]
    all_low: Float[np.ndarray, " time"]
    all_high: Float[np.ndarray, " time"]
    stderr: Float[np.ndarray, " time"]
    level: float
    method: str

    def holds(self, response: Float[np.ndarray, " time"]) -> bool:
        """Whether `response` lies within the simultaneous band at all samples."""
        return bool(((self.all_low <= response) & (response <= self.all_high)).all())


@takes(source=FitResult | ModelDraws, drive=Drive)
@float64
def prediction_band(
    source: FitResult | ModelDraws,
    drive: Drive,
    *,
    method: Method = "laplace",
    posterior: Any = None,
    level: float = 0.95,
    draws: int = 1000,
    seed: int = 0,
) -> PredictionBand:
    """The band of the response to `drive` that the uncertainty of parameters leaves.

    **Arguments:**

    - `source`: a fit, or draws made before. `drive`: of one that repeats the steady response.
    - `method`: "laplace", normal about the fit with its covariance; or "posterior", sampled.
      `posterior`: of `sample_posterior`; made where it is not given.
    - `draws`: how many models. `seed`: of all randomness.

    The simultaneous band is wider by one factor everywhere: the quantile of the largest deviation
    in units of the standard deviation (sup-t; J. L. Montiel Olea and M. Plagborg-Moller, Journal of
    Applied Econometrics 34, 1, 2019). Raises what `laplace_draws` or `sample_posterior` raises.

    >>> from fitting import fit, prediction_band
    >>> from rapi_jax import triangle
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> (drive,) = triangle(25.0, amplitude=4.5, bias=3.0, samples=200)  # not recorded
    >>> band = prediction_band(result, drive, draws=50)
    >>> bool((band.low <= band.predicted).all() and (band.predicted <= band.high).all())
    True
    """
    check_level(level)
    models = draws_of(source, method, posterior, draws, seed)
    found, predicted = responses(models, drive)
    middle = predicted if models.method == "laplace" else found.mean(axis=0)
    stderr = np.sqrt(np.mean((found - middle) ** 2, axis=0))
    unit = np.where(stderr > 0, stderr, np.inf)
    largest = np.abs((found - middle) / unit).max(axis=1)
    reach = np.quantile(largest, level) * stderr
    low, high = np.quantile(found, [(1.0 - level) / 2.0, (1.0 + level) / 2.0], axis=0)
    return PredictionBand(
        drive, predicted, low, high, middle - reach, middle + reach, stderr, level, models.method
    )
