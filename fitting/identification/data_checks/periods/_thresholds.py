"""Numbers that decide whether periods of a run are alike, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class PeriodThresholds:
    """Numbers that decide whether a period is as the others of its run."""

    unsettled_level: float = threshold(
        0.01,
        unit="recordings",
        origin="convention: one settled recording in 100 is told to be unsettled; halved and "
        "doubled, so is that share",
    )
    unsettled_terms: int = threshold(
        16,
        unit="terms of a cosine transform",
        origin="a settling is smooth over a period; 8: one that ends in less than a 16th of it is "
        "seen later, 32: more noise is compared, and a slow one is seen later",
    )
    missing_readings: float = threshold(
        0.1,
        unit="of a period's readings",
        origin="convention: where more are missing periods are not compared; those of the other "
        "periods at their phase stand in, which hides so much of a difference at most",
    )
    unsettled_least: float = threshold(
        1e-6,
        unit="of the response's span, as noise of each term",
        origin="readings printed in six digits; a tenth: interpolation between samples is seen in "
        "simulated readings without noise, ten times: noise of an excellent reading",
    )


THRESHOLDS = PeriodThresholds()
