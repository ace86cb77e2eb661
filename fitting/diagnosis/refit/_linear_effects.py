"""Linear effects behind the operator as transfer functions, on one period of a run."""

from collections.abc import Callable, Sequence

import jax
import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._periods import PeriodBlock
from rapi_jax.effects import AbstractEffect, AbstractLinearEffect, Delay, Modes
from rapi_jax.effects._base import transfer

from ._compiled_stages import acts_before_operator

TransferFunction = Callable[[np.ndarray], np.ndarray]


def is_linear(effect: AbstractEffect) -> bool:
    """Whether the effect, behind the operator, is given by its transfer function."""
    return not acts_before_operator(effect) and isinstance(effect, AbstractLinearEffect | Delay)


@jax.jit
def _modes(effect: AbstractLinearEffect) -> Modes:
    return effect.modes()


def transfer_function(effect: AbstractEffect) -> TransferFunction:
    """The transfer function of a linear effect, of frequencies in Hz."""
    if isinstance(effect, Delay):
        tau = float(effect.tau)
        return lambda hertz: np.exp(-2j * np.pi * hertz * tau)
    assert isinstance(effect, AbstractLinearEffect)  # noqa: S101 (see `is_linear`)
    modes = jax.tree_util.tree_map(np.asarray, _modes(effect))
    return lambda hertz: np.asarray(transfer(modes, hertz))


def apply_transfer_functions(
    transfers: Sequence[TransferFunction],
    values: Float[np.ndarray, "columns phases"],
    block: PeriodBlock,
) -> Float[np.ndarray, "columns phases"]:
    """Periods behind linear effects; a run that does not repeat starts from rest."""
    size = values.shape[1]
    first = np.zeros((len(values), 1)) if block.repeats else values[:, :1]
    count = size if block.repeats else 2 * size
    line = np.fft.rfft(values - first, count, axis=1)
    hertz = np.fft.rfftfreq(count, block.step_s)
    for gain in transfers:
        line *= gain(hertz)[None, :]
    return np.fft.irfft(line, count, axis=1)[:, :size] + first
