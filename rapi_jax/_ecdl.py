"""The device: an operator with effects around it, and what it answers to a drive."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._arguments import takes
from ._errors import ModelError
from ._parameter import parameters
from ._precision import float64
from .display._model_line import describe_model
from .display._results import summarise_model
from .effects import (
    AbstractCouplingEffect,
    AbstractDriveEffect,
    AbstractEffect,
    AbstractLagEffect,
    AbstractLawEffect,
    AbstractOpticalEffect,
    Law,
)
from .effects.base._by_place import AbstractBend, AbstractFollower
from .effects.base._first_order_lags import respond_linear
from .operators import AbstractOperator
from .plays._monotone_stretches import Stretches, stretches_on_device
from .recording._drive import Drive
from .sampling._batch import (
    DriveBatch,
    batch,
    interleaved,
    on_device,
    rows_with_spare_nodes,
    with_spare_nodes,
)
from .sampling._history import History
from .sampling._operator_nodes import OperatorNodes
from .sampling._sampling_grid import row_of

Effects = tuple[AbstractEffect, ...]


class ECDL(eqx.Module):
    """An external-cavity diode laser, or any device a hysteresis operator describes.

    Effects on the drive act in order before the operator, those on the response in order after it;
    laws change what the operator's own laws see of a run.

    >>> from rapi_jax import ECDL, parameters
    >>> from rapi_jax.effects import Delay
    >>> from rapi_jax.examples import paper_device
    >>> laser = ECDL(paper_device().operator, (Delay.at(tau=2e-5),))
    >>> [found.name for found in parameters(laser)][-3:]
    ['d_0', 'origin', 'Delay.tau']
    """

    operator: AbstractOperator
    effects: Effects = ()

    def without(self, *names: str) -> "ECDL":
        """The device without its effects of these names, such as one that only the reading has.

        Raises `ModelError` where it has no effect of a name.

        >>> from rapi_jax import ECDL
        >>> from rapi_jax.effects import Creep, Etalon
        >>> from rapi_jax.examples import paper_device
        >>> laser = ECDL(paper_device().operator, (Creep.at(gain=0.01), Etalon.at(amplitude=0.1)))
        >>> [effect.name for effect in laser.without("etalon").effects]
        ['creep']
        """
        known = list(dict.fromkeys(effect.name for effect in self.effects))
        for name in names:
            if name not in known:
                has = f"these: {', '.join(known)}" if known else "none"
                raise ModelError(
                    f"the model has no effect {name!r} that could be left out; of effects it has "
                    f"{has}."
                )
        return ECDL(self.operator, tuple(e for e in self.effects if e.name not in names))

    def summary(self) -> str:
        """The parameters as text for people."""
        return summarise_model(self, parameters(self)).text()

    def __repr__(self) -> str:
        return describe_model(self, parameters(self)) or super().__repr__()

    def _repr_html_(self) -> str:
        return summarise_model(self, parameters(self)).html()

    def __call__(
        self,
        t: Float[Array, " time"],
        u: Float[Array, " time"],
        freq: Float[Array, ""],
        *,
        initial: Float[Array, " plays"] | None = None,
        u_pp: Float[Array, ""] | None = None,
        u_min: Float[Array, ""] | None = None,
    ) -> Float[Array, " time"]:
        """The response to `u` at session times `t` (s), scan rate `freq` (Hz); see the operator.

        The device is at rest at the first sample. `u_pp` is that of the drive sent, whatever
        effects make of it: thresholds follow the run (Eq. 11). Eq. 13 looks at the drive that
        reaches the operator.
        """
        u_pp = jnp.ptp(u) if u_pp is None else u_pp
        u_min = jnp.min(u) if u_min is None else u_min
        none = jnp.zeros(1)
        alone = History(none, jnp.zeros(1, dtype=jnp.int32), none + jnp.inf)
        place = jnp.arange(u.size)[None, :]
        one = DriveBatch(
            t[None, :], u[None, :], alone, t[None, :], place, alone,
            freq[None], u_pp[None], u_min[None], (u_min + u_pp / 2.0)[None],
        )  # fmt: skip
        return respond(self, one, None if initial is None else initial[None, :])[0]


def _linear(effect: AbstractLagEffect, t: Array, x: Array, history: History) -> Array:
    return respond_linear(effect.modes(), t, x, history, session=effect.session, past=effect.past())


def drive_side(effects: Effects, drives: DriveBatch) -> DriveBatch:
    """The drives that reach the operator, on the nodes; spare ones where a drive bends anew."""
    for effect in effects:
        if isinstance(effect, AbstractDriveEffect):
            t, u = drives.node_time, drives.node_u
            if isinstance(effect, AbstractLagEffect):
                u = _linear(effect, t, u, drives.node_history)
            elif isinstance(effect, AbstractFollower):
                t, u = _followed(effect, drives)
            elif isinstance(effect, AbstractBend) and drives.spare:
                value, bend_s, bend = jax.vmap(effect.between)(t[:, ::2], u[:, ::2])
                t, u = interleaved(t[:, ::2], bend_s), interleaved(value, bend)
            else:
                u = jax.vmap(effect)(t, u)
            drives = dataclasses.replace(drives, node_time=t, node_u=u)
    return drives


def needs_spare_nodes(effects: Effects) -> bool:
    """Whether the drive behind these effects bends where the one before them does not."""
    return any(isinstance(effect, AbstractBend | AbstractFollower) for effect in effects)


def _followed(effect: AbstractFollower, drives: DriveBatch) -> tuple[Array, Array]:
    """One period does not settle what follows slowly: a row that repeats starts where it returns.

    An error of the start shrinks by one factor each period (to nothing, where the output catches
    up anywhere), so that two periods tell where the periodic state begins. Spare nodes take the
    places and values of bends.
    """
    t, u, lead = drives.node_time, drives.node_u, drives.node_history.lead
    if drives.spare:
        t, u, lead = t[:, ::2], u[:, ::2], lead // 2
    row = jnp.arange(u.shape[0])

    def a_period_later(start):
        return jax.vmap(effect.follow)(t, u, start)[row, lead]

    first = u[:, 0]
    second = a_period_later(first)
    third = a_period_later(second)
    fell, left = first - second, second - third
    moves = (jnp.abs(left) < jnp.abs(fell)) & (left != 0)
    factor = jnp.where(moves, left, 0.0) / jnp.where(moves, fell, 1.0)
    start = third - left * factor / (1.0 - factor)
    start = jnp.where(drives.node_history.period_s > 0, start, first)
    value, bend_time, bend = jax.vmap(effect.follow_between)(t, u, start)
    if not drives.spare:
        return t, value
    return interleaved(t, bend_time), interleaved(value, bend)


def laws(effects: Effects, drives: DriveBatch) -> Law:
    """What the operator's laws see of each run; fields of shape `runs`."""
    law = Law.of(drives.freq, drives.u_pp)
    for effect in effects:
        if isinstance(effect, AbstractLawEffect):
            law = jax.vmap(effect)(law, drives.bias)
    return law


