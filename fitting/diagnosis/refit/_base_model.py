"""The base model of a joint refit: an operator with bounds and normal priors on its values."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float

from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import AbstractOperator

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
        vector = ParameterVector.of(operator)
        values = vector.values(operator)
        lower = np.array(vector.spread(lambda p: p.bounds[0]), dtype=float)
        upper = np.array(vector.spread(lambda p: p.bounds[1]), dtype=float)
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
        free, vector = self.free.copy(), ParameterVector.of(self.operator)
        free[: vector.size] &= vector.spread(lambda p: p.name not in names)
        return dataclasses.replace(self, free=free)
