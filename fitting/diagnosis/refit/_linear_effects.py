"""Linear effects behind the operator, applied to its derivatives by their transfer functions."""

from collections.abc import Sequence
from typing import TypeGuard

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._periods import PeriodBlock
from rapi_jax.effects import AbstractEffect, AbstractLinearEffect

from ._compiled_stages import acts_before_operator


def is_linear(effect: AbstractEffect) -> TypeGuard[AbstractLinearEffect]:
    """Whether the effect, behind the operator, is given by its transfer function."""
    return not acts_before_operator(effect) and isinstance(effect, AbstractLinearEffect)


def apply_transfer_functions(
    effects: Sequence[AbstractLinearEffect],
    values: Float[np.ndarray, "columns phases"],
    block: PeriodBlock,
) -> Float[np.ndarray, "columns phases"]:
    """Periods behind linear effects; a run that does not repeat starts from rest."""
    size = values.shape[1]
    first = np.zeros((len(values), 1)) if block.repeats else values[:, :1]
    count = size if block.repeats else 2 * size
    line = np.fft.rfft(values - first, count, axis=1)
    hertz = np.fft.rfftfreq(count, block.step_s)
    for effect in effects:
        line *= effect.transfer(hertz)[None, :]
    return np.fft.irfft(line, count, axis=1)[:, :size] + first
