"""Under which conditions a distance is measured: scan, set-up and disturbances."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError
from rapi_jax._metrics import SPEED_OF_LIGHT as C
from rapi_jax.display._results import summarise_budget
from rapi_jax.ranging.distance._estimators import BEST, estimator


@dataclasses.dataclass(frozen=True)
class BudgetLine:
    """One source: its part of the standard error of a single scan's distance, m; and a remark."""

    source: str
    stderr: float
    note: str = ""


class Budget(tuple[BudgetLine, ...]):
    """The lines of a budget, one for each source; sources add in squares."""

    __slots__ = ()

    def summary(self) -> str:
        """The lines as text for people, the largest first."""
        return summarise_budget(self).text()

    def _repr_html_(self) -> str:
        return summarise_budget(self).html()


@dataclasses.dataclass(frozen=True)
class Vibration:
    """Vibration of the target with an even spectrum: rms (m), lowest and highest frequency (Hz)."""

    rms_m: float
    low_hz: float
    high_hz: float


@dataclasses.dataclass(frozen=True, eq=False)
class Conditions:
    """One scan's region of interest and all that disturbs it.

    - `time` (s) and `nu` (Hz, of optical frequency): even in time, over the region of interest and
      `margin` points beyond either end of it; from a model's prediction, so that what a diagnosis
      finds in the laser reaches the distance, or from a measurement. Where no margin is given, the
      scan is taken to go on straight, which counting over the region asks about.
    - `distance_m`; `method`: the estimator. `centre_hz`: the laser's optical frequency.
    - `sample_hz`: of the digitizer. `step_v`: of one code. `noise_v`: rms of a detector.
      `amplitude_v`: of the fringes of measurement arm and interferometer (half peak to peak).
    - `interferometer_s`: delay of the auxiliary interferometer. `linewidth_hz`: Lorentzian.
    - `spacing_hz`, `finesse`: of the cavity. `comb_hz`: rms error of its comb at
      each end of a scan.
    - `vibration`; `velocity_m_per_s` that is not known or not taken out.
    - `index_stderr`: relative, of the air. `scans`: that share one scale of optical frequency.

    Raises `DataError` for an unknown method, or times and frequencies that do not fit.
    """

    time: Float[np.ndarray, " samples"]
    nu: Float[np.ndarray, " samples"]
    distance_m: float
    margin: int = 0
    method: str = BEST
    centre_hz: float = C / 780e-9
    sample_hz: float = 30e6
    step_v: float = 2.0 / 4095
    noise_v: float = 2e-3
    amplitude_v: tuple[float, float] = (0.405, 0.405)
    interferometer_s: float = 24.5e-9
    linewidth_hz: float = 1e5
    spacing_hz: float = 1.5e9
    finesse: float = 200.0
    comb_hz: float = 0.0
    vibration: Vibration | None = None
    velocity_m_per_s: float = 0.0
    index_stderr: float = 0.0
    scans: int = 1

    def __post_init__(self) -> None:
        estimator(self.method)
        if self.time.size < 16 or self.time.shape != self.nu.shape:
            raise DataError("`time` and `nu` must be columns of one length, 16 samples or more.")
        if not 0 <= 2 * self.margin < self.time.size - 16:
            raise DataError(f"`margin` leaves no region of interest: {self.margin}.")
        if not (np.all(np.diff(self.time) > 0) and self.nu[0] != self.nu[-1]):
            raise DataError("`time` must increase, and `nu` must span something.")

    def region(self) -> tuple[np.ndarray, np.ndarray]:
        """`time` and `nu` in the region of interest."""
        inside = slice(self.margin, self.time.size - self.margin)
        return self.time[inside], self.nu[inside]

    @property
    def span_hz(self) -> float:
        """Of optical frequency, in the region of interest."""
        _, nu = self.region()
        return float(abs(nu[-1] - nu[0]))

    @property
    def delay_s(self) -> float:
        """Of the target's light."""
        return 2.0 * self.distance_m / C

    @property
    def counts(self) -> bool:
        """Whether the method counts fringes and orders."""
        return not estimator(self.method).proportional
