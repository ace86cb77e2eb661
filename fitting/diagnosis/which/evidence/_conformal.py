r"""Sets of hypotheses that hold the right one as often as they say, by split conformal prediction.

Sets are nested in a factor $f \ge 1$: probabilities to the power of $1/f$, and the smallest set
with 95 % of them. The score of a device whose answer is known is the least factor at which its set
holds the answer; the factor used is the score of rank $\lceil 0.95 (n + 1) \rceil$ among $n$
devices. So the set of a new device of their kind holds the answer in at least 95 % (V. Vovk et al.,
Algorithmic Learning in a Random World, 2005; nested sets: C. Gupta et al., Pattern Recognition 127,
108496, 2022). Each type of answer has a factor of its own (Mondrian).
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from ._thresholds import THRESHOLDS

Ranked = list[tuple[str, float]]
TYPES = ("none", "single", "pair", "unlisted")


def answer_type(name: str) -> str:
    """`none`, `unlisted`, `single` or `pair`: what kind of answer `name` is."""
    if name in ("none", "unlisted"):
        return name
    return "pair" if "+" in name else "single"


def temper(ranked: Ranked, factor: float) -> Ranked:
    """Probabilities to the power of 1 / `factor`, which sum to 1; the order stays."""
    if factor == 1.0:
        return ranked
    power = np.array([p for _, p in ranked]) ** (1.0 / factor)
    return [(name, float(p)) for (name, _), p in zip(ranked, power / power.sum(), strict=True)]


def widen(ranked: Ranked, factors: Mapping[str, float]) -> Ranked:
    """Tempered by the factor of the first answer's type; 1 where `factors` has none."""
    return temper(ranked, factors.get(answer_type(ranked[0][0]), 1.0)) if ranked else ranked


def credible_set(ranked: Ranked) -> list[str]:
    """Names of the smallest set of hypotheses with at least 95 % of the probability."""
    total, names = 0.0, []
    for name, probability in ranked:
        names.append(name)
        total += probability
        if total >= THRESHOLDS.credible_level:
            break
    return names


def least_factor(ranked: Ranked, right: str) -> float:
    """The least factor at which the set holds `right`; infinite where no factor does."""
    most = THRESHOLDS.most_widening

    def holds(factor: float) -> bool:
        return right in credible_set(temper(ranked, factor))

    if holds(1.0):
        return 1.0
    if not holds(most):
        return np.inf
    low, high = 1.0, most
    while high / low > 1.0 + THRESHOLDS.widening_step:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def conformal_factor(scores: Float[np.ndarray, " devices"]) -> float:
    """The factor at which sets hold the answer in 95 %; infinite where the devices are too few."""
    rank = int(np.ceil(THRESHOLDS.credible_level * (scores.size + 1)))
    return float(np.sort(scores)[rank - 1]) if rank <= scores.size else np.inf
