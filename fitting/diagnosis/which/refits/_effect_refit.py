"""Joint refits of the base and one more effect, from the initial guesses that screening ranks best.

A short refit ranks the effects; a full one follows where the short one is promising.
"""

import dataclasses

import numpy as np

from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._excess import is_competitive
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.jumps._jump_search import search_jump_parameters
from fitting.diagnosis.which.jumps._jump_segmentation import refit_at_segmented_jumps
from fitting.diagnosis.which.screening._screen import Screened
from rapi_jax import parameters


def short_refit(
    refit: Refit, state: State, screened: list[Screened], best: State | None = None
) -> State | None:
    """The best of a few steps from each of an effect's most promising guesses.

    `best`: of another effect; beside it an effect whose first guess explains far less has no other.
    """
    return _refit_guesses(refit, state, screened, THRESHOLDS.short_steps, best)


def full_refit(refit: Refit, start: State, cost_without: float) -> State:
    """The joint refit of the operator with one more effect, from a short refit.

    `cost_without`: chi-square without the effect.
    """
    return _refit_to_convergence(refit, refit, start, cost_without)


def free_eta(refit: Refit, eta_fixed: State) -> State:
    """The refit with all of the operator free, from one with `eta` held."""
    return refit.minimise(eta_fixed, THRESHOLDS.free_eta_steps)


def refit_without_plays(
    without: tuple[Refit, State], screened: list[Screened], best: State | None
) -> State | None:
    """One effect beside the polynomial alone, from its most promising guesses.

    At one rate a lag and a loop look alike, and a refit that starts with the loop keeps it.
    `without`: see `refit_without_hysteresis`. `best`: of another effect, see `short_refit`.
    """
    steps = THRESHOLDS.long_short_factor * THRESHOLDS.short_steps
    return _refit_guesses(*without, screened, steps, best)


def refit_with_plays(refit: Refit, start: State) -> State:
    """A joint refit from `refit_without_plays`; in full, as any other, where it is promising."""
    return refit.minimise(start, THRESHOLDS.long_short_factor * THRESHOLDS.short_steps)


def refit_without_hysteresis(refit: Refit, state: State) -> tuple[Refit, State] | None:
    """The operator with next to no hysteresis, only its polynomial free.

    `None` for an operator whose hysteresis cannot fade.
    """
    base, at = refit.base, 0
    operator = base.operator
    if operator.amplitude is None:
        return None
    values, free = state.values.copy(), np.zeros(state.values.size, dtype=bool)
    for p in parameters(operator):
        part = slice(at, at + p.size)
        if p.name == operator.amplitude:
            values[part] *= THRESHOLDS.initial_weight
        free[part] = p.linear
        at += p.size
    polynomial = dataclasses.replace(refit, base=dataclasses.replace(base, free=free & base.free))
    start = polynomial.evaluate(values, state.effects)
    return polynomial, polynomial.minimise(start, THRESHOLDS.polynomial_steps)


def refit_beside_jumps(
    refit: Refit,
    state: State,
    steps: int,
    tolerance: float | None = None,
    least_gain: float = 0.0,
) -> State:
    """A refit; beside an effect that jumps, first of the base and the jump's size alone.

    Derivatives by the position of a jump mean little, and would keep the base from moving.
    `tolerance`, `least_gain`: see `Refit.minimise`.
    """
    if not all(type(effect).smooth for effect in state.effects):
        state = _refit_base_and_size(refit, state, steps, tolerance, least_gain)
    return refit.minimise(state, steps, tolerance, least_gain=least_gain)


def _refit_guesses(
    refit: Refit,
    state: State,
    screened: list[Screened],
    steps: int,
    best: State | None = None,
) -> State | None:
    if not screened:  # with as many values as the data hold, no effect leaves anything to see
        return None
    refitted = []
    long_steps = THRESHOLDS.long_short_factor * THRESHOLDS.short_steps
    for one in _distinct_guesses(screened):
        start = refit.evaluate(state.values, one.beside(state.effects))
        if not np.isfinite(start.cost):
            continue
        if not type(one.effect).smooth:  # the grid found the jump; the base has not adapted to it
            start = _refit_base_and_size(refit, start, long_steps)
        refitted.append(refit.minimise(start, steps))
        share = THRESHOLDS.full_refit_fall
        if best is not None and not is_competitive(refitted[-1], best, state, share):
            break
    if not refitted:
        return None
    # Beside a base that is far off, its misfit acts as noise on the synchronous part: weigh it so.
    misfit = max(1.0, min(end.synchronous / end.errors.synchronous.size for end in refitted))
    return min(refitted, key=lambda end: end.cost + (1.0 / misfit - 1.0) * end.synchronous)


def _refit_to_convergence(search: Refit, refit: Refit, state: State, cost_without: float) -> State:
    smooth = all(type(effect).smooth for effect in state.effects)
    for _ in range(1 if smooth else THRESHOLDS.jump_rounds):
        before = state.cost
        if not smooth:
            state = search_jump_parameters(search, state, cost_without)
        state = refit_beside_jumps(refit, state, THRESHOLDS.full_steps)
        if before - state.cost < THRESHOLDS.jump_round_gain * before:
            break
    return state


def _refit_base_and_size(
    refit: Refit,
    state: State,
    steps: int,
    tolerance: float | None = None,
    least_gain: float = 0.0,
) -> State:
    """The base beside jumps that stay in place: from `state`, or from jumps segmented in the data.

    The better of the two.
    """
    fixed = dataclasses.replace(refit, freeze_jumps=True)
    refitted = [fixed.minimise(state, steps, tolerance, least_gain=least_gain)]
    segmented = refit_at_segmented_jumps(fixed, state, steps, tolerance, least_gain)
    if segmented is not None and np.isfinite(segmented.cost):
        refitted.append(fixed.minimise(segmented, steps, tolerance, least_gain=least_gain))
    return min(refitted, key=lambda end: end.cost)


def _distinct_guesses(screened: list[Screened]) -> list[Screened]:
    """The best by the score on the flexible base, and the best few by the score on the base.

    And the one that leaves least as it stands: where an effect is far from linear in its
    parameters, a guess whose signature points the right way may be too far off to converge.
    Guesses with parallel signatures count once: else a few slow lags of creep would be all that is
    tried. Beside a guess that was refitted there, and explains more than chance, one is enough.
    """
    told = any(one.refined and one.flexible_score > THRESHOLDS.chance_fall for one in screened)
    few = 1 if told else THRESHOLDS.refitted_guesses
    best: list[Screened] = []
    for one in screened:
        if len(best) == few:
            break
        if not any(one.is_parallel(other) for other in best):
            best.append(one)
    first = max(screened, key=lambda guess: guess.flexible_score)
    found = [first, *best, min(screened, key=lambda guess: guess.cost)]
    return [one for k, one in enumerate(found) if all(one is not other for other in found[:k])]
