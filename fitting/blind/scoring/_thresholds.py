"""Numbers that decide what is counted and which target it has."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class ScoringThresholds:
    """Classes of sizes, targets of the measures, and the fit of the calibration."""

    detectable: float = threshold(
        2.0,
        unit="standard deviations of the noise",
        origin="by agreement; smaller effects need not be detected",
    )
    nameable: float = threshold(
        4.0,
        unit="standard deviations of the noise",
        origin="by agreement; smaller effects need not be named",
    )
    separable: float = threshold(
        0.05, unit="signature", origin="by agreement; less is absorbed by the base"
    )
    closed: float = threshold(0.9, unit="mean-square gap", origin="target by agreement")
    detection_target: float = threshold(0.98, unit="proportion", origin="target by agreement")
    false_alarm_target: float = threshold(0.03, unit="proportion", origin="target by agreement")
    unlisted_target: float = threshold(0.90, unit="proportion", origin="target by agreement")
    refusal_target: float = threshold(0.05, unit="proportion", origin="target by agreement")
    coverage_target: float = threshold(
        0.95, unit="proportion", origin="nominal coverage of the credible sets"
    )
    set_size_target: float = threshold(1.5, unit="names", origin="target by agreement")
    top_1_target: float = threshold(0.95, unit="proportion", origin="target by agreement")
    realised_target: float = threshold(0.90, unit="proportion", origin="target by agreement")
    calibration_target: float = threshold(
        0.05, unit="probability", origin="target by agreement, for both calibration errors"
    )
    reliability_bounds: tuple[float, ...] = threshold(
        (0.5, 0.8, 0.95),
        unit="probability",
        origin="what a reader takes for a guess, likely, very likely and sure; they decide nothing",
    )
    bins: int = threshold(10, unit="bins", origin="customary for reliability diagrams")
    bootstrap_draws: int = threshold(
        2000, unit="draws", origin="95 % intervals to about 1 % of a probability"
    )
    least_probability: float = threshold(
        1e-6, unit="probability", origin="keeps the log score finite for hypotheses not shown"
    )
    fitted_least_probability: float = threshold(
        1e-3, unit="probability", origin="set by trial; keeps one miss from ruling the fit"
    )
    fit_evaluations: int = threshold(
        4000, unit="evaluations", origin="set by trial; ends the search for a calibration"
    )
    significance: float = threshold(0.05, unit="probability", origin="customary")
    confidence: float = threshold(
        0.95, unit="probability", origin="customary; of intervals of proportions"
    )


THRESHOLDS = ScoringThresholds()
