"""`parameter`: a fitted leaf of a model, with its unit and its physical bounds."""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import numpy as np

from ._precision import as_float64

Bounds = tuple[float, float]
UNBOUNDED: Bounds = (-np.inf, np.inf)


def parameter(
    *,
    unit: str,
    default: Any = dataclasses.MISSING,
    bounds: Bounds = UNBOUNDED,
    positive: bool = False,
    linear: bool = False,
    first: int = 1,
    held: bool = False,
) -> Any:
    """Declare a field as a fitted float64 array.

    **Arguments:**

    - `unit`: as shown to people; `{x}` stands for the response's unit and `{u}` for the drive's.
    - `default`: the value at which the part does nothing, where there is one.
    - `bounds`: lowest and highest physical value. Fits stay strictly inside.
    - `positive`: short for `bounds=(0, inf)`.
    - `linear`: whether the operator's output is affine in it with a basis that depends on the drive
      alone, so that a fit may solve for it exactly.
    - `first`: the number of a vector's first element, in names such as `d_1`.
    - `held`: whether a diagnosis keeps the value it starts from; a fit moves it where it is freed
      by itself, not with the whole operator or effect.

    >>> import equinox as eqx
    >>> from jaxtyping import Array, Float
    >>> from rapi_jax import parameter, parameters
    >>> class Gain(eqx.Module):
    ...     gain: Float[Array, ""] = parameter(unit="GHz/V", default=20.0, positive=True)
    >>> [(found.name, found.unit) for found in parameters(Gain())]
    [('gain', 'GHz/V')]
    """
    if positive:
        bounds = (0.0, np.inf)
    if not bounds[0] < bounds[1]:
        raise ValueError(f"Argument `bounds` must be (low, high) with low < high, but is {bounds}.")
    metadata = {"unit": unit, "bounds": bounds, "linear": linear, "first": first, "held": held}
    if default is dataclasses.MISSING:
        return eqx.field(converter=as_float64, metadata=metadata)
    return eqx.field(converter=as_float64, metadata=metadata, default=default)


@dataclasses.dataclass(frozen=True)
class Parameter:
    """One declared leaf of a model, as found by `parameters`.

    >>> from rapi_jax import parameters
    >>> from rapi_jax.examples import paper_device
    >>> alpha = parameters(paper_device().operator)[0]
    >>> alpha.name, alpha.bounds, alpha.linear
    ('alpha', (0.0, inf), False)
    """

    name: str  # the field's name, prefixed by the effect's class where it belongs to one
    path: tuple[str | int, ...]  # attribute names and tuple indices from the root
    shape: tuple[int, ...]
    unit: str
    bounds: Bounds
    linear: bool
    first: int
    held: bool = False

    def names(self) -> list[str]:
        """A name for each element: `eta`, or `lam_1` to `lam_10`."""
        if not self.shape:
            return [self.name]
        return [f"{self.name}_{i + self.first}" for i in range(self.size)]

    @property
    def size(self) -> int:
        """Number of elements."""
        return math.prod(self.shape)


def parameters(module: Any, path: tuple[str | int, ...] = (), prefix: str = "") -> list[Parameter]:
    """Every leaf of `module` that was declared by `parameter`, in order of declaration.

    >>> from rapi_jax import parameters
    >>> from rapi_jax.examples import paper_device
    >>> [found.name for found in parameters(paper_device().operator)]
    ['alpha', 'zeta', 'lam', 'eta', 'a', 'b', 'd', 'd_0', 'origin']
    """
    return list(_walk(module, path, prefix))


def _walk(module: Any, path: tuple[str | int, ...], prefix: str) -> Iterator[Parameter]:
    if isinstance(module, tuple | list):
        for i, item in enumerate(module):
            yield from _walk(item, (*path, i), f"{prefix}{type(item).__name__}.")
    if not dataclasses.is_dataclass(module):
        return
    for field in dataclasses.fields(module):
        value = getattr(module, field.name)
        if "unit" in field.metadata:
            m = field.metadata
            yield Parameter(
                prefix + field.name,
                (*path, field.name),
                np.shape(value),
                m["unit"],
                m["bounds"],
                m["linear"],
                m["first"],
                m["held"],
            )
        elif dataclasses.is_dataclass(value) or isinstance(value, tuple | list):
            yield from _walk(value, (*path, field.name), prefix)


def follow(module: Any, path: tuple[str | int, ...]) -> Any:
    """The value at `path`, as in `Parameter.path`."""
    for key in path:
        module = module[key] if isinstance(key, int) else getattr(module, key)
    return module
