"""A recording against models with effects: whitened errors and how they move with parameters.

The operator is evaluated on one period of each run and spread over all; effects act on the whole
session. Its Jacobian is exact; effects are moved by steps of physical size, since the derivative of
a play is not one where a turning point passes a sample.
"""

import dataclasses
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.diagnosis.noise._periods import PeriodBlock, period_blocks
from fitting.diagnosis.noise._spectrum import SpectralLines, Spectrum, Whitener
from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import AbstractOperator, Recording
from rapi_jax._ecdl import drive_side, laws, operator_response, optical_side
from rapi_jax._parameter import parameters
from rapi_jax.effects import (
    AbstractDriveEffect,
    AbstractEffect,
    AbstractLawEffect,
    AbstractLinearEffect,
    AbstractSwitch,
    Delay,
    Law,
)
from rapi_jax.effects._base import transfer
from rapi_jax.effects._first_order_lags import Modes
from rapi_jax.sampling._batch import Batch, DriveBatch, on_device, to_batch

from ._effect_vector import Effects
from ._jump_timing import match_jump_timing
from ._shape_bucketing import pad_drives, repeat_rows, round_up


class Before(NamedTuple):
    """What reaches the operator: the laws of each run, the drive, and its minima."""

    law: Law
    u: Array
    u_min: Array


# Effects are compiled one by one, so that a pair of effects needs nothing new.


@jax.jit
def _driven(effect: AbstractEffect, drives: DriveBatch, u: Array) -> tuple[Array, Array]:
    """The drive behind an effect, and its least value in each run."""
    u = drive_side((effect,), dataclasses.replace(drives, node_u=u))
    return u, jnp.min(u, axis=1)


@jax.jit
def _laws(effects: Effects, drives: DriveBatch) -> Law:
    return laws(effects, drives)


@jax.jit
def _nodes(
    operator: AbstractOperator,
    values: Array,
    before: Before,
    initial: Array | None,
) -> Array:
    return operator_response(_filled(operator, values), *before, initial)


def _filled(operator: AbstractOperator, values: Array) -> AbstractOperator:
    vector = ParameterVector(tuple(parameters(operator)))
    return vector.put(operator, values[: vector.size])


@jax.jit
def _moved(
    operator: AbstractOperator,
    values: Array,
    before: Before,
    initial: Array | None,
) -> tuple[Array, Array]:
    """The answer on the nodes, and its derivative by each value: "values runs nodes"."""
    vector = ParameterVector(tuple(parameters(operator)))

    def answer(values: Array) -> Array:
        start = initial
        if start is not None:
            given = values[vector.size :].reshape(-1, start.shape[1])
            unknown = jnp.cumsum(~jnp.isnan(start[:, 0])) - 1
            start = jnp.where(jnp.isnan(start), start, given[jnp.maximum(unknown, 0)])
        return operator_response(_filled(operator, values), *before, start)

    value, push = jax.linearize(answer, values)
    return value, jax.vmap(push)(jnp.eye(values.size))


@jax.jit
def _spread(nodes: Array, place: Array) -> Array:
    return jnp.take_along_axis(nodes, place, axis=1)


@jax.jit
def _spread_all(columns: Array, place: Array) -> Array:
    return jax.vmap(_spread, in_axes=(0, None))(columns, place)


@jax.jit
def _passed(effect: AbstractEffect, drives: DriveBatch, nu: Array) -> Array:
    return optical_side((effect,), drives, nu)


@jax.jit
def _pushed(
    effect: AbstractEffect, drives: DriveBatch, nu: Array, small: Array
) -> tuple[Array, Array]:
    """What an effect behind the operator makes of its answer, and of small changes of it."""
    nu, push = jax.linearize(lambda nu: optical_side((effect,), drives, nu), nu)
    return nu, jax.vmap(push)(small)


def _is_ahead(effect: AbstractEffect) -> bool:
    return isinstance(effect, AbstractDriveEffect | AbstractLawEffect)


def _is_linear(effect: AbstractEffect) -> bool:
    """Whether the effect, behind the operator, is told by its transfer function."""
    return not _is_ahead(effect) and isinstance(effect, AbstractLinearEffect | Delay)


@jax.jit
def _modes(effect: AbstractLinearEffect) -> Modes:
    return effect.modes()


def _transfer(effect: AbstractEffect) -> Callable[[np.ndarray], np.ndarray]:
    """The transfer function of a linear effect, of frequencies in Hz."""
    if isinstance(effect, Delay):
        tau = float(effect.tau)
        return lambda hertz: np.exp(-2j * np.pi * hertz * tau)
    assert isinstance(effect, AbstractLinearEffect)  # noqa: S101 (see `_is_linear`)
    modes = jax.tree_util.tree_map(np.asarray, _modes(effect))
    return lambda hertz: np.asarray(transfer(modes, hertz))


