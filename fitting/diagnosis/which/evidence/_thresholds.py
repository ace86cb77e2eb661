"""Numbers that decide how probable hypotheses are, beside those of the calibration."""

import dataclasses

from rapi_jax.internal import threshold

_TRIAL = "set by trial"


@dataclasses.dataclass(frozen=True)
class EvidenceThresholds:
    """What a comparison of chi-squares does not decide by itself."""

    least_unknown_noise: float = threshold(
        0.01,
        unit="of the variance read off the fastest lines",
        origin="less has followed the noise; a servo leaves 0.08, so half and double do nothing",
    )
    credible_level: float = threshold(0.95, unit="probability", origin="the files' contract")
    most_widening: float = threshold(
        30.0,
        unit="1",
        origin="an answer of a millionth has then a share of 0.6 beside a sure one: a set that "
        "needs more holds nearly all names, and the answer counts as not reached",
    )
    widening_step: float = threshold(
        1e-4, unit="of the factor", origin="far below the spread of factors between banks"
    )
    doubt_share: float = threshold(
        0.05,
        unit="of the hypotheses' probability",
        origin="what a change of runs leaves of the gap where it is named: at most a twentieth",
    )
    unlisted_share: float = threshold(
        0.25,
        unit="probability",
        origin="of 10 simulated devices that leave more than a hysteresis could 7 were unlisted, "
        "so a lower bound; half: the set is the same, double: it is the answer where two are tied",
    )
    unlisted_unknown_noise: float = threshold(
        0.2,
        unit="probability",
        origin="of 44 simulated devices with unknown noise for which an effect was named, mostly "
        "with certainty, 12 had two effects, or another; half: 90 % is said where 73 % are right, "
        "double: 60 %",
    )
    law_of_hysteresis: float = threshold(
        0.5,
        unit="of the probability of hypotheses with a law",
        origin="4 simulated devices for which other thresholds than the paper's were taken and a "
        "law of amplitude or rate was named, 3 of them sure: 1 had one; half: the law still comes "
        "first in all, double: it is never named there",
    )
    least_closed: float = threshold(
        0.5,
        unit="of the gap, upper end of the 95 % interval",
        origin="half: an effect that closes less is not what most of the gap is",
    )
    excess_least: float = threshold(
        0.02, unit="excess a line", origin="what noise leaves by chance"
    )
    excess_sigmas: float = threshold(
        3.0, unit="standard deviations of chi-square a line", origin=f"{_TRIAL}; chance taken off"
    )
    misfit_removed: float = threshold(
        8.0,
        unit="times the misfit that is left",
        origin="what an effect may remove of a hysteresis unlike any density. 663 simulated "
        "devices: 4 loses a pair, 1 calls two of another hysteresis saturation, 16 is as 8; creep "
        "beside a base that misfits far more is found with 8 and 4, not with 16",
    )
    misfit_left_sigmas: float = threshold(
        1.645, unit="standard deviations of chi-square", origin="95 %, one side, of what is left"
    )
    share_least: float = threshold(
        1e-3, unit="of the excess or of the held-out gap", origin=f"{_TRIAL}; less is nothing"
    )
    reference_excess: float = threshold(
        0.3, unit="excess a line", origin="where `named_level` of the calibration holds"
    )
    reference_share_left: float = threshold(
        0.03, unit="of the excess", origin="where `named_level` of the calibration holds"
    )
    reference_share_open: float = threshold(
        0.05, unit="of the held-out gap", origin="where `named_level` of the calibration holds"
    )


THRESHOLDS = EvidenceThresholds()
