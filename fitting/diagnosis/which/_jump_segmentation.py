"""A base beside a switch: fitted first with the jumps at the times at which the data show them.

A base that is a little off crosses a threshold at the wrong samples, and each of these costs so
much that the base bends to put them right and stays bent. When it jumped, though, the data show
without any base. So the base is fitted to data less these jumps; then thresholds are put where that
base is when the data jump.
"""

import dataclasses

import numpy as np

from fitting.diagnosis.noise._lines import SpectralLines
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import AbstractSwitch

_CLEAR = 5.0  # standard deviations of a reading, that a jump must have to show by itself


def refit_at_segmented_jumps(
    refit: Refit, state: State, steps: int, share: float = 1e-4
) -> State | None:
    """A base and its switch, as above; `None` for no switch, or one too small to show.

    `steps`, `share`: of a descent, see `Refit.descend`.
    """
    for at, effect in enumerate(state.effects):
        if isinstance(effect, AbstractSwitch):
            return _placed(refit, state, at, effect, steps, share)
    return None


def _placed(
    refit: Refit, state: State, at: int, switch: AbstractSwitch, steps: int, share: float
) -> State | None:
    whitened, size = refit.whitened, float(switch.size)
    noise = [
        np.sqrt(refit.whitener.spectrum.mean_variance(SpectralLines.of(block)))
        for block in whitened.blocks
    ]
    if abs(size) < _CLEAR * max(noise):
        return None
    others = (*state.effects[:at], *state.effects[at + 1 :])
    start = refit.evaluate(state.values, others)
    on = [_on(-e, size, b) for e, b in zip(start.errors.raw, whitened.blocks, strict=True)]
    if not any(one.any() for one in on):
        return None
    blocks = [
        dataclasses.replace(block, data=block.data - size * one)
        for block, one in zip(whitened.blocks, on, strict=True)
    ]
    quiet = dataclasses.replace(refit, whitened=dataclasses.replace(whitened, blocks=blocks))
    end = quiet.minimise(quiet.evaluate(state.values, others), steps, share)
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


def _on(rest: np.ndarray, size: float, block: PeriodBlock) -> np.ndarray:
    """Whether the switch is on at each reading, by the jumps of what a base without it leaves.

    The likeliest history that begins off: changes of `rest` from one reading to the next are those
    of a base's misfit, which are small, and plus or minus `size` where it switches.
    """
    flat, use = rest.ravel(), block.use.ravel() > 0
    leap = np.diff(flat[use])
    on = np.zeros(flat.size, dtype=bool)
    # Costs of being off and on; where it came from: 0 stayed, 1 switched.
    off_cost, on_cost = 0.0, np.inf
    came = np.zeros((leap.size, 2), dtype=bool)
    stay, up, down = leap**2, (leap - size) ** 2, (leap + size) ** 2
    for k in range(leap.size):
        to_off, to_on = off_cost + stay[k], on_cost + stay[k]
        switched_off, switched_on = on_cost + down[k], off_cost + up[k]
        came[k] = switched_off < to_off, switched_on < to_on
        off_cost, on_cost = min(to_off, switched_off), min(to_on, switched_on)
    state = np.zeros(leap.size + 1, dtype=bool)
    state[-1] = on_cost < off_cost
    for k in range(leap.size - 1, -1, -1):
        state[k] = state[k + 1] ^ came[k, int(state[k + 1])]
    on[np.flatnonzero(use)] = state
    return on.reshape(rest.shape)
