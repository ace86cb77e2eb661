"""The operator's derivative by its values in closed form, at some samples of each run.

Plays are read off their last contacts, see `_play_jacobian`; only how the plays' numbers follow the
values is left to differentiate, which no sample enters. Ten to twenty times as fast as a derivative
through all samples of the grid.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from fitting.diagnosis.refit._compiled_stages import OperatorInput, initial_states, set_values
from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import AbstractOperator
from rapi_jax.effects import Law

from ._play_jacobian import DriveStretches, PlayNumbers, play_jacobian


class Linearised(NamedTuple):
    """The response at some samples of each run, and its derivative by each value."""

    response: Float[np.ndarray, "runs time"]
    derivative: Float[np.ndarray, "values runs time"]


def linearise_in_closed_form(
    operator: AbstractOperator,
    values: Float[np.ndarray, " values"],
    given: OperatorInput,
    initial_state: Float[Array, "runs plays"] | None,
    place: Int[np.ndarray, "runs time"],
) -> Linearised | None:
    """The same as `linearise_response`, at the places `place` of the grid.

    `None` where there is no closed form: drives that turn often, an operator with a response of its
    own.
    """
    if given.stretches is None or not _is_sum_of_plays(operator):
        return None
    u = np.asarray(given.u)
    turn, index = (np.asarray(a) for a in given.stretches)
    numbers, slopes, origin = (
        np.asarray(a)
        for a in _play_numbers(operator, values, given.law, u[:, 0], given.u_min, initial_state)
    )
    vector, fields = ParameterVector.of(operator), operator.fields
    polynomial, constant = vector.slice(fields.polynomial), vector.slice(fields.constant)
    coefficients, order = values[polynomial], np.arange(polynomial.stop - polynomial.start) + 1
    gain, offset = np.asarray(given.law.gain), np.asarray(given.law.offset)
    response, derivative = np.empty(place.shape), np.empty((values.size, *place.shape))
    for k, at in enumerate(place):
        plays = PlayNumbers.of(numbers[k])
        drive = DriveStretches.of(u[k] - origin, turn[k], index[k], at, plays)
        memory, rows = play_jacobian(plays, drive)
        powers = drive.u ** order[:, None]
        columns = slopes[k].T @ rows[:-1]
        columns[polynomial] += powers
        if fields.origin is not None:
            steep = (coefficients * order) @ drive.u ** (order - 1)[:, None]
            columns[vector.slice(fields.origin)] -= rows[-1] + steep
        columns *= gain[k]
        columns[constant] += 1.0
        response[k] = values[constant][0] + gain[k] * (memory + coefficients @ powers) + offset[k]
        derivative[:, k] = columns
    return Linearised(response, derivative)


def _is_sum_of_plays(operator: AbstractOperator) -> bool:
    """Whether its response is that of Eqs. 14 to 16."""
    own, plain = type(operator), AbstractOperator
    return (
        own.hysteresis is plain.hysteresis
        and own.memoryless is plain.memoryless
        and own.__call__ is plain.__call__
        and own.centred is plain.centred
    )


@jax.jit
def _play_numbers(
    operator: AbstractOperator,
    values: Float[Array, " values"],
    law: Law,
    u_first: Float[Array, " runs"],
    u_min: Float[Array, " runs"],
    initial_state: Float[Array, "runs plays"] | None,
) -> tuple[Float[Array, "runs numbers"], Float[Array, "runs numbers values"], Float[Array, ""]]:
    """The numbers of the plays in each run, their derivative, and the operator's origin."""

    def of_run(values, law, u_first, u_min, initial):
        changed = set_values(operator, values)
        plays = changed.plays(law.u_pp, law.freq)
        first = changed.centred(u_first)[None]
        start = plays.start(first, changed.centred(u_min), initial)
        bend = jnp.zeros(2)
        if plays.bow is not None and plays.u_0 is not None:
            bend = jnp.stack([plays.bow, plays.u_0])
        return jnp.concatenate([plays.r, plays.lam, plays.eta, plays.p, start, bend])

    def of_all(values):
        initial = initial_states(operator, values, initial_state)
        axes = (None, 0, 0, 0, None if initial is None else 0)
        return jax.vmap(of_run, in_axes=axes)(values, law, u_first, u_min, initial)

    origin = -set_values(operator, values).centred(jnp.zeros(()))
    return of_all(values), jax.jacfwd(of_all)(values), origin
