"""What the project may not have yet: where it is, the suite measures it; where not, it says so."""

import importlib
from collections.abc import Callable, Sequence
from typing import Any

from ._cases import Case
from ._ours import SETTINGS

NOT_YET = "not available yet"

# Where each is looked for: (module, name).
BATCH_FIT = ("fitting", "fit_many")  # (starts, recordings, **as `fit`) -> results


def found(place: tuple[str, str]) -> Callable[..., Any] | None:
    """The function of that name, or `None`."""
    module, name = place
    try:
        return getattr(importlib.import_module(module), name, None)
    except ModuleNotFoundError as error:
        if error.name != module:
            raise
        return None


def batch_fit() -> Callable[[Sequence[Case]], Any] | None:
    """Fits of many recordings in one call, if there is such a function."""
    function = found(BATCH_FIT)
    if function is None:
        return None
    return lambda cases: function(
        [case.start for case in cases], [case.recording for case in cases], **SETTINGS
    )
