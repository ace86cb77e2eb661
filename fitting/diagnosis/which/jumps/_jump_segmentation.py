"""A refit beside a switch whose jumps are segmented from the data: a start near the right ones.

A base that is a little off crosses a threshold at the wrong samples, and each of these costs so
much that the base adapts to them. But the data show the jumps without any base. So the base is
fitted to data less these jumps; then thresholds are put at its values where the data jump.
"""

import dataclasses

import numpy as np

from fitting.diagnosis.noise._lines import SpectralLines
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import AbstractSwitch

from ._thresholds import THRESHOLDS


def refit_at_segmented_jumps(
    refit: Refit,
    state: State,
    steps: int,
    tolerance: float | None = None,
    least_gain: float = 0.0,
) -> State | None:
    """The base and its switch at the segmented jumps; `None` for no switch, or too small a one.

    `steps`, `tolerance`, `least_gain`: see `Refit.minimise`.
    """
    for at, effect in enumerate(state.effects):
        if isinstance(effect, AbstractSwitch):
            return _refit_at(refit, state, at, effect, (steps, tolerance, least_gain))
    return None


def _refit_at(
    refit: Refit,
    state: State,
    at: int,
    switch: AbstractSwitch,
    limits: tuple[int, float | None, float],
) -> State | None:
    whitened, size = refit.whitened, float(switch.size)
    noise = [
        np.sqrt(refit.whitener.spectrum.mean_variance(SpectralLines.of(block)))
        for block in whitened.blocks
    ]
    if abs(size) < THRESHOLDS.jump_size * max(noise):
        return None
    others = (*state.effects[:at], *state.effects[at + 1 :])
    start = refit.evaluate(state.values, others)
    on = [
        _segment_switch(-e, size, b) for e, b in zip(start.errors.raw, whitened.blocks, strict=True)
    ]
    if not any(one.any() for one in on):
        return None
    blocks = [
        dataclasses.replace(block, data=block.data - size * one)
        for block, one in zip(whitened.blocks, on, strict=True)
    ]
    without_jumps = dataclasses.replace(
        refit, whitened=dataclasses.replace(whitened, blocks=blocks)
    )
    steps, tolerance, least_gain = limits
    begin = without_jumps.evaluate(state.values, others)
    end = without_jumps.minimise(begin, steps, tolerance, least_gain=least_gain)
    nu = [e + b.data for e, b in zip(end.errors.raw, blocks, strict=True)]
    run = [np.full(one.shape, k) for k, one in enumerate(on)]
    use = [block.use > 0 for block in blocks]
    flat = (
        np.concatenate([part[used] for part, used in zip(parts, use, strict=True)])
        for parts in (nu, on, run)
    )
    return refit.evaluate(
        end.values, (*end.effects[:at], switch.with_states(*flat), *end.effects[at:])
    )


def _segment_switch(residual: np.ndarray, size: float, block: PeriodBlock) -> np.ndarray:
    """Whether the switch is on at each reading, by the residual of a base without it.

    The likeliest sequence of two states that starts off (Viterbi's algorithm): differences of
    `residual` are those of the base's misfit, which are small, and plus or minus `size` where it
    switches.
    """
    flat, use = residual.ravel(), block.use.ravel() > 0
    difference = np.diff(flat[use])
    on = np.zeros(flat.size, dtype=bool)
    # Costs of being off and on, and whether the state before was the other one.
    off_cost, on_cost = 0.0, np.inf
    switched = np.zeros((difference.size, 2), dtype=bool)
    stay, up, down = difference**2, (difference - size) ** 2, (difference + size) ** 2
    for k in range(difference.size):
        to_off, to_on = off_cost + stay[k], on_cost + stay[k]
        switched_off, switched_on = on_cost + down[k], off_cost + up[k]
        switched[k] = switched_off < to_off, switched_on < to_on
        off_cost, on_cost = min(to_off, switched_off), min(to_on, switched_on)
    state = np.zeros(difference.size + 1, dtype=bool)
    state[-1] = on_cost < off_cost
    for k in range(difference.size - 1, -1, -1):
        state[k] = state[k + 1] ^ switched[k, int(state[k + 1])]
    on[np.flatnonzero(use)] = state
    return on.reshape(residual.shape)
