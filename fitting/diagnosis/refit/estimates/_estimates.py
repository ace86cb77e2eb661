"""Parameters of effects with standard errors, from the normal matrix of a joint refit."""

from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.refit._effect_vector import (
    Effects,
    effect_values,
    free_parameters,
    with_values,
)
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._thresholds import THRESHOLDS

from ._misfit_errors import misfit_errors
from ._profile_cost import ProfileCost, scaled_inverse


def standard_errors(
    refit: Refit, state: State, *, of_jumps: bool = True
) -> Float[np.ndarray, " parameters"]:
    """One standard error of each free parameter of the effects, the operator free.

    Errors are white here. What the base leaves above the noise counts as noise of that size.
    `of_jumps`: whether those of effects that jump are worked out, which takes tenths of a second a
    parameter; else they are not a number.
    """
    matrix, _, effects = refit.normal_equations(state)
    inverse, unit = scaled_inverse(matrix)
    dispersion = max(1.0, state.synchronous / max(state.errors.synchronous.size, 1))
    variance = np.where(unit > 0, np.diag(inverse) * dispersion, np.inf)
    out = (
        np.sqrt(variance)[state.values.size :] / np.where(unit > 0, unit, 1.0)[state.values.size :]
    )
    smooth = [type(e).smooth for e in state.effects for _ in free_parameters(e)]
    if not of_jumps:
        return np.where(smooth, out, np.nan)
    if not all(smooth):
        profile = ProfileCost.of(refit, state, matrix, effects, np.array(smooth))
    for i in np.flatnonzero(~np.array(smooth, dtype=bool)):
        width = _chi_square_half_width(refit, state, profile, int(i), dispersion)
        out[i] = max(out[i] if np.isfinite(out[i]) else 0.0, width)
    return out


def effective_parameter_count(refit: Refit, state: State) -> float:
    """Effective number of parameters, base model and effects: as many as the data determine.

    A parameter that its prior holds counts in part.
    """
    matrix, _, _ = refit.normal_equations(state)
    inverse, unit = scaled_inverse(matrix)
    base = refit.base
    std = np.where(base.free & np.isfinite(base.prior_std), base.prior_std, np.inf)
    weight = np.append(std**-2.0, np.zeros(len(unit) - std.size))
    share = np.where(unit > 0, np.diag(inverse) * weight / np.where(unit > 0, unit, 1.0) ** 2, 1.0)
    return float(np.clip(1.0 - share, 0.0, 1.0).sum())


def _chi_square_half_width(
    refit: Refit, state: State, profile: ProfileCost, index: int, dispersion: float
) -> float:
    """How far a parameter goes either way before chi-square rises by one; infinite if never.

    Of an effect that jumps, since between two samples the data say nothing and a slope means
    nothing. What is smooth follows, see `ProfileCost`. The other parameters of effects that jump
    are held, or one in the same unit goes along: what is known well of a hop may be the edge on
    the way down, `threshold - width`, and not the one on the way up.
    """
    least = profile(state)
    now = effect_values(state.effects)
    units = [p.unit for e in state.effects for p in free_parameters(e)]
    smooth = [type(e).smooth for e in state.effects for _ in free_parameters(e)]
    low, high = refit.bounds(state.effects)
    finest = -float(THRESHOLDS.finest_search_exponent)
    steps = (abs(now[index]) or 1.0) * 2.0 ** np.arange(finest, 0.0)

    def is_costly(step: float, direction: np.ndarray) -> bool:
        other = now + step * direction
        if (other < low).any() or (other > high).any():
            return True
        new = refit.evaluate(state.values, with_values(state.effects, other))
        return not profile(new) < least + dispersion

    def costly_step(direction: np.ndarray) -> float:
        """The step along `direction` from which all cost one or leave the bounds; 0 if none does.

        Chi-square is jagged there: a step that costs one may have a larger one behind it that does
        not, as a sample more comes to lie by its level.
        """
        beyond = 0.0
        for step in steps[::-1]:
            if not is_costly(step, direction):
                break
            beyond = float(step)
        return beyond

    axes = np.eye(now.size)
    alone = axes[index]
    out = max(costly_step(alone), costly_step(-alone))
    if out == 0.0:
        return np.inf
    for j in range(now.size):
        if j != index and units[j] == units[index] and not smooth[j]:
            directions = (alone + axes[j], alone - axes[j], axes[j] - alone, -alone - axes[j])
            out = max(out, *(costly_step(direction) for direction in directions))
    return out


def estimate_effects(
    refit: Refit,
    state: State,
    unit: str,
    drive_unit: str,
    *,
    of_jumps: bool = True,
    on_other_base: Effects | None = None,
) -> dict[str, dict[str, Any]]:
    """`{name: {value, stderr, unit}}`; with several effects names carry the effect's.

    `of_jumps`: see `standard_errors`. `on_other_base`: the effects as another base has them, where
    the base misfits; then what that adds is a part of the errors of effects without jumps.
    """
    errors = standard_errors(refit, state, of_jumps=of_jumps)
    if on_other_base is not None:
        smooth = [type(e).smooth for e in state.effects for _ in free_parameters(e)]
        larger = np.fmax(errors, misfit_errors(refit, state, on_other_base))
        errors = np.where(smooth, larger, errors)
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
