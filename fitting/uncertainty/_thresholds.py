"""Numbers that decide in profiles, posteriors and bands, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class UncertaintyThresholds:
    """Where profiles end, when a posterior is refused, and how bands are drawn."""

    # Profiles
    profile_reach: float = threshold(
        64.0,
        unit="standard errors",
        origin="convention; an end farther away counts as open. Halved and doubled it moves no end "
        "that is nearer",
    )
    profile_end: float = threshold(
        0.02, unit="of the root of chi-square", origin="a fiftieth of a standard error"
    )
    profile_evaluations: int = threshold(
        24, unit="fits an end", origin="set by trial; 4 to 7 are usual"
    )
    profile_bound: float = threshold(
        1e-3,
        unit="of the distance from optimum to bound",
        origin="what stands for the bound itself, where the solver's coordinate has no end",
    )
    profile_lower: float = threshold(
        0.5,
        unit="of chi-square, calibrated",
        origin="set by trial; kinks of the noise leave less. A fit that lies lower by more was not "
        "at the optimum",
    )

    # Posterior
    rhat: float = threshold(
        1.01, unit="1", origin="A. Vehtari et al., Bayesian Analysis 16, 667, 2021: below it"
    )
    effective_draws: float = threshold(
        400.0,
        unit="draws",
        origin="the same: in bulk and tails, 100 for each of four chains, so that R-hat and "
        "quantiles are themselves known",
    )
    divergences: int = threshold(
        0,
        unit="divergent transitions",
        origin="M. Betancourt, arXiv:1701.02434, 2017: one shows a region that is not reached",
    )
    accept: float = threshold(
        0.8,
        unit="acceptance probability",
        origin="set by trial; kinks of plays let steps of 0.8 diverge now and then",
    )
    start_spread: float = threshold(
        1.0,
        unit="standard deviations",
        origin="chains that start apart are what R-hat compares; see Vehtari et al., 2021",
    )
    inside: float = threshold(
        1.0,
        unit="standard errors",
        origin="set by trial; chains start that far from a bound at which a fit ended, where the "
        "coordinate would be flat",
    )
    linear_rank: float = threshold(
        1e-12, unit="of the largest eigenvalue", origin="rounding of squared columns"
    )

    # Bands
    rejected: float = threshold(
        1e-3,
        unit="of the draws",
        origin="convention; with fewer within the bounds the Gaussian says nothing of what is "
        "inside them",
    )
    combs: int = threshold(
        64,
        unit="places of comb and fringes",
        origin="the rms error of counting is known to 9 % of itself; the same places for all draws",
    )


THRESHOLDS = UncertaintyThresholds()
