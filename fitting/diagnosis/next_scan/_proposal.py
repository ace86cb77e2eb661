"""Which scan to propose: one that separates the likeliest hypotheses, or one that confirms."""

import numpy as np

from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import FittedBase
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._ranking import RankedCandidates
from fitting.diagnosis.which.evidence._calibration import load_calibration
from fitting.diagnosis.which.evidence._evidence import Evidence
from fitting.diagnosis.which.evidence._tempering import Tempering, excess_at_stake
from rapi_jax import DriveLimits

from ._choice import NextScan, choose_next_scan
from ._confirmation import confirmation_scan, needs_confirmation
from ._rival_set import Hypothesis, RivalSet
from ._thresholds import THRESHOLDS


def propose_next_scan(
    whitened: WhitenedModel,
    fitted: FittedBase,
    ranked: RankedCandidates,
    evidence: Evidence,
    credible: list[str],
    limits: DriveLimits | None,
) -> NextScan | None:
    """The scan that separates the likeliest hypotheses.

    Where one stands beside `unlisted` in the `credible` set, the scan that confirms it; where one
    stands alone, none.
    """
    if len(credible) == 1:  # also `unlisted`: what tells two unlikely effects apart helps nobody
        return None
    if needs_confirmation(credible):
        return confirmation_scan(whitened, credible, limits)
    listed = [(c, p) for c, p in ranked if c is not None][: THRESHOLDS.rivals]
    likely = [(c, p) for c, p in listed if p > THRESHOLDS.rival_probability]
    rivals = likely if len(likely) > 1 else listed[:2]
    if len(rivals) < 2:
        return None
    rival_set = RivalSet.of(
        Refit(whitened, fitted.whitener, fitted.refit.base),
        _hypotheses(rivals),
        tempering=Tempering.of(evidence, load_calibration()),
        stake=lambda one, other: excess_at_stake(one, other, evidence),
        others=_hypotheses([(c, p) for c, p in ranked if c is not None]),
    )
    return choose_next_scan(whitened, fitted.whitener, rival_set, limits)


def _hypotheses(candidates: list[tuple[Candidate, float]]) -> list[Hypothesis]:
    return [
        Hypothesis(c.name, c.on_base.effects, np.asarray(c.on_base.values), p)
        for c, p in candidates
    ]
