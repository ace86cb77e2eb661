"""Parameters of effects with standard errors, from the normal matrix of a joint refit."""

from typing import Any

import numpy as np

from ._effect_vector import effect_values, free_parameters, with_values
from ._gauss_newton import Refit, State


def standard_errors(refit: Refit, state: State) -> np.ndarray:
    """One standard error of each moved parameter of the effects, the operator free.

    Errors are white here. What the base leaves above the noise counts as noise of that size.
    """
    full, _, _ = refit.gram(state)
    inverse, unit = _inverse(full)
    wide = max(1.0, state.synchronous / max(state.errors.synchronous.size, 1))
    variance = np.where(unit > 0, np.diag(inverse) * wide, np.inf)
    out = (
        np.sqrt(variance)[state.values.size :] / np.where(unit > 0, unit, 1.0)[state.values.size :]
    )
    smooth = [type(e).smooth for e in state.effects for _ in free_parameters(e)]
    for i in np.flatnonzero(~np.array(smooth, dtype=bool)):
        out[i] = max(out[i] if np.isfinite(out[i]) else 0.0, _reach(refit, state, int(i), wide))
    return out


def determined(refit: Refit, state: State) -> float:
    """How many of the operator's values and the effects' parameters the data determine.

    What priors hold counts in part.
    """
    full, _, _ = refit.gram(state)
    inverse, unit = _inverse(full)
    prior = np.where(refit.base.free & np.isfinite(refit.base.prior), refit.base.prior, np.inf)
    weight = np.append(prior**-2.0, np.zeros(len(unit) - prior.size))
    share = np.where(unit > 0, np.diag(inverse) * weight / np.where(unit > 0, unit, 1.0) ** 2, 1.0)
    return float(np.clip(1.0 - share, 0.0, 1.0).sum())


def _inverse(full: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The inverse of a normal matrix scaled to a unit diagonal, and the units; 0 where it says
    nothing.
    """
    unit = np.sqrt(np.diag(full))
    alive = unit > 0
    length = np.where(alive, unit, 1.0)
    scaled = full / length[:, None] / length[None, :] + np.diag(np.where(alive, 0.0, 1.0))
    size, vectors = np.linalg.eigh(scaled)
    kept = size > 1e-12 * size.max()
    return (vectors[:, kept] / size[kept]) @ vectors[:, kept].T, unit


def _reach(refit: Refit, state: State, index: int, wide: float) -> float:
    """How far a parameter goes either way before chi-square rises by one; infinite if never.

    Of an effect that jumps: between two samples the data say nothing, and a slope means nothing.
    The others are held, or one in the same unit goes along: what is known well of a hop may be the
    edge on the way down, `threshold - width`, and not the one on the way up.
    """
    now = effect_values(state.effects)
    units = [p.unit for e in state.effects for p in free_parameters(e)]
    smooth = [type(e).smooth for e in state.effects for _ in free_parameters(e)]
    low, high = refit.edges(state.effects)
    steps = (abs(now[index]) or 1.0) * 2.0 ** np.arange(-24.0, 0.0)

    def rise(way: np.ndarray) -> float:
        """The first step along `way` that costs one or leaves the bounds; 0 if none does."""
        for step in steps:
            other = now + step * way
            if (other < low).any() or (other > high).any():
                return float(step)
            new = refit.at(state.values, with_values(state.effects, other))
            if not new.cost < state.cost + wide:
                return float(step)
        return 0.0

    axes = np.eye(now.size)
    alone = axes[index]
    out = max(rise(alone), rise(-alone))
    if out == 0.0:
        return np.inf
    for j in range(now.size):
        if j != index and units[j] == units[index] and not smooth[j]:
            ways = (alone + axes[j], alone - axes[j], axes[j] - alone, -alone - axes[j])
            out = max(out, *(rise(way) for way in ways))
    return out


def estimate_effects(
    refit: Refit, state: State, unit: str, drive_unit: str
) -> dict[str, dict[str, Any]]:
    """`{name: {value, stderr, unit}}`; with several effects names carry the effect's."""
    errors = standard_errors(refit, state)
    values = effect_values(state.effects)
    several = len(state.effects) > 1
    out, at = {}, 0
    for effect in state.effects:
        for p in free_parameters(effect):
            name = f"{effect.name}.{p.path[-1]}" if several else str(p.path[-1])
            out[name] = {
                "value": float(values[at]),
                "stderr": float(errors[at]),
                "unit": p.unit.format(x=unit, u=drive_unit),
            }
            at += 1
    return out
