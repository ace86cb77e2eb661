"""The base model of a joint refit: an operator with bounds and normal priors on its values."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float

from rapi_jax import AbstractOperator
from rapi_jax._parameter import parameters

from ._thresholds import THRESHOLDS
from ._whitened_model import WhitenedModel


@dataclasses.dataclass(frozen=True, eq=False)
class BaseModel:
    """An operator whose values are fitted, with their bounds and priors.

    Behind the operator's parameters stand the unknown initial states of its plays, as fractions of
    their bands, see `WhitenedModel.initial_state`.

    - `prior_mean`, `prior_std`: of a normal prior on each value; infinite where there is none.
    - `lower`, `upper`: bounds. `free`: which values may move.
    """

    operator: AbstractOperator
    prior_mean: Float[np.ndarray, " values"]
    prior_std: Float[np.ndarray, " values"]
    lower: Float[np.ndarray, " values"]
    upper: Float[np.ndarray, " values"]
    free: Bool[np.ndarray, " values"]

    @classmethod
    def of(
        cls,
        whitened: WhitenedModel,
        operator: AbstractOperator,
        free: Bool[np.ndarray, " parameters"] | None = None,
    ) -> "BaseModel":
        """Bounds as declared, no prior; `free`: which of the operator's parameters may move."""
        found = parameters(operator)
        values = np.concatenate([np.asarray(getattr(operator, p.name)).ravel() for p in found])
        lower = np.concatenate([np.full(p.size, p.bounds[0]) for p in found])
        upper = np.concatenate([np.full(p.size, p.bounds[1]) for p in found])
        # Thresholds of all runs stay positive with a growth that is a little negative.
        lower = np.where(values < lower, THRESHOLDS.lower_bound_factor * values, lower)
        extra = whitened.initial_state_size(operator.count)
        values = np.concatenate([values, np.full(extra, THRESHOLDS.play_fraction)])
        lower, upper = np.append(lower, np.zeros(extra)), np.append(upper, np.ones(extra))
        move = np.ones(values.size, dtype=bool)
        if free is not None:
            move[: free.size] = free
        return cls(operator, values, np.full(values.size, np.inf), lower, upper, move)

    def with_fixed(self, *names: str) -> "BaseModel":
        """The same with the parameters of these names held fixed."""
        free, at = self.free.copy(), 0
        for p in parameters(self.operator):
            free[at : at + p.size] &= p.name not in names
            at += p.size
        return dataclasses.replace(self, free=free)
