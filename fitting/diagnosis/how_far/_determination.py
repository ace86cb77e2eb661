r"""Whether the runs that a model saw determine what it predicts of those held out.

Parameters known with covariance $C$ make a prediction uncertain by $\operatorname{tr}(C M)$ in
chi-square, $M$ the normal matrix of the runs held out. With two amplitudes, one of them alone says
nothing of how anything grows with amplitude: a refit to it extrapolates, and its errors elsewhere
tell neither for an effect nor against it. Beyond first order, two models that the runs seen do not
tell apart must not predict differently either.
"""

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._effect_vector import effect_values
from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._thresholds import THRESHOLDS

_RANK = 1e-9  # of a column's length squared: rounding


def prediction_variance(
    seen: Float[np.ndarray, "lines unknowns"],
    held: Float[np.ndarray, "others unknowns"],
    prior_weight: Float[np.ndarray, " values"],
) -> float:
    """Chi-square by which errors of parameters alone are expected to move a prediction.

    `seen`, `held`: Jacobians of whitened errors of the runs that were seen, and of the others.
    `prior_weight`: see `Refit`. To first order in the parameters.
    """
    known, asked = seen.T @ seen, held.T @ held
    known[np.arange(prior_weight.size), np.arange(prior_weight.size)] += prior_weight
    length = np.sqrt(np.diag(known) + np.diag(asked))
    used = length > 0
    length = np.outer(length[used], length[used])
    inside = np.ix_(used, used)
    known, asked = known[inside] / length, asked[inside] / length
    if not (np.isfinite(known).all() and np.isfinite(asked).all()):
        return float("inf")
    return float(np.trace(np.linalg.solve(known + _RANK * np.eye(len(known)), asked)))


def is_as_good(seen: Refit, start: State, end: State) -> bool:
    """Whether `end` fits the runs seen no better than chance would have it, beside `start`."""
    free = int(seen.base.free.sum()) + effect_values(end.effects).size
    return start.cost - end.cost < float(chi2.isf(THRESHOLDS.as_good_chance, free))


def prediction_change(start: State, end: State, held: Whitener) -> float:
    """Chi-square between two predictions of the runs that count in `held`."""
    change = [a - b for a, b in zip(end.errors.raw, start.errors.raw, strict=True)]
    return float(sum(part @ part for part in held.whiten(change)))
