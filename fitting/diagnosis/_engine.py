"""A recording against models with effects: whitened errors and how they move with parameters.

The operator is evaluated on one period of each run and spread over all; effects act on the whole
session. Its Jacobian is exact; effects are moved by steps of physical size, since the derivative of
a play is not one where a turning point passes a sample.
"""

import dataclasses
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting._vector import Vector
from rapi_jax import ECDL, AbstractOperator, Recording
from rapi_jax._ecdl import answered, drive_side, laws, optical_side
from rapi_jax._parameter import follow, parameters
from rapi_jax._sampled import DriveBatch, Sampled, sampled
from rapi_jax.effects import AbstractDriveEffect, AbstractEffect, AbstractLawEffect
from rapi_jax.effects._lags import History

from ._blocks import Block, blocks
from ._noise import Spectrum, Whitener

_ROUND = 256
Effects = tuple[AbstractEffect, ...]


@eqx.filter_jit
def _before(effects: Effects, operator: AbstractOperator, drives: DriveBatch) -> tuple[Any, ...]:
    """Drive and laws that reach the operator."""
    ecdl = ECDL(operator, effects)
    u = drive_side(ecdl, drives)
    changed = any(isinstance(effect, AbstractDriveEffect) for effect in effects)
    return u, laws(ecdl, drives), jnp.min(u, axis=1) if changed else drives.u_min


@eqx.filter_jit
def _nodes(operator: AbstractOperator, before: tuple[Any, ...], initial: Array | None) -> Array:
    u, law, u_min = before
    return answered(operator, law, u, u_min, initial)


@eqx.filter_jit
def _moved(
    operator: AbstractOperator, values: Array, before: tuple[Any, ...], initial: Array | None
) -> tuple[Array, Array]:
    """The answer on the nodes, and its derivative by each value: "values runs nodes"."""
    u, law, u_min = before
    vector = Vector(tuple(parameters(operator)))

    def answer(values: Array) -> Array:
        filled = vector.put(operator, values[: vector.size])
        start = initial
        if start is not None:
            given = values[vector.size :].reshape(-1, start.shape[1])
            unknown = jnp.cumsum(~jnp.isnan(start[:, 0])) - 1
            start = jnp.where(jnp.isnan(start), start, given[jnp.maximum(unknown, 0)])
        return answered(filled, law, u, u_min, start)

    value, push = jax.linearize(answer, values)
    return value, jax.vmap(push)(jnp.eye(values.size))


@eqx.filter_jit
def _behind(
    effects: Effects, operator: AbstractOperator, drives: DriveBatch, nodes: Array
) -> Array:
    nu = jnp.take_along_axis(nodes, drives.place, axis=1)
    return optical_side(ECDL(operator, effects), drives, nu)


@eqx.filter_jit
def _pushed(
    effects: Effects, operator: AbstractOperator, drives: DriveBatch, nodes: Array, columns: Array
) -> Array:
    """What effects behind the operator make of small changes of its answer."""
    nu = jnp.take_along_axis(nodes, drives.place, axis=1)
    small = jax.vmap(lambda c: jnp.take_along_axis(c, drives.place, axis=1))(columns)
    if not any(_is_behind(effect) for effect in effects):
        return small
    ecdl = ECDL(operator, effects)
    push = jax.linearize(lambda nu: optical_side(ecdl, drives, nu), nu)[1]
    return jax.vmap(push)(small)


def _is_behind(effect: AbstractEffect) -> bool:
    return not isinstance(effect, AbstractDriveEffect | AbstractLawEffect)


