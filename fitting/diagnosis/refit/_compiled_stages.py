"""Stages of a laser model, each compiled by itself, so that a pair of effects needs nothing new."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import AbstractOperator
from rapi_jax.effects import AbstractDriveEffect, AbstractEffect, AbstractLawEffect, Law
from rapi_jax.internal import (
    DriveBatch,
    Stretches,
    drive_side,
    laws,
    operator_response,
    optical_side,
    rows_with_spare_nodes,
)

from ._effect_vector import Effects


class OperatorInput(NamedTuple):
    """What reaches the operator: the laws of each run, the drive, and its minimum in each run.

    `stretches`: where these drives are monotone, if their turns are few.
    """

    law: Law
    u: Float[Array, "runs grid"]
    u_min: Float[Array, " runs"]
    stretches: Stretches | None = None

    def response(
        self, operator: AbstractOperator, initial_state: Float[Array, "runs plays"] | None
    ) -> Float[Array, "runs grid"]:
        """What the operator answers."""
        return operator_response(
            operator, self.law, self.u, self.u_min, initial_state, self.stretches
        )


def acts_before_operator(effect: AbstractEffect) -> bool:
    """Whether an effect changes what reaches the operator, and not only its response."""
    return isinstance(effect, AbstractDriveEffect | AbstractLawEffect)


@jax.jit
def apply_drive_effect(
    effect: AbstractEffect, drives: DriveBatch
) -> tuple[DriveBatch, Float[Array, " runs"]]:
    """The drives behind an effect, and the least in each run."""
    behind = drive_side((effect,), drives)
    return behind, jnp.min(behind.node_u, axis=1)


@jax.jit
def combine_laws(effects: Effects, drives: DriveBatch) -> Law:
    """The laws of each run with these effects."""
    return laws(effects, drives)


@jax.jit
def respond(
    operator: AbstractOperator,
    values: Float[Array, " values"],
    given: OperatorInput,
    initial_state: Float[Array, "runs plays"] | None,
) -> Float[Array, "runs grid"]:
    """The response of the operator with parameters `values`; `initial_state`: NaN for Eq. 13."""
    return given.response(set_values(operator, values), initial_state)


def set_values(operator: AbstractOperator, values: Float[Array, " values"]) -> AbstractOperator:
    """The operator with the first elements of `values` as its parameters."""
    vector = ParameterVector.of(operator)
    return vector.put(operator, values[: vector.size])


@jax.jit
def linearise_response(
    operator: AbstractOperator,
    values: Float[Array, " values"],
    given: OperatorInput,
    initial_state: Float[Array, "runs plays"] | None,
) -> tuple[Float[Array, "runs grid"], Float[Array, "values runs grid"]]:
    """The same, and its derivative by each value; those behind the parameters are initial states.

    In `values` stand the states of the runs that have one in `initial_state`, run after run.
    """

    def response(values: Array) -> Array:
        start = initial_states(operator, values, initial_state)
        return given.response(set_values(operator, values), start)

    value, push = jax.linearize(response, values)
    return value, jax.vmap(push)(jnp.eye(values.size))


def initial_states(
    operator: AbstractOperator,
    values: Float[Array, " values"],
    initial_state: Float[Array, "runs plays"] | None,
) -> Float[Array, "runs plays"] | None:
    """Those that stand in `values` behind the parameters, for runs that have one."""
    if initial_state is None:
        return None
    given = values[ParameterVector.of(operator).size :].reshape(-1, initial_state.shape[1])
    row = jnp.cumsum(~jnp.isnan(initial_state[:, 0])) - 1
    return jnp.where(jnp.isnan(initial_state), initial_state, given[jnp.maximum(row, 0)])


@jax.jit
def gather_samples(
    response: Float[Array, "runs grid"], sample_index: Int[Array, "runs time"]
) -> Float[Array, "runs time"]:
    """The response on the sampling grid, read at the samples of each run."""
    return jnp.take_along_axis(response, sample_index, axis=1)


@jax.jit
def bent_rows(sent: DriveBatch, reached: DriveBatch) -> tuple[DriveBatch, Int[Array, "runs rows"]]:
    """The samples and the bends between them, see `rows_with_spare_nodes`."""
    return rows_with_spare_nodes(sent, reached)


@jax.jit
def apply_optical_effect(
    effect: AbstractEffect, drives: DriveBatch, nu: Float[Array, "runs time"]
) -> Float[Array, "runs time"]:
    """The response behind an effect."""
    return optical_side((effect,), drives, nu)
