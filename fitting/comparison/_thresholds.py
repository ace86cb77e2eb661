"""Every number that decides in a comparison, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class ComparisonThresholds:
    """Numbers that decide about what changed between two recordings."""

    change_level: float = threshold(
        0.05,
        unit="probability of a change found where there is none",
        origin="convention for one comparison; half or twice it is wrong half or twice as often",
    )
    interval_level: float = threshold(
        0.95, unit="probability", origin="convention; of all intervals of a comparison"
    )
    detection_power: float = threshold(
        0.95,
        unit="probability",
        origin="convention, as of a diagnosis's detection limits: of a change of the size said to "
        "be detectable; with nine parameters that size is 0.65 times as large for 0.5, and "
        "1.15 times for 0.99 (normal quantiles)",
    )
    rounds: int = threshold(
        4,
        unit="refits",
        origin="parameters that only one recording fixes are held in both, a few at a time; in "
        "trials two rounds were the most",
    )
    slope_step: float = threshold(
        0.1,
        unit="standard errors of a difference",
        origin="central differences: small beside the curvature of the response, large beside "
        "rounding; a tenth moves no printed digit",
    )
    redundant: float = threshold(
        1e4,
        unit="of the standard error with all others known",
        origin="beyond it a parameter is held: 130 at most in three fits that tell all parameters, "
        "3.5e7 where two rates cannot tell the growth of thresholds from their scale; half and "
        "twice as much decide alike there",
    )
    joint_steps: int = threshold(
        20, unit="steps", origin="of Gauss-Newton from the mean of two fits; four in trials"
    )
    joint_gain: float = threshold(
        1e-3, unit="of chi-square", origin="far below 1, which is one standard error"
    )
    worse_fit: float = threshold(
        0.05,
        unit="of the rms of the model that a fit began from",
        origin="no fit may end worse than it began; room for the runs' weights, which differ in a "
        "fit; chosen, not measured. The one failed fit seen left 7 times what it began with",
    )
    joint_failure: float = threshold(
        1e-6,
        unit="p-value",
        origin="of what one model for both costs, where its parameters do not differ: by chance in "
        "one of a million good pairs; chosen, and no failed joint fit has been seen yet",
    )
    shared_misfit: float = threshold(
        0.5,
        unit="of the larger misfit",
        origin="where the smaller one is more than this, most of what the model lacks was there "
        "before and after; half or double it and a device with 129 and 131 MHz is told the same",
    )
    known_relative: float = threshold(
        3.0,
        unit="standard errors",
        origin="as in a population: a value nearer to 0 has no meaningful change in per cent",
    )


THRESHOLDS = ComparisonThresholds()