def operator_response(
    operator: AbstractOperator,
    law: Law,
    u: Float[Array, "runs nodes"],
    u_min: Float[Array, " runs"],
    initial: Float[Array, "runs plays"] | None = None,
    stretches: Stretches | None = None,
) -> Float[Array, "runs nodes"]:
    """What the operator answers to the drives `u` that reach it, on the nodes.

    `stretches`: where these drives are monotone, if that is known.
    """
    constant = getattr(operator, operator.fields.constant)

    def one(u, law, u_min, initial, stretches):
        known = {} if stretches is None else {"stretches": stretches}
        answer = operator(u, law.freq, initial=initial, u_pp=law.u_pp, u_min=u_min, **known)
        return law.after(answer, constant)

    axes = (0, 0, 0, None if initial is None else 0, None if stretches is None else 0)
    return jax.vmap(one, in_axes=axes)(u, law, u_min, initial, stretches)


def optical_side(
    effects: Effects, drives: DriveBatch, nu: Float[Array, "runs time"]
) -> Float[Array, "runs time"]:
    """What the effects behind the operator make of its answer, on the samples."""
    t = drives.time
    for effect in effects:
        if isinstance(effect, AbstractDriveEffect | AbstractLawEffect):
            continue
        if isinstance(effect, AbstractLagEffect):
            nu = _linear(effect, t, nu, drives.history)
        elif isinstance(effect, AbstractCouplingEffect):
            sent = jnp.take_along_axis(drives.node_u, drives.place, axis=1)
            nu = jax.vmap(effect)(t, nu, sent)
        elif isinstance(effect, AbstractOpticalEffect):
            nu = jax.vmap(effect)(t, nu)
        else:
            raise TypeError(
                f"effect {type(effect).__name__} must be a drive, law, optical or coupling effect."
            )
    return nu


