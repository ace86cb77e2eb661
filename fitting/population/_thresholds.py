"""Every number that decides in a population, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class PopulationThresholds:
    """Numbers that decide about the variances, outliers, and what changed."""

    # Which recordings and parameters
    least_degrees: int = threshold(
        4,
        unit="recordings more than covariates and mean",
        origin="with fewer a variance between recordings has a 95 % interval wider than a factor "
        "of 20; more refuses small populations",
    )
    same_held: float = threshold(
        1e-9, unit="relative", origin="rounding; values that were held at the same place"
    )
    collinear: float = threshold(
        1e-6,
        unit="of the largest singular value of standardised covariates",
        origin="below it time and temperature are told apart by rounding alone",
    )
    damaged_correlation: float = threshold(
        1e-6,
        unit="eigenvalue of a correlation matrix",
        origin="rounding of a matrix written with 17 digits; a more negative one is no correlation",
    )

    # Restricted maximum likelihood
    likelihood_tolerance: float = threshold(
        1e-8,
        unit="of the parameters of the variance, and of the log-likelihood",
        origin="far below what matters, 0.01 nats; halved or doubled it moves no printed digit",
    )
    likelihood_slope: float = threshold(
        1e-2,
        unit="nats a unit of a standardised parameter",
        origin="a step of one standard deviation may then gain 0.01 nats; a larger slope is noted "
        "as not converged",
    )
    padded_recordings: int = threshold(
        32, unit="recordings", origin="fewer cost as much: compiling takes seconds, a step 0.1 ms"
    )
    likelihood_steps: int = threshold(
        600, unit="steps", origin="ten times what 55 variances took in trials"
    )
    least_start: float = threshold(
        0.1,
        unit="of the standard deviation of the estimates",
        origin="a variance that starts at 0 has no slope there; the end does not depend on it",
    )
    full_degrees: float = threshold(
        2.0,
        unit="degrees of freedom a parameter",
        origin="with fewer a full covariance is near singular and never preferred in trials",
    )

    # Smooth drift
    smooth_lengths: tuple[float, ...] = threshold(
        (0.125, 0.25, 0.5, 1.0),
        unit="of the time between the first recording and the last",
        origin="a drift faster than the first is scatter, one slower than the last a line",
    )
    smooth_rank: int = threshold(
        24,
        unit="eigenfunctions",
        origin="with the shortest length they hold 99.7 % of the prior variance; cost grows with "
        "their square",
    )
    smooth_units: int = threshold(
        8, unit="recordings", origin="with fewer a smooth curve and scatter are not told apart"
    )

    # Outliers and changes
    outlier_level: float = threshold(
        0.01,
        unit="probability of one or more false outliers",
        origin="convention; a twentieth of populations would lose a good recording with 0.05",
    )
    outlier_share: float = threshold(
        0.2,
        unit="of the recordings",
        origin="more are no outliers but another population; then none is left out",
    )
    change_level: float = threshold(
        0.01,
        unit="probability of a change found where there is none",
        origin="convention; a monthly check is then wrong once in eight years",
    )
    change_sizes: tuple[float, ...] = threshold(
        (3.0, 10.0, 30.0, 100.0),
        unit="standard errors of a change in that parameter alone",
        origin="prior: normal about 0 with one of these standard deviations, equally likely: "
        "changes that matter may be of any size; half or twice moves a Bayes factor by less than 2",
    )
    prior_none: float = threshold(
        0.5, unit="probability", origin="prior that nothing changed; convention"
    )
    prior_several: float = threshold(
        0.1,
        unit="probability",
        origin="prior of a change in any direction; what is left is shared by single parameters",
    )
    credible: float = threshold(
        0.95, unit="probability", origin="convention; of the set of changes that is named"
    )


THRESHOLDS = PopulationThresholds()
