"""A column of a run: numbers in one dimension, checked, that nothing changes afterwards."""

from typing import Any

import numpy as np

from rapi_jax._errors import DataError


def checked_column(name: str, value: Any, *, finite: bool = True) -> np.ndarray:
    array = np.array(value, dtype=np.float64)
    if array.ndim != 1:
        raise DataError(f"`{name}` must be one column of numbers, but has shape {array.shape}.")
    bad = np.flatnonzero(~np.isfinite(array))
    if finite and bad.size:
        raise DataError(
            f"`{name}` has {bad.size} value(s) that are not finite, the first ({array[bad[0]]}) at "
            f"sample {bad[0]}. A drive or a clock is never guessed: export the record again."
        )
    array.flags.writeable = False
    return array
