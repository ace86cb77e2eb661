"""Numbers that decide which new scans realise a prediction."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class RealisedThresholds:
    """New scans, and scans compensated by a model."""

    full_swing: float = threshold(
        0.98, unit="largest swing", origin="runs from here on count as of the full swing"
    )
    compensated_span: float = threshold(
        0.8,
        unit="span of the base model",
        origin="set by trial; leaves room for the inverse at both ends",
    )
    rising_fraction: float = threshold(
        0.7, unit="period", origin="a skewed triangle, where recorded ones have half"
    )


THRESHOLDS = RealisedThresholds()
