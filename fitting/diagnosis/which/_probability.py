"""How probable each hypothesis is: none, each effect, pairs, and `unlisted`."""

from collections.abc import Mapping

import numpy as np

from ._calibration import Calibration, load_calibration
from ._evidence import Evidence, Left

UNLISTED = "unlisted"
Ranked = list[tuple[str, float]]
_LEAST = 0.02  # excess a line: what noise leaves by chance
_SHARE = 1e-3  # of the excess, or of the gap held out: less is nothing
_AT = (0.3, 0.03, 0.05)  # excess a line, share left, share open, at `named_level`


def hypothesis_probabilities(
    evidence: Evidence,
    closed: Mapping[str, float] | None = None,
    calibration: Calibration | None = None,
) -> Ranked:
    """Each hypothesis by name with its probability, most probable first.

    `closed`: the closed fraction of the gap on data held out, of hypotheses for which it is known.
    """
    calibration = load_calibration() if calibration is None else calibration
    weight = _among_listed(evidence, calibration)
    top = evidence.hypotheses[int(np.argmax(weight))]
    unlisted = _remains(evidence, top, (closed or {}).get(top.name), calibration)
    out = [
        (h.name, float(w * (1.0 - unlisted)))
        for h, w in zip(evidence.hypotheses, weight, strict=True)
    ]
    return sorted([*out, (UNLISTED, unlisted)], key=lambda pair: -pair[1])


def credible_set(ranked: Ranked, level: float = 0.95) -> list[str]:
    """Names of the smallest set of hypotheses with at least `level` of the probability."""
    total, names = 0.0, []
    for name, probability in ranked:
        names.append(name)
        total += probability
        if total >= level:
            break
    return names


def _among_listed(evidence: Evidence, calibration: Calibration) -> np.ndarray:
    """Weights of the hypotheses beside one another, were one of them true."""
    found = evidence.hypotheses
    best = min(found, key=lambda h: h.cost)
    lines, nonsynchronous = evidence.lines, max(evidence.nonsynchronous_lines, 1)
    # Where the base misfits, its misfit is noise of that size to every comparison.
    wide, wide_nonsynchronous = (
        max(1.0, best.synchronous / lines),
        max(1.0, best.nonsynchronous / nonsynchronous),
    )
    each = calibration.parameter * np.log(lines + nonsynchronous)
    log = np.array(
        [
            -0.5
            * (
                h.synchronous / wide
                + h.nonsynchronous / wide_nonsynchronous
                + h.prior
                + each * h.parameters
            )
            - calibration.chance * len(h.effects)
            for h in found
        ]
    )
    first = found[int(np.argmax(log))]
    stake = np.array([_at_stake(h, first, evidence) for h in found])
    weight = np.exp((log - log.max()) / (calibration.temperature + calibration.form * stake))
    return weight / weight.sum()


def _at_stake(one: Left, other: Left, evidence: Evidence) -> float:
    """What the effects explain in which two hypotheses differ: the excess without these.

    An effect's equation is good to a few hundredths of what it explains: two that differ by less
    are not told apart by any amount of data.
    """
    common = set(one.effects) & set(other.effects)
    found = evidence.hypotheses
    without = [h for h in found if set(h.effects) == common]
    return max(evidence.excess((without or found)[0]), 0.0)


def _remains(
    evidence: Evidence, top: Left, closed: float | None, calibration: Calibration
) -> float:
    """Probability that what the best hypothesis leaves is more than noise and base misfit."""
    lines, nonsynchronous = evidence.lines, max(evidence.nonsynchronous_lines, 1)
    chance, chance_nonsynchronous = (3.0 * np.sqrt(2.0 / n) for n in (lines, nonsynchronous))
    # What the base was bent for counts too: a bend that no device has explains nothing.
    over = (top.synchronous + top.prior) / lines - 1.0 - chance
    none = evidence.hypotheses[0]
    before = evidence.excess(none)
    share = evidence.excess(top) / before if before > 0 else 0.0
    if not evidence.noise_known:  # then all that is left may be noise, and only a poor share tells
        poor = (share - calibration.left_unknown) / calibration.left_unknown_width
        more = (over + chance - calibration.misfit_unknown) / calibration.misfit_unknown_width
        return _logistic(poor) * _logistic(more)
    if evidence.nonsynchronous_lines:
        over = max(
            over,
            calibration.nonsynchronous
            * (top.nonsynchronous / nonsynchronous - 1.0 - chance_nonsynchronous),
        )
    over = max(over, _LEAST)
    if not top.effects:
        return _logistic(calibration.none_slope * np.log10(over / calibration.none_level))
    share = float(np.clip(share, _SHARE, 1.0))
    still = share if closed is None else float(np.clip(1.0 - closed, _SHARE, 1.0))
    slopes = (calibration.named_excess, calibration.named_left, calibration.named_open)
    seen = zip(slopes, (over, share, still), _AT, strict=True)
    return _logistic(calibration.named_level + sum(k * np.log10(x / at) for k, x, at in seen))


def _logistic(x: float) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(x, -50.0, 50.0))))
