"""Numbers that say which plays the density holds, and how large their weights may be."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class MisfitThresholds:
    """Grid of the density, and the prior of its scale."""

    plays: int = threshold(
        24,
        unit="plays",
        origin="4 simulated devices with base misfit: 14 leave up to 0.15 more chi-square a line; "
        "40 up to 0.13 less, tried without plays that differ in two ways",
    )
    fine_plays: int = threshold(
        72,
        unit="plays",
        origin="between the others, as they are: a classical device of 60 plays leaves 1.24, 1.18, "
        "1.08 and 1.07 of chi-square a line with 24, 36, 72 and 144",
    )
    reach: float = threshold(
        1.3, unit="widest threshold", origin="as the flexible operator's; beyond it no play moves"
    )
    lam_step: float = threshold(
        0.15, unit="1", origin="set by trial; of slopes, both ways; no other was tried"
    )
    eta_step: float = threshold(0.2, unit="1", origin="set by trial; of openings")
    growth_step: float = threshold(0.15, unit="1", origin="set by trial; of growth with rate")
    bow_step: float = threshold(
        0.025, unit="per half swing", origin="set by trial; 0.01 /V at 4.7 V"
    )
    bend_step: float = threshold(
        0.3,
        unit="of a play's half swing",
        origin="three simulated Preisach devices leave 24, 1.24 and 1.41 of chi-square a line "
        "without bent plays, 1.11, 0.98 and 1.10 with them; half: 1.04, 1.00, 1.03; double: 1.04, "
        "0.96, 1.07",
    )
    kind_log_odds: tuple[float, float] = threshold(
        (10.0, 100.0),
        unit="natural logarithm of the odds",
        origin="of finer plays, and of bent ones as well. Finer ones gain 17.5 of a classical "
        "device of 60 plays that is doubtful without, and -0.2 of a rate law that is not a "
        "candidate; bent ones gain 334 to 41 000 of Preisach devices, and 46 of that law: with 10 "
        "it passes for hysteresis",
    )
    decays: tuple[float, float] = threshold(
        (0.3, 0.9),
        unit="per widest threshold",
        origin="set by trial; a slow fall of weights with the threshold, and a fast one",
    )
    order: int = threshold(5, unit="power", origin="of the polynomial beside the plays")
    scale_range: tuple[float, float] = threshold(
        (1e-3, 10.0),
        unit="mean weight of the operator's plays",
        origin="evidence is greatest at 0.01 to 1.2 on simulated devices",
    )
    scales: int = threshold(14, unit="scales", origin="a factor of two from one to the next")
    usual_scale: float = threshold(
        0.3,
        unit="mean weight of the operator's plays",
        origin="set by trial; 0.01 to 0.1 where the operator fits, else up to 1.2",
    )
    scale_spread: float = threshold(
        2.0, unit="natural logarithm, standard deviation", origin="set by trial; wide"
    )
    least_variance: float = threshold(
        1e-2, unit="variance of noise", origin="below it a direction moves nothing"
    )
    remainder: float = threshold(
        1.25,
        unit="chi-square a line",
        origin="with chance 1.38 at 2000 lines: right effects of 20 simulated devices leave 1.21 "
        "at most (one of another form 1.46, a right pair 5.7), the best wrong answer more than "
        "1.38 on 7 of 11; 1: right effects are doubted, 2: one wrong answer more passes",
    )
    remainder_sigmas: float = threshold(
        4.0, unit="standard deviations of chi-square a line", origin="chance, 1 in 30 000"
    )
    start_points: int = threshold(
        24,
        unit="points",
        origin="on the way from an unknown start to both ends of the drive's range: a simulated "
        "device leaves 1.05, 0.87, 0.84 and 0.83 of chi-square a line with 6, 12, 24 and 48",
    )
    range_end: float = threshold(
        1e-3, unit="of the drive's range", origin="nearer to its end the drive counts as there"
    )


THRESHOLDS = MisfitThresholds()