def respond(
    ecdl: ECDL, drives: DriveBatch, initial: Float[Array, "runs plays"] | None = None
) -> Float[Array, "runs time"]:
    """The response in every run of a session, on the samples of `drives`."""
    changed = any(isinstance(effect, AbstractDriveEffect) for effect in ecdl.effects)
    drives = with_spare_nodes(drives) if needs_spare_nodes(ecdl.effects) else drives
    reached = drive_side(ecdl.effects, drives)
    u = reached.node_u
    u_min = jnp.min(u, axis=1) if changed else drives.u_min
    stretches = None if changed else drives.stretches
    law = laws(ecdl.effects, drives)
    nodes = operator_response(ecdl.operator, law, u, u_min, initial, stretches)
    if not drives.spare:
        nu = jnp.take_along_axis(nodes, drives.place, axis=1)
        return optical_side(ecdl.effects, drives, nu)
    rows, place = rows_with_spare_nodes(drives, reached)
    nu = jnp.take_along_axis(nodes, place, axis=1)
    return optical_side(ecdl.effects, rows, nu)[:, ::2]


compiled_respond = eqx.filter_jit(respond)


def known_response(
    ecdl: ECDL, drives: DriveBatch, initial: Float[Array, "runs plays"] | None = None
) -> Float[np.ndarray, "runs time"]:
    """`respond`, compiled, and sample by sample where monotone stretches do not tell the response.

    So it is where a falling bound of a play falls as the drive rises: what is held over a stretch
    then is not the clamped first output, and comes out as NaN.
    """
    found = np.asarray(compiled_respond(ecdl, drives, initial))
    if drives.stretches is None or not np.isnan(found).any():
        return found
    return np.asarray(compiled_respond(ecdl, dataclasses.replace(drives, stretches=None), initial))


@takes(ecdl=ECDL, drive=Drive)
@float64
def predict(ecdl: ECDL, drive: Drive, *, initial: Any = None) -> Float[np.ndarray, " time"]:
    """The response of `ecdl` to `drive`, at each of its samples, in the response's unit.

    Of a drive that repeats the answer is the steady one. For others `initial` may give each play's
    first output as a fraction of its band (0 lower, 1 upper); without it the plays start as Eq. 13
    has them at the drive's minimum, and effects with a memory at rest. Turning points between
    samples count; where a drive repeats in fewer than 400 samples it is drawn between them, by
    straight lines between corners and by cubic splines where it is smooth.

    >>> from rapi_jax import predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> (drive,) = triangle(10.0, amplitude=4.5, bias=3.0, samples=100)
    >>> response = predict(paper_device(), drive)  # GHz
    >>> round(float(response[25] - response[75]), 2)  # up less down at 3 V: the loop is open
    -13.48
    """
    given = None if initial is None else jnp.asarray(initial, dtype=jnp.float64)
    alone = None if ecdl.effects else _operator_alone(ecdl.operator, drive, given)
    return _on_grid(ecdl, drive, given) if alone is None else alone


def _operator_alone(
    operator: AbstractOperator, drive: Drive, initial: Float[Array, " plays"] | None
) -> Float[np.ndarray, " time"] | None:
    """Over monotone stretches; `None` where the drive has none to speak of, or a bound falls."""
    nodes = OperatorNodes.of(drive)
    stretches = stretches_on_device(nodes.u[None, :])
    if stretches is None:
        return None
    low, high = nodes.u.min(), nodes.u.max()
    law = np.array([drive.rate, high - low, low])
    found = np.asarray(_respond(operator, nodes.u, law, initial, stretches))
    if np.isnan(found[0]):
        return None
    answer = nodes.answer(found)
    return answer if answer.flags.writeable else answer.copy()


@eqx.filter_jit
def _respond(operator, u, law, initial, stretches):
    freq, u_pp, u_min = law
    one = Stretches(stretches.turn[0], stretches.index[0])
    return operator(u, freq, initial=initial, u_pp=u_pp, u_min=u_min, stretches=one)


def _on_grid(
    ecdl: ECDL, drive: Drive, initial: Float[Array, " plays"] | None
) -> Float[np.ndarray, " time"]:
    """On the grid that effects need."""
    row = row_of(drive, 0.0, lead=bool(ecdl.effects))
    drives = on_device(batch([drive], [row]))
    given = None if initial is None else initial[None, :]
    answer = known_response(ecdl, drives, given)[0, : row.sample.size]
    return answer[row.sample >= 0]
