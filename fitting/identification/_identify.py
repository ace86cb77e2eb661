"""`identify`: the fit a laboratory asks for, from a recording alone."""

from typing import Any

from rapi_jax import Recording

from ._fit import Progress
from ._model_order import choose_order
from ._result import FitResult, UntrustedFit


def identify(
    recording: Recording,
    *,
    plays: int = 10,
    order: int = 3,
    each: tuple[str, ...] | None = None,
    choose: bool = False,
    throw: bool = True,
    progress: Progress | None = None,
    **options: Any,
) -> FitResult:
    """Identify an RA-PI model from `recording`: first guess, fit, standard errors, verdict.

    `plays` is N1, `order` N2. `each` names what has a value for each play; by default both a shared
    `lam` and one for each play are fitted, and held-out data choose; with `choose` they choose
    among several `plays` and `order` too. `options` are those of `fit`.
    """
    structures = ((), ("lam",)) if each is None else (each,)
    sizes: dict[str, Any] = {} if choose else {"plays": (plays,), "order": (order,)}
    choice, *_ = choose_order(recording, each=structures, progress=progress, **sizes, **options)
    result = choice.result
    if throw and not result.verdict.trusted:
        raise UntrustedFit(result)
    return result