class Errors(NamedTuple):
    """Model less data: raw by run ("periods phases"), and whitened, locked to the scan and not.

    `early_late`: chi-square for readings beside a jump that were counted a sample early or late.
    """

    raw: list[np.ndarray]
    synchronous: np.ndarray
    nonsynchronous: np.ndarray
    jump_timing_cost: float = 0.0


@dataclasses.dataclass(frozen=True, eq=False)
class WhitenedModel:
    """One recording, ready to be compared with many models of it."""

    recording: Recording
    data: Batch
    blocks: list[PeriodBlock]
    own_origin: bool
    unknown: np.ndarray  # runs whose plays start anywhere

    @classmethod
    def of(cls, recording: Recording) -> "WhitenedModel":
        """The engine of a recording."""
        data = to_batch(recording, lead=True)
        unknown = np.array([not run.drive.repeats for run in recording.runs])
        own = recording.response_origin == "run"
        return cls(recording, data, period_blocks(recording, data), own, unknown)

    @cached_property
    def full(self) -> DriveBatch:
        """All samples."""
        return on_device(pad_drives(self.data.drives))

    @cached_property
    def short(self) -> DriveBatch:
        """The same with nodes of one period alone: all that an operator without lead-in needs."""
        full, u = self.full, np.asarray(self.full.node_u)
        lead, last = np.asarray(full.node_history.lead), u.shape[1] - 1
        # Eq. 13 is the periodic state at the minimum, so there alone may an operator begin.
        whole = np.asarray(full.node_history.period_s) > 0
        whole &= u[np.arange(len(u)), lead] == u.min(axis=1)
        lead = np.where(whole, lead, 0)
        longest = round_up(int(np.max(np.asarray(full.place).max(axis=1) - lead)) + 1)
        index = np.minimum(lead[:, None] + np.arange(longest)[None, :], last)
        return dataclasses.replace(
            full,
            node_time=jnp.asarray(np.take_along_axis(np.asarray(full.node_time), index, axis=1)),
            node_u=jnp.asarray(np.take_along_axis(u, index, axis=1)),
            place=full.place - jnp.asarray(lead)[:, None],
        )

    def _batch(self, effects: Effects) -> DriveBatch:
        """The nodes that effects ahead of the operator need."""
        ahead = any(isinstance(effect, AbstractDriveEffect) for effect in effects)
        return self.full if ahead else self.short

    @cached_property
    def _cycles(self) -> tuple[np.ndarray, list[int]]:
        """Of one period of each run, or all of one that does not repeat: samples, and the first."""
        ends = [(int(b.left[0, 0]), int(b.right[0, -1]) + 1) for b in self.blocks]
        longest = round_up(max(end - begin for begin, end in ends))
        index = np.stack([np.minimum(np.arange(a, a + longest), b - 1) for a, b in ends])
        return repeat_rows(index, len(self.full.freq)), [begin for begin, _ in ends]

    def _cycle(self, batch: DriveBatch) -> DriveBatch:
        index, _ = self._cycles
        time, place = (
            jnp.asarray(np.take_along_axis(np.asarray(a), index, axis=1))
            for a in (batch.time, batch.place)
        )
        return dataclasses.replace(batch, time=time, place=place)

    @cached_property
    def _short_cycle(self) -> DriveBatch:
        return self._cycle(self.short)

    @cached_property
    def _full_cycle(self) -> DriveBatch:
        return self._cycle(self.full)

    def initial(self, plays: int) -> np.ndarray | None:
        """First outputs of the plays as fractions of their bands, NaN where Eq. 13 holds."""
        if not self.unknown.any():
            return None
        return np.where(self.unknown[:, None], 0.5, np.nan) + np.zeros((1, plays))

    def fractions(self, plays: int) -> int:
        """Number of initial fractions behind an operator's values."""
        return int(self.unknown.sum()) * plays

    def _start(self, operator: AbstractOperator, values: np.ndarray) -> Array | None:
        initial = self.initial(operator.count)
        if initial is None:
            return None
        size = values.size - self.fractions(operator.count)
        initial[self.unknown] = values[size:].reshape(-1, operator.count)
        missing = len(self.full.freq) - len(initial)
        return jnp.asarray(np.pad(initial, [(0, missing), (0, 0)], constant_values=np.nan))

    def filled(self, operator: AbstractOperator, values: np.ndarray) -> AbstractOperator:
        """The operator with the elements of `values`."""
        return _filled(operator, jnp.asarray(values))

    def _before(self, effects: Effects) -> Before:
        batch = self._batch(effects)
        u, u_min = batch.node_u, batch.u_min
        for effect in effects:
            if isinstance(effect, AbstractDriveEffect):
                u, u_min = _driven(effect, batch, u)
        lawful = tuple(e for e in effects if isinstance(e, AbstractLawEffect))
        return Before(_laws(lawful, batch), u, u_min)

    def nodes(self, operator: AbstractOperator, values: np.ndarray, effects: Effects) -> Array:
        """The operator's answer on the nodes of all runs."""
        start = self._start(operator, values)
        return _nodes(operator, values, self._before(effects), start)

    def moved(
        self, operator: AbstractOperator, values: np.ndarray, effects: Effects
    ) -> tuple[Array, Array]:
        """The same, with its derivative by each value."""
        start = self._start(operator, values)
        return _moved(operator, values, self._before(effects), start)

    @staticmethod
    def ahead(effects: Effects) -> Effects:
        """Those of `effects` that act before the operator has answered."""
        return tuple(effect for effect in effects if _is_ahead(effect))

    def rows(self, effects: Effects, nodes: Array) -> np.ndarray:
        """The model's values on the padded rows of all runs."""
        return self._rows(effects, nodes)[0]

    def _rows(self, effects: Effects, nodes: Array) -> tuple[np.ndarray, list[np.ndarray]]:
        """The same, and what each switch adds."""
        batch = self._batch(effects)
        nu, jumps = _spread(nodes, batch.place), []
        for effect in effects:
            if _is_ahead(effect):
                continue
            before, nu = nu, _passed(effect, batch, nu)
            if isinstance(effect, AbstractSwitch):
                jumps.append(np.asarray(nu) - np.asarray(before))
        return np.asarray(nu), jumps

    def apart(
        self,
        whitener: Whitener,
        effects: Effects,
        nodes: Array,
        held: Sequence[tuple[int, PeriodBlock]] | None = None,
    ) -> tuple[list[np.ndarray], float]:
        """Model less data on each block, and the price of readings counted early or late.

        `held`: other blocks than all of the engine's, each with the number of its run. Masked
        readings have no error.
        """
        rows, jumps = self._rows(effects, nodes)
        out, price = [], 0.0
        for k, block in enumerate(self.blocks) if held is None else held:
            error = (block.of(rows[k]) - block.data) * block.use
            if jumps:
                own = [jump[k] for jump in jumps]
                error, paid = match_jump_timing(
                    error, own, block, whitener.spectrum.mean(SpectralLines.of(block))
                )
                price += paid
            out.append(error)
        return out, price

    def errors(self, whitener: Whitener, effects: Effects, nodes: Array) -> Errors:
        """Model less data; masked readings have no error."""
        raw, price = self.apart(whitener, effects, nodes)
        return Errors(raw, *whitener.both(raw), price)

    def columns(
        self, whitener: Whitener, effects: Effects, nodes: Array, moved: Array
    ) -> np.ndarray:
        """Whitened derivative by the operator's values, of what is locked: "lines values".

        What linear effects make of it follows from their transfer functions, as if they came last.
        """
        long = self._batch(effects) is self.full
        cycle = self._full_cycle if long else self._short_cycle
        nu, small = _spread(nodes, cycle.place), _spread_all(moved, cycle.place)
        for effect in effects:
            if not _is_ahead(effect) and not _is_linear(effect):
                nu, small = _pushed(effect, cycle, nu, small)
        rows = np.asarray(small)
        linear = [_transfer(effect) for effect in effects if _is_linear(effect)]
        parts = []
        for k, (block, begin) in enumerate(zip(self.blocks, self._cycles[1], strict=True)):
            row = rows[:, k, :]
            left, right = block.left[0] - begin, block.right[0] - begin
            value = (1.0 - block.share[0]) * row[:, left] + block.share[0] * row[:, right]
            if linear:
                value = _through(linear, value, block)
            parts.append((value * block.use.mean(axis=0))[:, None, :])
        return whitener.synchronous(parts).T

    def whitener(self, spectrum: Spectrum) -> Whitener:
        """The whitening of this recording's runs for a noise spectrum."""
        return Whitener(self.blocks, spectrum, self.own_origin)


def _through(
    linear: Sequence[Callable[[np.ndarray], np.ndarray]], value: np.ndarray, block: PeriodBlock
) -> np.ndarray:
    """Periods behind linear effects; a run that does not repeat starts from rest."""
    size = value.shape[1]
    first = np.zeros((len(value), 1)) if block.repeats else value[:, :1]
    count = size if block.repeats else 2 * size
    line = np.fft.rfft(value - first, count, axis=1)
    hertz = np.fft.rfftfreq(count, block.step_s)
    for gain in linear:
        line *= gain(hertz)[None, :]
    return np.fft.irfft(line, count, axis=1)[:, :size] + first
