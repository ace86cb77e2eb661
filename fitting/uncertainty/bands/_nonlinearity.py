"""`nonlinearity_band`: how far off a straight line a compensated scan may be."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.identification._result import FitResult
from rapi_jax import Compensation, Drive, Linearity, ModelError, Run, linearity
from rapi_jax.internal import float64, takes

from ._draws import ModelDraws
from ._responses import Method, check_level, draws_of, interval, responses


@dataclasses.dataclass(frozen=True, eq=False)
class NonlinearityBand:
    """The rms nonlinearity of a scan, in the response's unit (GHz), up and down.

    - `model`: of the fitted model, up and down. `up`, `down`: of each draw. `level`: of intervals.
    - `method`: what was drawn from. `misfit`: rms of the model's own error, a share of which is in
      the upper ends of the intervals.

    >>> from fitting import fit, nonlinearity_band
    >>> from rapi_jax import triangle
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> (drive,) = triangle(20.0, amplitude=4.5, bias=3.0, samples=200)
    >>> band = nonlinearity_band(result, drive, draws=50)
    >>> band.level, band.method
    (0.95, 'laplace')
    """

    model: tuple[float, float]
    up: Float[np.ndarray, " draws"]
    down: Float[np.ndarray, " draws"]
    level: float
    method: str
    misfit: float = 0.0

    @property
    def up_interval(self) -> tuple[float, float]:
        """The central interval of the up-scan's, GHz."""
        return self._ends(self.up)

    @property
    def down_interval(self) -> tuple[float, float]:
        """The central interval of the down-scan's, GHz."""
        return self._ends(self.down)

    def _ends(self, rms: Float[np.ndarray, " draws"]) -> tuple[float, float]:
        """From none of the misfit to the upper end with a share of it."""
        return interval(rms, self.level)[0], interval(self._with_misfit(rms), self.level)[1]

    def _with_misfit(self, rms: Float[np.ndarray, " draws"]) -> Float[np.ndarray, " draws"]:
        """With a share of the misfit, uniform between 0 and 1."""
        shares = (np.arange(rms.size) + 0.5) / rms.size
        return np.hypot(rms, self.misfit * np.random.default_rng(0).permutation(shares))

    def to_dict(self) -> dict[str, Any]:
        """As in `certificate.json`."""
        ends = {"up": self.up_interval, "down": self.down_interval}
        spread = {"up": self.up, "down": self.down}
        return {
            name: {
                "median": float(np.median(self._with_misfit(spread[name]))),
                "low": low,
                "high": high,
            }
            for name, (low, high) in ends.items()
        } | {
            "level": self.level,
            "method": self.method,
            "draws": int(self.up.size),
            "misfit": self.misfit,
        }


@takes(source=FitResult | ModelDraws, scan=Compensation | Drive)
@float64
def nonlinearity_band(
    source: FitResult | ModelDraws,
    scan: Compensation | Drive,
    *,
    method: Method = "laplace",
    posterior: Any = None,
    level: float = 0.95,
    draws: int = 1000,
    seed: int = 0,
    misfit: float = 0.0,
) -> NonlinearityBand:
    """The rms nonlinearity under the drive of `scan`, made from the fitted model.

    The device has the parameters of a draw, and the drive stays what it is: so the straight scan of
    the model is bent by the difference of both. What no parameters of the model describe comes on
    top by `misfit` alone, and noise of readings is in none of it. The region of interest is that of
    the fitted model's scan.

    `source`, `method`, `posterior`, `draws`, `seed`: as for `prediction_band`. `misfit`: rms by
    which a model of this structure misses runs that it was not fitted to, beyond noise, GHz; by
    default 0, for a device that the model describes exactly. Each branch is judged about a line of
    its own, which may absorb any part of this error. The upper end includes a share of it, uniform
    between 0 and 1; the lower end none.

    Raises `ModelError` for a drive with fewer samples than a scan is judged by, `ValueError` for a
    `misfit` below 0 or not finite, and what `prediction_band` raises.

    >>> from fitting import fit, nonlinearity_band
    >>> from rapi_jax import triangle
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> (drive,) = triangle(20.0, amplitude=4.5, bias=3.0, samples=200)
    >>> band = nonlinearity_band(result, drive, draws=50)
    >>> [round(float(rms), 1) for rms in band.model]  # GHz, up and down
    [0.4, 3.2]
    """
    check_level(level)
    if not 0.0 <= misfit < np.inf:
        raise ValueError(f"Argument `misfit` must be 0 or more and finite, but is {misfit}.")
    drive = scan.drive if isinstance(scan, Compensation) else scan
    models = draws_of(source, method, posterior, draws, seed)
    found, predicted = responses(models, drive)
    own = branches(drive, predicted)
    rms = np.array([branches(drive, one, own.turning).rms_ghz for one in found])
    return NonlinearityBand(own.rms_ghz, rms[:, 0], rms[:, 1], level, models.method, misfit)


def branches(
    drive: Drive, response: np.ndarray, turning: tuple[float, float] | None = None
) -> Linearity:
    """Both branches of a response; `ModelError` where it is no number."""
    if not np.isfinite(response).all():
        raise ModelError(
            "a draw of the model has no response to this drive. Take draws that keep to the bounds "
            "of the parameters."
        )
    return linearity(Run(drive, response), turning=turning)
