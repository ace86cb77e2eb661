"""Estimation: from recordings to models, with a verdict on whether to trust them.

Names load when first used, so that the command line can answer `--help` without JAX.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._fit import fit as fit
    from ._identify import identify as identify
    from ._inverse import identify_inverse as identify_inverse
    from ._least_squares import LeastSquares as LeastSquares
    from ._least_squares import least_squares as least_squares
    from ._order import Choice as Choice
    from ._order import choose_order as choose_order
    from ._result import Estimate as Estimate
    from ._result import FitResult as FitResult
    from ._result import UntrustedFit as UntrustedFit
    from ._swap import swap as swap
    from ._verdict import Verdict as Verdict
    from ._weights import hysteresis_weights as hysteresis_weights
    from .diagnosis import Diagnosis as Diagnosis
    from .diagnosis import diagnose as diagnose

_HOME = {
    "Choice": "_order",
    "Diagnosis": "diagnosis",
    "Estimate": "_result",
    "FitResult": "_result",
    "LeastSquares": "_least_squares",
    "UntrustedFit": "_result",
    "Verdict": "_verdict",
    "choose_order": "_order",
    "diagnose": "diagnosis",
    "fit": "_fit",
    "hysteresis_weights": "_weights",
    "identify": "_identify",
    "identify_inverse": "_inverse",
    "least_squares": "_least_squares",
    "swap": "_swap",
}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
