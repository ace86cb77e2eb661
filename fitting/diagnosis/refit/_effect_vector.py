"""The parameters of effects that a diagnosis moves, as one vector."""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from rapi_jax._parameter import follow, parameters
from rapi_jax.effects import AbstractEffect

Effects = tuple[AbstractEffect, ...]


class Moved(NamedTuple):
    """A scalar parameter that a diagnosis moves: path, bounds, unit, and which leaf it is."""

    path: tuple[str | int, ...]
    low: float
    high: float
    unit: str
    leaf: int


@functools.cache
def _moved_of(kind: Any, shapes: tuple[tuple[int, ...], ...]) -> tuple[Moved, ...]:
    numbered = jax.tree_util.tree_unflatten(kind, list(range(kind.num_leaves)))
    found = parameters(jax.tree_util.tree_unflatten(kind, [np.zeros(s) for s in shapes]))
    return tuple(
        Moved(p.path, *p.bounds, p.unit, follow(numbered, p.path))
        for p in found
        if not p.held and p.size == 1
    )


def free_parameters(effect: AbstractEffect) -> tuple[Moved, ...]:
    """The scalar parameters of an effect that a diagnosis moves."""
    leaves, kind = jax.tree_util.tree_flatten(effect)
    return _moved_of(kind, tuple(np.shape(leaf) for leaf in leaves))


def effect_values(effects: Sequence[AbstractEffect]) -> np.ndarray:
    """The moved parameters of all effects as one vector."""
    out = []
    for effect in effects:
        leaves = jax.tree_util.tree_leaves(effect)
        out += [float(leaves[p.leaf]) for p in free_parameters(effect)]
    return np.array(out)


def with_values(effects: Effects, values: np.ndarray) -> Effects:
    """The effects with the elements of `values` put in."""
    out, at = [], 0
    for effect in effects:
        leaves, kind = jax.tree_util.tree_flatten(effect)
        for p in free_parameters(effect):
            leaves[p.leaf] = np.asarray(values[at], dtype=np.float64)
            at += 1
        out.append(jax.tree_util.tree_unflatten(kind, leaves))
    return tuple(out)
