"""Numbers that say which plays the density holds, and how large their weights may be."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class MisfitThresholds:
    """Grid of the density, and the prior of its scale."""

    plays: int = threshold(
        24,
        unit="plays",
        origin="nulls of 7 open devices with base misfit; 14 leave 0.05 more chi-square a line, 40 "
        "as much as 24",
    )
    reach: float = threshold(
        1.3, unit="widest threshold", origin="as the flexible operator's; beyond it no play moves"
    )
    lam_step: float = threshold(
        0.15, unit="1", origin="spread of slopes among operators of the open bank, both ways"
    )
    eta_step: float = threshold(0.2, unit="1", origin="the same of openings")
    growth_step: float = threshold(0.15, unit="1", origin="the same of growth with scan rate")
    bow_step: float = threshold(
        0.025, unit="per half swing", origin="the same of the bend of falling bounds (0.01 /V)"
    )
    decays: tuple[float, float] = threshold(
        (0.3, 0.9),
        unit="per widest threshold",
        origin="weights that fall with the threshold as the open bank's, and three times as fast",
    )
    order: int = threshold(5, unit="power", origin="of the polynomial beside the plays")
    scale_range: tuple[float, float] = threshold(
        (1e-3, 10.0),
        unit="mean weight of the operator's plays",
        origin="evidence is greatest at 0.01 to 1 on open devices",
    )
    scales: int = threshold(14, unit="scales", origin="a factor of two from one to the next")
    usual_scale: float = threshold(
        0.3, unit="mean weight of the operator's plays", origin="median of the open bank"
    )
    scale_spread: float = threshold(
        2.0, unit="natural logarithm, standard deviation", origin="covers the open bank's in one"
    )
    least_variance: float = threshold(
        1e-2, unit="variance of noise", origin="below it a direction moves nothing"
    )
    remainder: float = threshold(
        1.25,
        unit="chi-square a line",
        origin="the right effect leaves 1.21 at most on 20 open devices (one of another form "
        "1.46), the best wrong one 1.33 and more on 9 of 10; 1.1: right effects are doubted, 2: "
        "half of the wrong ones pass",
    )
    remainder_sigmas: float = threshold(
        4.0, unit="standard deviations of chi-square a line", origin="chance, 1 in 30 000"
    )
    remainder_steps: int = threshold(20, unit="steps", origin="as the flexible base's; at most")


THRESHOLDS = MisfitThresholds()
