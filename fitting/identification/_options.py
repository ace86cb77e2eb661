"""Options of a fit: what it frees unless told, how far it is driven, where it reports to."""

from collections.abc import Callable
from typing import Any

from fitting.solver._least_squares import SolverOptions
from rapi_jax import ECDL, Recording, parameters

from ._thresholds import THRESHOLDS

Progress = Callable[[str], None]


def default_free(ecdl: ECDL, recording: Recording) -> Callable[[ECDL], Any]:
    """What a fit frees unless told: the operator, less what these data cannot tell from the rest.

    See the operator's `held`.
    """
    held = ecdl.operator.held(recording)
    names = [p.name for p in parameters(ecdl.operator) if not p.held and p.name not in held]
    return lambda e: tuple(getattr(e.operator, name) for name in names)


def solver_options(max_steps: int) -> SolverOptions:
    """How far fits of models are driven."""
    return SolverOptions(
        THRESHOLDS.solver_tolerance, THRESHOLDS.solver_slope, max_steps, THRESHOLDS.solver_promise
    )
