"""`distance_band`: what the uncertainty of a compensated scan does to a distance."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.identification._result import FitResult
from fitting.uncertainty._thresholds import THRESHOLDS
from rapi_jax import Compensation, Drive
from rapi_jax.internal import Branch, float64, takes
from rapi_jax.ranging.budget import Conditions, interpolation_spread

from ._draws import ModelDraws
from ._nonlinearity import branches
from ._responses import Method, check_level, draws_of, interval, responses


@dataclasses.dataclass(frozen=True, eq=False)
class DistanceBand:
    """The standard error of a single scan's distance by what bends the scan, m.

    - `model`: of the fitted model, up- and down-scan. `up`, `down`: of each draw.
    - `distance_m`; `level`: of intervals. `method`: what was drawn from.

    >>> from fitting import distance_band, fit
    >>> from rapi_jax import triangle
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> (drive,) = triangle(20.0, amplitude=4.5, bias=3.0, samples=200)
    >>> band = distance_band(result, drive, distance_m=0.7, draws=20)
    >>> band.method, band.up_interval[0] < band.model[0] < band.up_interval[1]  # m
    ('laplace', True)
    """

    distance_m: float
    model: tuple[float, float]
    up: Float[np.ndarray, " draws"]
    down: Float[np.ndarray, " draws"]
    level: float
    method: str

    @property
    def up_interval(self) -> tuple[float, float]:
        """The central interval of the up-scan's, m."""
        return interval(self.up, self.level)

    @property
    def down_interval(self) -> tuple[float, float]:
        """The central interval of the down-scan's, m."""
        return interval(self.down, self.level)


@takes(source=FitResult | ModelDraws, scan=Compensation | Drive)
@float64
def distance_band(
    source: FitResult | ModelDraws,
    scan: Compensation | Drive,
    *,
    distance_m: float,
    method: Method = "laplace",
    posterior: Any = None,
    level: float = 0.95,
    draws: int = 200,
    seed: int = 0,
    spacing_hz: float = 1.5e9,
) -> DistanceBand:
    """The error of a distance that is counted over the region of interest (Eqs. 2 and 4).

    Fractions of fringes and of the cavity's orders are interpolated in time, as if the scan went
    straight there: what bends it moves them. The error is the standard deviation over all places of
    comb and fringes, for each draw; see `rapi_jax.ranging.budget`. The response must be in GHz.

    **Arguments:**

    - `distance_m`: geometric, of the target. `spacing_hz`: of the cavity's peaks.
    - the others: as for `nonlinearity_band`.

    >>> from fitting import distance_band, fit
    >>> from rapi_jax import triangle
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> (drive,) = triangle(20.0, amplitude=4.5, bias=3.0, samples=200)
    >>> band = distance_band(result, drive, distance_m=0.7, draws=20)
    >>> bool(band.model[0] < band.model[1] < 1e-3)  # m: the way down bends more
    True
    """
    check_level(level)
    drive = scan.drive if isinstance(scan, Compensation) else scan
    models = draws_of(source, method, posterior, draws, seed)
    found, predicted = responses(models, drive)
    own = branches(drive, predicted)

    def error(branch: Branch) -> float:
        order = np.argsort(branch.time)
        about = Conditions(
            time=branch.time[order],
            nu=1e9 * branch.frequency[order],
            distance_m=distance_m,
            method="counting-region",
            spacing_hz=spacing_hz,
        )
        return interpolation_spread(about, draws=THRESHOLDS.combs)

    def errors(response: np.ndarray) -> tuple[float, float]:
        both = branches(drive, response, own.turning)
        return error(both.up), error(both.down)

    each = np.array([errors(one) for one in found])
    return DistanceBand(distance_m, errors(predicted), each[:, 0], each[:, 1], level, models.method)
