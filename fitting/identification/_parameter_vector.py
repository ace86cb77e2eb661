"""A model's declared parameters as one vector, and back."""

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array

from rapi_jax import ECDL, ModelError, Parameter, parameters
from rapi_jax.internal import follow

Module = TypeVar("Module", bound=eqx.Module)


@dataclasses.dataclass(frozen=True)
class ParameterVector:
    """Which element of the vector is which parameter of the model."""

    parts: tuple[Parameter, ...]

    @classmethod
    def of(cls, module: eqx.Module) -> "ParameterVector":
        """All declared parameters of a model, or of a part of one, in order of declaration."""
        return cls(tuple(parameters(module)))

    @property
    def size(self) -> int:
        """Number of elements."""
        return sum(part.size for part in self.parts)

    @property
    def slices(self) -> tuple[slice, ...]:
        """Where each parameter's elements stand, one slice a part."""
        ends = [0, *itertools.accumulate(part.size for part in self.parts)]
        return tuple(slice(low, high) for low, high in itertools.pairwise(ends))

    def slice(self, name: str) -> slice:
        """Where the elements of the parameter `name` stand; `KeyError` where there is none."""
        return {p.name: at for p, at in zip(self.parts, self.slices, strict=True)}[name]

    @property
    def names(self) -> list[str]:
        """A name for each element, as in `model.json`."""
        return [name for part in self.parts for name in part.names()]

    def spread(self, of: Callable[[Parameter], Any]) -> list[Any]:
        """`of(part)` for each element."""
        return [of(part) for part in self.parts for _ in range(part.size)]

    def values(self, module: eqx.Module) -> np.ndarray:
        """The elements' values in `module`, which may be another one of the same shape."""
        return np.concatenate([np.asarray(follow(module, p.path)).ravel() for p in self.parts])

    def units(self, response: str, drive: str) -> list[str]:
        """Units of the elements, with the recording's units put in."""
        out = []
        for part in self.parts:
            for i in range(part.size):
                unit = part.unit.format(x=response, u=drive)
                power = part.first + i
                out.append(unit.replace("^k", "" if power == 1 else f"^{power}"))
        return out

    def put(self, module: Module, values: Array) -> Module:
        """`module` with the elements of `values`; works on traced values."""
        pairs = list(zip(self.parts, self.slices, strict=True))
        if isinstance(values, Tracer):
            leaves = [values[at].reshape(part.shape) for part, at in pairs]
        else:  # without a program for each shape
            known = np.asarray(values)
            leaves = [as_device(known[at].reshape(part.shape)) for part, at in pairs]
        return eqx.tree_at(lambda e: [follow(e, part.path) for part in self.parts], module, leaves)

    def mask(self, ecdl: ECDL, free: Callable[[ECDL], Any]) -> np.ndarray:
        """Which elements the selector `free` picks: operator, effect, field, or a tuple of them.

        Parameters declared `held` are picked by themselves only, not with what they belong to.
        """
        marked = jax.tree_util.tree_map(lambda _: False, ecdl)
        chosen = jax.tree_util.tree_map(lambda _: True, free(ecdl))
        try:
            marked = eqx.tree_at(free, marked, chosen)
        except ValueError as error:
            raise ModelError(
                "`free` must return parts of the model it is given, such as `lambda e: e.operator` "
                f"or `lambda e: (e.operator.lam, e.operator.d)` ({error})."
            ) from error
        leaves, structure = jax.tree_util.tree_flatten(ecdl)
        numbered = jax.tree_util.tree_unflatten(structure, list(range(len(leaves))))
        picked = jax.tree_util.tree_leaves(free(numbered), lambda x: isinstance(x, eqx.Module))
        alone = {number for number in picked if isinstance(number, int)}

        def is_free(part: Parameter) -> bool:
            own = not part.held or follow(numbered, part.path) in alone
            return own and bool(follow(marked, part.path))

        return np.array(self.spread(is_free))


def as_device(values: np.ndarray | np.floating) -> Array:
    """A float64 array; call with 64-bit types on."""
    return jnp.asarray(values, dtype=jnp.float64)
