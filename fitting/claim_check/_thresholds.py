"""Numbers that decide whether a new run is one that a claim is of."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class ClaimCheckThresholds:
    """Numbers that decide which runs are judged by a claim, and what is said of those that fail."""

    rate_slack: float = threshold(
        0.05, unit="of the rate", origin="convention; as for drives, a rate so near is the same"
    )
    swing_slack: float = threshold(
        0.02, unit="of the swing", origin="convention; as where swings are told apart"
    )
    session_growth: float = threshold(
        2.0,
        unit="times the hours of the claim",
        origin="convention; creep goes with the logarithm of time, twice is 0.3 of a decade",
    )
    session_least: float = threshold(
        0.1, unit="h", origin="convention; a session so short is never too long"
    )
    same_rate: float = threshold(
        0.005, unit="of the rate", origin="convention; rates on which drives are told apart"
    )
    same_drive: float = threshold(
        0.01,
        unit="of the swing, rms",
        origin="convention; compensated drives of the paper's device are 7 to 8 % off a triangle",
    )
    span_bins: int = threshold(
        200,
        unit="bins of a period",
        origin="at a turn rounded over 0.02 of the period the mean of a bin is 0.0002 of the span "
        "short; of half as many it is four times that, of twice as many it has more of the noise",
    )


THRESHOLDS = ClaimCheckThresholds()
