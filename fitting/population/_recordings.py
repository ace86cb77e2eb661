"""What a population says of one of its recordings."""

import dataclasses
from datetime import datetime


@dataclasses.dataclass(frozen=True)
class PopulationRecording:
    """One recording in the population; arrays are of its parameters, NaN where not estimated.

    - `days`: since the first; `None` where time is not known.
    - `values`, `stderr`: of its own fit. `shrunken`, `shrunken_stderr`: its empirical Bayes
      estimates, from its own fit and the population.
    - `p_value`: of the recording in the prediction of the others, `p_holm` for all recordings
      together. An `outlier` is no part of means, drift and scatter.
    """

    label: str
    recorded_at: datetime | None
    days: float | None
    temperature_c: float | None
    values: tuple[float, ...]
    stderr: tuple[float, ...]
    shrunken: tuple[float, ...]
    shrunken_stderr: tuple[float, ...]
    p_value: float
    p_holm: float
    outlier: bool
    sha256: str
