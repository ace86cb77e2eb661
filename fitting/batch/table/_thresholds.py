"""Every number that decides in the table and on the page of a batch, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class TableThresholds:
    """Numbers that decide which recordings stand out and which parameters drift."""

    significance: float = threshold(
        0.05,
        unit="probability",
        origin="convention; the share of tables without any outlier, or without any drift, in "
        "which at least one is reported all the same. Halved: half as many, and 0.2 standard "
        "deviations more are needed to be found",
    )
    growth: float = threshold(
        0.025,
        unit="probability",
        origin="Rousseeuw and van Zomeren 1990: recordings beyond the 97.5 % point of chi-square "
        "do not count in the robust start; they are let in again if the test accepts them, so "
        "halved or doubled it moves the start alone",
    )
    growth_steps: int = threshold(
        20,
        unit="steps",
        origin="a bound; the reference set was stable after 3 to 6 steps in all simulated tables",
    )
    fewest_compared: int = threshold(
        10,
        unit="recordings",
        origin="measured: of 8 recordings one with a parameter 5 standard deviations off is found "
        "in one case of six, and 6 % of tables without outliers report one; doubled, batches of a "
        "day go unchecked",
    )
    recordings_per_parameter: float = threshold(
        2.0,
        unit="recordings a parameter",
        origin="Hotelling's F needs more recordings than parameters; with twice as many it has as "
        "many degrees of freedom as there are parameters. Below, parameters are tested one by one",
    )
    fewest_in_time: int = threshold(
        6,
        unit="recordings",
        origin="720 orders, so that p = 1/360 can be reached; with 5 a Holm-corrected p of four "
        "parameters never falls below 0.05",
    )
    permutations: int = threshold(
        9999,
        unit="permutations",
        origin="p is known to 1e-4: with 20 parameters a corrected p of 0.002 can be reached; "
        "halved, 0.004",
    )
    clip: float = threshold(
        3.0,
        unit="robust standard deviations",
        origin="values beyond are drawn in before a trend is tested: 0.3 % of normal values; one "
        "outlier can then neither make nor hide a drift",
    )
    rank: float = threshold(
        1e-10,
        unit="of the variance of a parameter",
        origin="half of the digits; added to the covariance of the reference set, in which "
        "parameters may be equal in all recordings or exactly dependent",
    )


THRESHOLDS = TableThresholds()
