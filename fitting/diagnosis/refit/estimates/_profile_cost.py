"""Chi-square at other values of effects that jump, with all that is smooth following linearly."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float

from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._thresholds import THRESHOLDS
from fitting.solver._identifiability import is_determined


def scaled_inverse(
    matrix: Float[np.ndarray, "unknowns unknowns"],
) -> tuple[Float[np.ndarray, "unknowns unknowns"], Float[np.ndarray, " unknowns"]]:
    """Pseudo-inverse of a normal matrix scaled to a unit diagonal, and the lengths of its columns.

    A length is 0 where the data do not depend on an unknown, or where its derivative overflows: of
    a refit that ran away.
    """
    unit = np.sqrt(np.diag(matrix))
    unit = np.where(np.isfinite(unit), unit, 0.0)
    alive = unit > 0
    length = np.where(alive, unit, 1.0)
    known = alive[:, None] & alive[None, :] & np.isfinite(matrix)
    scaled = np.where(known, matrix, 0.0) / length[:, None] / length[None, :]
    scaled += np.diag(np.where(alive, 0.0, 1.0))
    size, vectors = np.linalg.eigh(scaled)
    kept = is_determined(size, THRESHOLDS.covariance_rcond)
    return (vectors[:, kept] / size[kept]) @ vectors[:, kept].T, unit


@dataclasses.dataclass(frozen=True, eq=False)
class ProfileCost:
    """Chi-square of a state, least over all unknowns in which the response is smooth.

    What is smooth (the base model and the other effects' parameters) follows linearly, by its
    Jacobian at one state. With it held a level's position would seem known far better than it is:
    all levels a little higher are a constant, which the base takes up.

    - `jacobian`: of all whitened errors by the smooth unknowns. `inverse`: of their normal matrix.
    - `prior_weight`: one over the priors' variances, 0 where there is none.
    """

    refit: Refit
    jacobian: Float[np.ndarray, "lines smooth"]
    inverse: Float[np.ndarray, "smooth smooth"]
    prior_weight: Float[np.ndarray, " smooth"]

    @classmethod
    def of(
        cls,
        refit: Refit,
        state: State,
        matrix: Float[np.ndarray, "unknowns unknowns"],
        effects: Float[np.ndarray, "lines parameters"],
        smooth: Bool[np.ndarray, " parameters"],
    ) -> "ProfileCost":
        """About `state`; `matrix` and `effects`: as `Refit.normal_equations` has them.

        `smooth`: which of the effects' parameters are.
        """
        base = np.zeros((len(effects), state.values.size))
        base[: state.errors.synchronous.size] = refit.jacobian_base(state)
        kept = np.append(np.ones(state.values.size, dtype=bool), smooth)
        inverse, unit = scaled_inverse(matrix[np.ix_(kept, kept)])
        length = np.where(unit > 0, unit, np.inf)
        weight = np.where(refit.base.free, refit.base.prior_std**-2.0, 0.0)
        return cls(
            refit,
            np.concatenate([base, effects[:, smooth]], axis=1),
            inverse / length[:, None] / length[None, :],
            np.append(weight, np.zeros(int(smooth.sum()))),
        )

    def __call__(self, state: State) -> float:
        """The cost at `state` less what the smooth unknowns take away from it."""
        off = np.zeros(self.prior_weight.size)
        off[: state.values.size] = state.values - self.refit.base.prior_mean
        errors = state.errors.all
        if not np.isfinite(errors).all():
            return np.inf
        gradient = self.jacobian.T @ errors + np.where(
            self.prior_weight > 0, self.prior_weight * off, 0.0
        )
        return state.cost - float(gradient @ self.inverse @ gradient)
