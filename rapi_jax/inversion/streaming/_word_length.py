"""What a word length costs: how far drive and scan are off from those of real numbers."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike, Float

from rapi_jax._precision import float64

from ._compensator import StreamingCompensator
from ._fixed_point import FixedPointCompensator
from ._operator import StreamingOperator


class WordLengthError(NamedTuple):
    """The largest errors over a stream of targets, in words of `bits` bits.

    - `drive`: from the drive of `StreamingCompensator`, drive unit (V).
    - `response`: from the target, of the response that the model gives to the drive of words,
      response unit (GHz).
    - `iterations`: per sample, the same for all. `widest`: bits of the widest intermediate.
    """

    bits: int
    drive: float
    response: float
    iterations: int
    widest: int


@float64
def word_length_errors(
    compensator: StreamingCompensator,
    targets: Float[ArrayLike, " time"],
    *,
    bits: Iterable[int] = range(12, 33),
) -> tuple[WordLengthError, ...]:
    """The errors over `targets` for each word length in `bits`.

    Raises `ValueError` for one that `FixedPointCompensator` refuses.

    >>> import numpy as np
    >>> from rapi_jax import StreamingCompensator, word_length_errors
    >>> from rapi_jax.examples import paper_device
    >>> stream = StreamingCompensator.of(paper_device(), 10.0, within=(0.75, 5.25))
    >>> wanted = 50.0 + 10.0 * np.sin(np.linspace(0.0, 6.0, 50))  # GHz
    >>> short, long = word_length_errors(stream, wanted, bits=(16, 24))
    >>> short.drive > 10 * long.drive
    True
    """
    targets = np.asarray(targets, float)
    _, exact = compensator.run(targets)
    model = StreamingOperator(compensator.frozen, compensator.low)
    found = []
    for length in bits:
        fixed = FixedPointCompensator.of(compensator, bits=length)
        _, drive = fixed.run(targets)
        _, response = model.run(drive)
        found.append(
            WordLengthError(
                int(length),
                float(np.abs(np.asarray(drive) - np.asarray(exact)).max()),
                float(np.abs(np.asarray(response) - targets).max()),
                int(fixed.iterations),
                int(fixed.widest),
            )
        )
    return tuple(found)
