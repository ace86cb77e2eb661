"""Posterior probabilities of the hypotheses: none, each effect, pairs, and `unlisted`."""

from collections.abc import Collection, Mapping

import numpy as np

from ._calibration import Calibration, load_calibration
from ._evidence import Evidence, HypothesisEvidence
from ._listed_weights import listed_weights
from ._thresholds import THRESHOLDS

UNLISTED = "unlisted"
Ranked = list[tuple[str, float]]


def hypothesis_probabilities(
    evidence: Evidence,
    closed: Mapping[str, float] | None = None,
    calibration: Calibration | None = None,
) -> Ranked:
    """Each hypothesis by name with its probability, most probable first.

    `closed`: the closed fraction of the gap on data held out, of hypotheses for which it is known.
    """
    calibration = load_calibration() if calibration is None else calibration
    weight, found = listed_weights(evidence, calibration), evidence.hypotheses
    top, closed = found[int(np.argmax(weight))], closed or {}
    unlisted = _unlisted_probability(evidence, top, closed.get(top.name), calibration)
    odd = float(np.exp(-top.log_prior))  # odd values are as much rarer beside what is not listed
    unlisted = unlisted * odd / (1.0 - unlisted + unlisted * odd)
    kept = np.full(len(found), 1.0 - unlisted)
    if evidence.noise_known:  # no effect: probable only as far as what is then left allows
        kept[0] = min(kept[0], 1.0 - _unlisted_probability(evidence, found[0], None, calibration))
    probability = weight * kept
    out = [(h.name, float(p)) for h, p in zip(found, probability, strict=True)]
    return sorted([*out, (UNLISTED, float(1.0 - probability.sum()))], key=lambda pair: -pair[1])


def doubt_unpredictive(ranked: Ranked, closed: Mapping[str, Mapping[str, float]]) -> Ranked:
    """The same where an effect surely leaves most of the gap open on data held out.

    `closed`: the closed fraction as `value`, `low`, `high` (95 %), of hypotheses for which it is
    known. Most of the gap is then something else, however well the effect fits what was seen: what
    such hypotheses lose is `unlisted`'s.
    """
    share = THRESHOLDS.doubt_share
    poor = {name for name, found in closed.items() if found["high"] < THRESHOLDS.least_closed}
    kept = [(n, share * p if n in poor else p) for n, p in ranked if n != UNLISTED]
    rest = (UNLISTED, 1.0 - sum(p for _, p in kept))
    return sorted([*kept, rest], key=lambda pair: -pair[1])


def withhold_judgment() -> Ranked:
    """The hypotheses where faults of the data leave nothing that tells them apart.

    No effect is considered. Whether anything is missing stays open: both answers are as probable.
    """
    return [(UNLISTED, 0.5), ("none", 0.5)]


def doubt_remainder(ranked: Ranked) -> Ranked:
    """The same where what the likeliest effects leave is beyond any hysteresis.

    Something else is then missing, or the effect has another form: `unlisted` keeps a share at
    least, and the others are scaled.
    """
    return _keep_unlisted(ranked, THRESHOLDS.unlisted_share)


def doubt_unknown_noise(ranked: Ranked) -> Ranked:
    """The same where an effect is the likeliest answer and noise is not known.

    A second effect, or one that looks like the first, may then pass for noise and leave no trace:
    `unlisted` keeps a share at least.
    """
    if ranked[0][0] in ("none", UNLISTED):
        return ranked
    return _keep_unlisted(ranked, THRESHOLDS.unlisted_unknown_noise)


def doubt_law(ranked: Ranked, laws: Collection[str]) -> Ranked:
    """The same where the hysteresis follows another law of thresholds than the paper's.

    What a law of amplitude or of rate then explains may be the hysteresis itself. So hypotheses
    with one of `laws` (names of effects) lose a share to the same without it: to their other
    effect, or to `unlisted`.
    """
    out = dict(ranked)
    for name, probability in ranked:
        effects = set(name.split("+"))
        if not effects & set(laws):
            continue
        moved = THRESHOLDS.law_of_hysteresis * probability
        rest = "+".join(sorted(effects - set(laws)))
        out[name] -= moved
        out[rest if rest in out else UNLISTED] += moved
    return sorted(out.items(), key=lambda pair: -pair[1])