class Errors(NamedTuple):
    """Model less data: raw by run ("periods phases"), and whitened, locked to the scan and not."""

    raw: list[np.ndarray]
    locked: np.ndarray
    loose: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Engine:
    """One recording, ready to be compared with many models of it."""

    recording: Recording
    data: Sampled
    blocks: list[Block]
    own_origin: bool
    unknown: np.ndarray  # runs whose plays start anywhere

    @classmethod
    def of(cls, recording: Recording) -> "Engine":
        """The engine of a recording."""
        data = sampled(recording, lead=True)
        unknown = np.array([not run.drive.repeats for run in recording.runs])
        own = recording.response_origin == "run"
        return cls(recording, data, blocks(recording, data), own, unknown)

    @cached_property
    def full(self) -> DriveBatch:
        """All samples."""
        return self.data.device()

    @cached_property
    def _starts(self) -> list[tuple[int, int, int]]:
        """Of one period of each run: first sample of its lead-in, its own first, and its end."""
        out = []
        fields = self.data.drives
        for k, block in enumerate(self.blocks):
            first, last = int(block.left[0, 0]), int(block.right[0, -1])
            begin = first
            if fields["period_s"][k] > 0:
                time = fields["time"][k]
                begin = int(np.searchsorted(time, time[first] - fields["period_s"][k] * (1 + 1e-9)))
            out.append((begin, first, last + 1))
        return out

    @cached_property
    def cycle(self) -> DriveBatch:
        """One period of each run behind its lead-in; all of a run that does not repeat."""
        longest = max(end - begin for begin, _, end in self._starts)
        longest += -longest % _ROUND
        rows = []
        for begin, _, end in self._starts:
            rows.append(np.minimum(np.arange(begin, begin + longest), end - 1))
        index = np.stack(rows)
        full = self.full
        take = [np.take_along_axis(np.asarray(a), index, axis=1) for a in (full.time, full.place)]
        lead = np.array([first - begin for begin, first, _ in self._starts])
        history = History(
            full.history.period_s, jnp.asarray(lead), jnp.full(full.history.gap_s.shape, jnp.inf)
        )
        return dataclasses.replace(
            full, time=jnp.asarray(take[0]), place=jnp.asarray(take[1]), history=history
        )

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
        return jnp.asarray(initial)

    def filled(self, operator: AbstractOperator, values: np.ndarray) -> AbstractOperator:
        """The operator with the elements of `values`."""
        vector = Vector(tuple(parameters(operator)))
        return vector.put(operator, jnp.asarray(values[: vector.size]))

    def nodes(self, operator: AbstractOperator, values: np.ndarray, effects: Effects) -> Array:
        """The operator's answer on the nodes of all runs."""
        before = _before(self._ahead(effects), operator, self.full)
        return _nodes(self.filled(operator, values), before, self._start(operator, values))

    def moved(
        self, operator: AbstractOperator, values: np.ndarray, effects: Effects
    ) -> tuple[Array, Array]:
        """The same, with its derivative by each value."""
        before = _before(self._ahead(effects), operator, self.full)
        start = self._start(operator, values)
        return _moved(operator, jnp.asarray(values), before, start)

    @staticmethod
    def _ahead(effects: Effects) -> Effects:
        return tuple(effect for effect in effects if not _is_behind(effect))

    @staticmethod
    def _after(effects: Effects) -> Effects:
        return tuple(effect for effect in effects if _is_behind(effect))

    def rows(self, operator: AbstractOperator, effects: Effects, nodes: Array) -> np.ndarray:
        """The model's values on the padded rows of all runs."""
        return np.asarray(_behind(self._after(effects), operator, self.full, nodes))

    def response(
        self, operator: AbstractOperator, effects: Effects, nodes: Array
    ) -> list[np.ndarray]:
        """The model's values on the blocks of all runs."""
        rows = self.rows(operator, effects, nodes)
        return [block.of(rows[k]) for k, block in enumerate(self.blocks)]

    def errors(
        self, whitener: Whitener, operator: AbstractOperator, effects: Effects, nodes: Array
    ) -> Errors:
        """Model less data; masked readings have no error."""
        model = self.response(operator, effects, nodes)
        raw = [(m - b.data) * b.use for m, b in zip(model, self.blocks, strict=True)]
        return Errors(raw, whitener.locked(raw), whitener.loose(raw))

    def columns(
        self,
        whitener: Whitener,
        operator: AbstractOperator,
        effects: Effects,
        nodes: Array,
        moved: Array,
    ) -> np.ndarray:
        """Whitened derivative by the operator's values, of what is locked: "lines values"."""
        rows = np.asarray(_pushed(self._after(effects), operator, self.cycle, nodes, moved))
        parts = []
        for k, (block, (begin, _, _)) in enumerate(zip(self.blocks, self._starts, strict=True)):
            row = rows[:, k, :]
            left, right = block.left[0] - begin, block.right[0] - begin
            value = (1.0 - block.share[0]) * row[:, left] + block.share[0] * row[:, right]
            parts.append((value * block.use.mean(axis=0))[:, None, :])
        return whitener.locked(parts).T

    def whitener(self, spectrum: Spectrum) -> Whitener:
        """The whitening of this recording's runs for a noise spectrum."""
        return Whitener(self.blocks, spectrum, self.own_origin)


def free_parameters(
    effect: AbstractEffect,
) -> list[tuple[tuple[str | int, ...], float, float, str]]:
    """Path, bounds and unit of the scalar parameters that a diagnosis moves."""
    return [(p.path, *p.bounds, p.unit) for p in parameters(effect) if not p.held and p.size == 1]


def effect_values(effects: Sequence[AbstractEffect]) -> np.ndarray:
    """The moved parameters of all effects as one vector."""
    return np.array([float(follow(e, path)) for e in effects for path, *_ in free_parameters(e)])


def with_values(effects: Effects, values: np.ndarray) -> Effects:
    """The effects with the elements of `values` put in."""
    out, at = [], 0
    for effect in effects:
        for path, *_ in free_parameters(effect):
            new = jnp.asarray(values[at])
            effect = eqx.tree_at(lambda e, p=path: follow(e, p), effect, new)
            at += 1
        out.append(effect)
    return tuple(out)
