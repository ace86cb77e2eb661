"""The free scalar parameters of effects as one vector, and back."""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from rapi_jax import parameters
from rapi_jax.effects import AbstractEffect
from rapi_jax.internal import follow

Effects = tuple[AbstractEffect, ...]


class ScalarParameter(NamedTuple):
    """A free scalar parameter of an effect: path, bounds, unit, and index of its leaf."""

    path: tuple[str | int, ...]
    low: float
    high: float
    unit: str
    leaf: int


@functools.cache
def _scalar_parameters(
    structure: Any, shapes: tuple[tuple[int, ...], ...]
) -> tuple[ScalarParameter, ...]:
    numbered = jax.tree_util.tree_unflatten(structure, list(range(structure.num_leaves)))
    found = parameters(jax.tree_util.tree_unflatten(structure, [np.zeros(s) for s in shapes]))
    return tuple(
        ScalarParameter(p.path, *p.bounds, p.unit, follow(numbered, p.path))
        for p in found
        if not p.held and p.size == 1
    )


def free_parameters(effect: AbstractEffect) -> tuple[ScalarParameter, ...]:
    """The scalar parameters of an effect that a refit adjusts."""
    leaves, structure = jax.tree_util.tree_flatten(effect)
    return _scalar_parameters(structure, tuple(np.shape(leaf) for leaf in leaves))


def strength_names(effect: AbstractEffect) -> tuple[str, ...]:
    """The free parameters that say how strong an effect is, the one to report first."""
    names = [str(p.path[0]) for p in free_parameters(effect)]
    return tuple(n for n in type(effect).strength if n in names) or tuple(names[:1])


def effect_values(effects: Sequence[AbstractEffect]) -> Float[np.ndarray, " parameters"]:
    """The free parameters of all effects as one vector."""
    out = []
    for effect in effects:
        leaves = jax.tree_util.tree_leaves(effect)
        out += [float(leaves[p.leaf]) for p in free_parameters(effect)]
    return np.array(out)


def with_values(effects: Effects, values: Float[np.ndarray, " parameters"]) -> Effects:
    """The effects with the elements of `values` as their free parameters.

    Those whose values do not change are the same objects.
    """
    out, at = [], 0
    for effect in effects:
        leaves, structure = jax.tree_util.tree_flatten(effect)
        changed = False
        for p in free_parameters(effect):
            changed |= float(leaves[p.leaf]) != values[at]
            leaves[p.leaf] = np.asarray(values[at], dtype=np.float64)
            at += 1
        out.append(jax.tree_util.tree_unflatten(structure, leaves) if changed else effect)
    return tuple(out)