def _keep_unlisted(ranked: Ranked, least: float) -> Ranked:
    """`unlisted` at `least` or more, the others in their ratios."""
    found = dict(ranked)
    if found[UNLISTED] >= least:
        return ranked
    scale = (1.0 - least) / (1.0 - found[UNLISTED])
    out = [(name, least if name == UNLISTED else scale * p) for name, p in ranked]
    return sorted(out, key=lambda pair: -pair[1])


def doubt_all(ranked: Ranked) -> Ranked:
    """The same where what is left is surely none of the effects, nor noise: jumps."""
    kept = [(n, THRESHOLDS.doubt_share * p) for n, p in ranked if n != UNLISTED]
    rest = (UNLISTED, 1.0 - sum(p for _, p in kept))
    return sorted([*kept, rest], key=lambda pair: -pair[1])


def doubt_none(ranked: Ranked) -> Ranked:
    """The same where noise is not known and what is left does not look like it.

    What `none` loses is `unlisted`'s: slow noise, or an effect that is not known.
    """
    share = THRESHOLDS.doubt_share
    lost = sum((1.0 - share) * p for name, p in ranked if name == "none")
    change = {"none": -lost, UNLISTED: lost}
    return sorted(((name, p + change.get(name, 0.0)) for name, p in ranked), key=lambda x: -x[1])


def _unlisted_probability(
    evidence: Evidence, top: HypothesisEvidence, closed: float | None, calibration: Calibration
) -> float:
    """Probability that what the best hypothesis leaves is more than noise and base misfit."""
    lines, nonsynchronous = evidence.lines, max(evidence.nonsynchronous_lines, 1)
    chance, nonsynchronous_chance = (
        THRESHOLDS.excess_sigmas * np.sqrt(2.0 / n) for n in (lines, nonsynchronous)
    )
    price = 0.0 if top.effects else calibration.determinant * top.prior
    over = (top.synchronous + price) / lines - 1.0 - chance
    none = evidence.hypotheses[0]
    before = evidence.excess(none)
    left = evidence.excess(top) / before if before > 0 else 0.0
    # An excess within chance is nothing left, however small the gap was.
    surely = sum(
        max(x - n * (1.0 + chance_of), 0.0)
        for x, n, chance_of in (
            (top.synchronous, lines, chance),
            (top.nonsynchronous, evidence.nonsynchronous_lines, nonsynchronous_chance),
        )
    )
    if not evidence.noise_known:  # all that is left may be noise: only a large share left tells
        if top.effects and closed is not None:  # an effect that predicts nothing new explains none
            left = max(left, float(np.clip(1.0 - closed, 0.0, 1.0)))
        poor = (left - calibration.left_unknown) / calibration.left_unknown_width
        # All that the base's values cost counts: values that no device has explain nothing.
        more = (top.synchronous + top.prior) / lines - 1.0 - calibration.misfit_unknown
        more /= calibration.misfit_unknown_width
        return _logistic(poor) * _logistic(more)
    if evidence.nonsynchronous_lines:
        over = max(
            over,
            calibration.nonsynchronous
            * (top.nonsynchronous / nonsynchronous - 1.0 - nonsynchronous_chance),
        )
    over = max(over, THRESHOLDS.excess_least)
    if not top.effects:
        return _logistic(calibration.none_slope * np.log10(over / calibration.none_level))
    least = THRESHOLDS.share_least
    left = float(np.clip(surely / before if before > 0 else 0.0, least, 1.0))
    still_open = left if closed is None else float(np.clip(1.0 - closed, least, 1.0))
    terms = (
        (calibration.named_excess, over, THRESHOLDS.reference_excess),
        (calibration.named_left, left, THRESHOLDS.reference_share_left),
        (calibration.named_open, still_open, THRESHOLDS.reference_share_open),
    )
    odds = calibration.named_level + sum(k * np.log10(x / at) for k, x, at in terms)
    return calibration.most_unlisted * _logistic(odds)


def _logistic(x: float) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(x, -50.0, 50.0))))
