"""Standard errors of effects where the base misfits: errors that go together within a run."""

import numpy as np
from jaxtyping import Float, Int

from fitting.diagnosis.refit._effect_vector import Effects, effect_values
from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._profile_cost import scaled_inverse


def clustered_errors(
    jacobian: Float[np.ndarray, "lines unknowns"],
    prior_weight: Float[np.ndarray, " unknowns"],
    errors: Float[np.ndarray, " lines"],
    group: Int[np.ndarray, " lines"],
) -> Float[np.ndarray, " unknowns"]:
    """Standard errors of unknowns from residuals that may be correlated in any way in a group.

    The sandwich of least squares: the normal matrix about the sum of the groups' squared gradients
    (Liang and Zeger, Biometrika 73, 1986), times groups over groups less one. Infinite for an
    unknown on which nothing depends, zero of one group alone.
    """
    matrix = jacobian.T @ jacobian + np.diag(prior_weight)
    inverse, unit = scaled_inverse(matrix)
    length = np.where(unit > 0, unit, 1.0)
    gradients = np.stack([jacobian[group == k].T @ errors[group == k] for k in np.unique(group)])
    count = len(gradients)
    if count < 2:
        return np.where(unit > 0, 0.0, np.inf)
    gradients = (gradients - gradients.mean(axis=0)) / length
    square = np.sum((gradients @ inverse) ** 2, axis=0) * count / (count - 1)
    return np.where(unit > 0, np.sqrt(square) / length, np.inf)


def misfit_errors(refit: Refit, state: State, other: Effects) -> Float[np.ndarray, " parameters"]:
    """What misfit adds to the standard errors of the effects' parameters of `state`.

    Clustered by run, since what a base misfits is alike within one and not among rates and swings;
    and, in quadrature, how far the parameters are from those beside another base, `other`: where
    two descriptions of the hysteresis disagree, each is off by about that.
    """
    prior = np.zeros(refit.base.free.size + effect_values(state.effects).size)
    prior[: refit.base.free.size] = refit.prior_weight
    run = refit.whitener.run_of_line
    found = clustered_errors(refit.jacobian(state), prior, state.errors.all, run)
    own, beside = effect_values(state.effects), effect_values(other)
    return np.hypot(found[refit.base.free.size :], own - beside)
