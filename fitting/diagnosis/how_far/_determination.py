r"""Whether the runs that a model saw determine what it predicts of those held out.

Parameters known with covariance $C$ make a prediction uncertain by $\operatorname{tr}(C M)$ in
chi-square, $M$ the normal matrix of the runs held out. With two amplitudes, one of them alone says
nothing of how anything grows with amplitude: a refit to it extrapolates, and its errors elsewhere
tell neither for an effect nor against it.
"""

import dataclasses

import numpy as np

from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._gauss_newton import Refit, State

_RANK = 1e-9  # of a column's length squared: rounding


def prediction_variance(seen: Refit, state: State, held: Whitener) -> float:
    """Chi-square by which errors of parameters alone are expected to move a prediction.

    `seen`: the problem of the runs that were seen, with its priors, about `state`. `held`: the
    whitening in which the others count alone. To first order in the parameters.
    """
    known = seen.normal_equations(state)[0]
    free = np.full_like(seen.base.prior_std, np.inf)
    alone = dataclasses.replace(
        seen, whitener=held, base=dataclasses.replace(seen.base, prior_std=free)
    )
    asked = alone.normal_equations(alone.evaluate(state.values, state.effects))[0]
    length = np.sqrt(np.diag(known) + np.diag(asked))
    used = length > 0
    length = np.outer(length[used], length[used])
    inside = np.ix_(used, used)
    known, asked = known[inside] / length, asked[inside] / length
    if not (np.isfinite(known).all() and np.isfinite(asked).all()):
        return float("inf")
    return float(np.trace(np.linalg.solve(known + _RANK * np.eye(len(known)), asked)))
