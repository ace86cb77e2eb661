"""Linear effects behind the operator, applied to its derivatives by their transfer functions."""

from collections.abc import Sequence
from typing import TypeGuard

import numpy as np
from jaxtyping import Complex, Float

from fitting.diagnosis.noise._periods import PeriodBlock
from rapi_jax.effects import AbstractEffect, AbstractLinearEffect
from rapi_jax.internal import LinearPath

from ._compiled_stages import acts_before_operator
from ._effect_vector import Effects


def is_linear(effect: AbstractEffect) -> TypeGuard[AbstractLinearEffect]:
    """Whether the effect, behind the operator, is given by its transfer function."""
    return not acts_before_operator(effect) and isinstance(effect, AbstractLinearEffect)


def linear_path(effects: Effects, blocks: Sequence[PeriodBlock]) -> LinearPath | None:
    """What the linear ones of `effects` do, one after the other; `None` where there is none."""
    linear = [effect for effect in effects if isinstance(effect, AbstractLinearEffect)]
    if not linear:
        return None
    hertz = [np.fft.rfftfreq(block.size, block.step_s) for block in blocks]
    transfer = [np.prod([effect.transfer(f) for effect in linear], axis=0) for f in hertz]
    return LinearPath(tuple(block.size for block in blocks), tuple(transfer))


def transfer_function(
    effects: Sequence[AbstractLinearEffect], block: PeriodBlock
) -> Complex[np.ndarray, " lines"]:
    """Of all effects, one after the other, at the lines of `apply_transfer_functions`."""
    hertz = np.fft.rfftfreq(_points(block), block.step_s)
    return np.prod([np.asarray(effect.transfer(hertz)) for effect in effects], axis=0)


def apply_transfer_function(
    transfer: Complex[np.ndarray, " lines"],
    values: Float[np.ndarray, "columns phases"],
    block: PeriodBlock,
) -> Float[np.ndarray, "columns phases"]:
    """Periods behind linear effects; a run that does not repeat starts from rest."""
    size, count = values.shape[1], _points(block)
    first = np.zeros((len(values), 1)) if block.repeats else values[:, :1]
    line = np.fft.rfft(values - first, count, axis=1) * transfer
    return np.fft.irfft(line, count, axis=1)[:, :size] + first


def _points(block: PeriodBlock) -> int:
    """Phases of a period; of a run that does not repeat twice as many, so that nothing wraps."""
    return block.phases if block.repeats else 2 * block.phases
