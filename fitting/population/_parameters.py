"""What a population says of one parameter: mean, drift and scatter."""

import dataclasses

YEAR_DAYS = 365.25


@dataclasses.dataclass(frozen=True)
class Effect:
    """A coefficient of one parameter, with its standard error and confidence interval.

    By Student's t with `degrees` of freedom (Kenward and Roger). `p_value`: of being 0; `p_holm`:
    the same for all parameters together; not a number for a mean.
    """

    value: float
    stderr: float
    low: float
    high: float
    degrees: float
    unit: str
    p_value: float = float("nan")
    p_holm: float = float("nan")

    def times(self, factor: float, unit: str) -> "Effect":
        """The same in another unit."""
        scaled = {key: factor * getattr(self, key) for key in ("value", "stderr", "low", "high")}
        return dataclasses.replace(self, **scaled, unit=unit)


@dataclasses.dataclass(frozen=True)
class PopulationParameter:
    """One parameter over all recordings.

    - `mean`: at the mean time and temperature of the recordings.
    - `time`, `temperature`: change a day and a kelvin; `None` where that is no covariate. Where
      `smooth`, a smooth curve is added to the line in time.
    - `scatter`: standard deviation between recordings beyond the errors of their own fits, with its
      95 % interval.
    """

    name: str
    unit: str
    mean: Effect
    time: Effect | None
    temperature: Effect | None
    scatter: float
    scatter_low: float
    scatter_high: float
    smooth: bool

    @property
    def per_year(self) -> Effect | None:
        """The drift in a year."""
        if self.time is None:
            return None
        return self.time.times(YEAR_DAYS, self.time.unit.replace("/day", "/year"))
