"""Weights of the hypotheses, were one of them true: by how much chi-square each leaves more."""

import numpy as np
from scipy.stats import norm

from ._calibration import Calibration
from ._evidence import Evidence, HypothesisEvidence
from ._tempering import Tempering, excess_at_stake
from ._thresholds import THRESHOLDS


def listed_weights(evidence: Evidence, calibration: Calibration) -> np.ndarray:
    """Probabilities of the hypotheses, were one of them true; they sum to 1."""
    found = evidence.hypotheses
    best = min(found, key=lambda h: h.cost)
    lines, nonsynchronous = evidence.lines, max(evidence.nonsynchronous_lines, 1)
    tempering = Tempering.of(evidence, calibration)
    misfit = tempering.misfit
    nonsynchronous_misfit = max(1.0, best.nonsynchronous / nonsynchronous)
    penalty = calibration.parameter * np.log(lines + nonsynchronous)
    log_evidence = np.array(
        [
            -0.5
            * (
                h.synchronous / misfit
                + h.nonsynchronous / nonsynchronous_misfit
                + h.prior
                + penalty * h.parameters
                + _not_credited(h, evidence, calibration) / misfit
            )
            - calibration.chance * len(h.effects)
            - calibration.law * h.laws
            for h in found
        ]
    )
    first = found[int(np.argmax(log_evidence))]
    stake = [excess_at_stake(h.effects, first.effects, evidence) for h in found]
    temperature = np.array([tempering.temperature(x) for x in stake])
    log_weight = (log_evidence - log_evidence.max()) / temperature
    if misfit > 1.0 + THRESHOLDS.excess_sigmas * np.sqrt(2.0 / lines) or not evidence.noise_known:
        price = [
            penalty * h.parameters
            + 2.0 * (calibration.chance * len(h.effects) + calibration.law * h.laws)
            for h in found
        ]
        cost = np.array([h.cost for h in found]) + price
        log_weight = _not_surer_than_lines(log_weight, cost, evidence)
    weight = np.exp(log_weight + np.array([h.log_prior for h in found]))
    if not evidence.noise_known:
        weight = _by_identified_base(weight, evidence, calibration)
    return weight / weight.sum()


def _by_identified_base(
    weight: np.ndarray, evidence: Evidence, calibration: Calibration
) -> np.ndarray:
    """Weights of the effects, which together stay as they are, by the identified base as well.

    Where noise is unknown the flexible base is searched, and takes up nearly all beside any of
    several effects. What these leave on the identified operator then tells them apart; its own
    misfit acts as noise on that, and it is no surer than its lines agree. (Beside no effect at all
    it would be blamed for its misfit.)
    """
    found = evidence.hypotheses
    effects = [k for k, h in enumerate(found) if h.effects and h.identified_errors is not None]
    if len(effects) < 2 or not weight[effects].sum() > 0:
        return weight
    left = np.array([found[k].identified for k in effects], dtype=float)
    first = int(np.argmin(left))
    errors = np.array([(found[k].identified_errors or ())[effects[first]] for k in effects])
    more, misfit = left - left.min(), max(1.0, float(left.min()) / evidence.lines)
    told = -0.5 * more / misfit / calibration.temperature
    sigmas = more / np.where(errors > 0, errors, np.inf)
    told = np.maximum(told, norm.logsf(sigmas) - norm.logcdf(sigmas))
    out, both = weight.copy(), weight[effects] * np.exp(told)
    out[effects] = both * (weight[effects].sum() / both.sum())
    return out


def _not_surer_than_lines(
    log_weight: np.ndarray, cost: np.ndarray, evidence: Evidence
) -> np.ndarray:
    """Odds between hypotheses of which neither is quite right: no surer than the lines agree.

    A few lines may make all of the difference between two effects that look alike beside a base
    that misfits, and other lines would then have made another. `cost`: chi-square with all that
    parameters and effects cost. Hypotheses of which one holds the other are left as they are.
    """
    best = int(np.argmax(log_weight))
    first = set(evidence.hypotheses[best].effects)
    out = log_weight.copy()
    for k, other in enumerate(evidence.hypotheses):
        effects, errors = set(other.effects), other.difference_errors
        if effects <= first or first <= effects or errors is None or errors[best] <= 0.0:
            continue
        sigmas = max(cost[k] - cost[best], 0.0) / errors[best]
        odds = float(norm.logcdf(sigmas) - norm.logsf(sigmas))
        out[k] = max(out[k], out[best] - odds)
    return out


def _not_credited(one: HypothesisEvidence, evidence: Evidence, calibration: Calibration) -> float:
    """Chi-square that a hypothesis removes for nothing, see `hysteresis` and `second`.

    Where noise is unknown the base was searched, and nothing is known of that.
    """
    if not evidence.noise_known:
        return 0.0
    by_density = calibration.hysteresis * _explained_by_density(one)
    by_density = min(by_density, _may_be_removed(one, evidence))
    return by_density + calibration.second * _explained_by_one(one, evidence)


def _may_be_removed(one: HypothesisEvidence, evidence: Evidence) -> float:
    """The most that an effect may have removed of a misfit of the density, by what it leaves.

    A hysteresis unlike any density departs from it in many directions, of which an effect meets
    some: an effect that leaves noise alone has removed no such misfit.
    """
    noise = THRESHOLDS.misfit_left_sigmas * np.sqrt(2.0 * evidence.lines)
    left = max(one.synchronous - evidence.lines, 0.0) + noise
    return float(THRESHOLDS.misfit_removed * left)


def _explained_by_density(one: HypothesisEvidence) -> float:
    """What a density of plays explains beside effects, if there are any, and the operator."""
    if not one.effects or one.identified is None:
        return 0.0
    return max(one.identified - one.synchronous - one.nonsynchronous, 0.0)


def _explained_by_one(pair: HypothesisEvidence, evidence: Evidence) -> float:
    """What the better of a pair's effects explains alone; 0 of a hypothesis with one at most.

    Its equation is good to a small share of that, which a second effect would take up.
    """
    none = evidence.excess(evidence.hypotheses[0])
    alone = [
        none - evidence.excess(h)
        for h in evidence.hypotheses
        if h.effects and set(h.effects) < set(pair.effects)
    ]
    return max([*alone, 0.0])
