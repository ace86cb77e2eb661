"""What a model is, in one line; apart, so that reading a recording does not load JAX."""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from jax.core import Tracer

from ._one_line import listed


def describe_model(ecdl: Any, parameters: Sequence[Any]) -> str | None:
    """`<ECDL: RAPI of 10 plays, alpha=0.03, ...; Delay(tau=2e-05)>`.

    `None` of a model whose parameters are not numbers: traced, or a tree of something else.
    """
    parts: dict[Any, list[str]] = {"operator": []} | {k: [] for k in range(len(ecdl.effects))}
    for one in parameters:
        value: Any = ecdl
        for step in one.path:
            value = value[step] if isinstance(step, int) else getattr(value, step)
        if not isinstance(value, jax.Array | np.ndarray) or isinstance(value, Tracer):
            return None
        place = one.path[0] if one.path[0] == "operator" else one.path[1]
        numbers = listed(np.ravel(value)) if np.size(value) else ""
        text = f"[{numbers}]" if np.ndim(value) else numbers
        parts[place].append(f"{one.path[-1]}={text}")
    operator = f"{type(ecdl.operator).__name__} of {ecdl.operator.count} plays"
    around = [
        f"{type(effect).__name__}({', '.join(parts[k])})" for k, effect in enumerate(ecdl.effects)
    ]
    return f"<ECDL: {'; '.join([', '.join([operator, *parts['operator']]), *around])}>"
