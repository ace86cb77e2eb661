"""A flexible operator: a richer hysteresis than the one identified, with many plays; its refits.

It predicts, as a density of plays does not; where noise is unknown it is the flexible base.
"""

import dataclasses

import numpy as np

from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._effect_vector import Effects
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.jumps._jump_search import search_jump_parameters
from fitting.identification._parameter_vector import as_device
from rapi_jax import parameters

from ._effect_refit import refit_beside_jumps


def flexible_operator(
    whitened: WhitenedModel, base: BaseModel, values: np.ndarray
) -> BaseModel | None:
    """The flexible form of the operator at `values`, with priors about where it begins.

    It begins as the same function of the drive. `None` for an operator that has no such form.
    """
    form = whitened.set_values(base.operator, values).flexible(whitened.recording)
    if form is None:
        return None
    richer = BaseModel.of(whitened, form.operator)
    prior, at = richer.prior_std.copy(), 0
    for p in parameters(form.operator):
        if p.name in form.deviations:
            prior[at : at + p.size] = form.deviations[p.name]
        at += p.size
    prior[at:] = THRESHOLDS.initial_prior
    return dataclasses.replace(richer, prior_std=prior).with_fixed(*form.held)


def refit_flexible_operator(
    refit: Refit, on_base: State, effects: Effects | None = None, *, search: bool = True
) -> tuple[Refit, State]:
    """The flexible operator about `on_base`; with its effects, or `effects` if these leave less.

    `search`: whether jumps are looked for anew, which is not needed where `effects` have them.
    """
    flexible, values = _flexible_about(refit, on_base)
    starts = [flexible.evaluate(values, on_base.effects)]
    if effects is not None:
        starts.append(flexible.evaluate(values, effects))
    start = min((s for s in starts if np.isfinite(s.cost)), key=_cost, default=starts[0])
    if not search:
        steps, tolerance = THRESHOLDS.flexible_steps, THRESHOLDS.flexible_tolerance
        least = THRESHOLDS.predictor_least_gain * flexible.whitener.used_lines
        return flexible, refit_beside_jumps(flexible, start, steps, tolerance, least)
    end = refit_and_search(flexible, start, on_base.cost)
    if _misfits(end) and follows_drive(flexible, end):
        longer = refit_and_search(flexible, end, on_base.cost, THRESHOLDS.alone_steps)
        if follows_drive(flexible, longer):
            return flexible, longer
    return flexible, end


def follows_drive(refit: Refit, state: State) -> bool:
    """Whether the response turns where the drive turns, as hysteresis does and a lag does not.

    Right after a turn no play moves, and the slope is the polynomial's. Where that runs against the
    drive, plays with negative weights or narrow thresholds draw what a lag does.
    """
    operator = refit.whitened.set_values(refit.base.operator, state.values)
    coefficients = np.asarray(operator.coefficients, dtype=float)
    slope = np.polynomial.Polynomial([0.0, *coefficients]).deriv()
    runs = refit.whitened.recording.runs
    ends = [(float(run.drive.value.min()), float(run.drive.value.max())) for run in runs]
    after_turns = slope(np.asarray(operator.centred(as_device(np.ravel(ends)))))
    rises = [np.cov(run.drive.value[run.valid], run.response[run.valid])[0, 1] for run in runs]
    return bool((after_turns * np.sign(sum(rises)) >= 0.0).all())


def refit_from_either(
    refit: Refit, on_base: State, without: tuple[Refit, State]
) -> tuple[Refit, State]:
    """A flexible operator with the effects of `on_base`: about it, or from the one without them.

    The better of the starts is refitted; the next only where the first ends above it.
    """
    flexible, values = _flexible_about(refit, on_base)
    other, before = without
    starts = [
        (flexible, flexible.evaluate(values, on_base.effects)),
        (other, other.evaluate(before.values, on_base.effects)),
    ]
    starts = sorted((s for s in starts if np.isfinite(s[1].cost)), key=lambda s: s[1].cost)
    first, state = starts[0]
    end = refit_and_search(first, state, before.cost)
    # A base that was fitted to a jump costs much beside it at first, and may be the better start.
    jumps = not all(type(effect).smooth for effect in on_base.effects)
    promising = len(starts) > 1 and (
        jumps or starts[1][1].cost < THRESHOLDS.second_start_cost * end.cost
    )
    if promising and _misfits(end):
        second = refit_and_search(*starts[1], before.cost)
        if second.cost < end.cost:
            return starts[1][0], second
    return first, end


def refit_and_search(
    refit: Refit, state: State, cost_without: float, steps: int = THRESHOLDS.flexible_steps
) -> State:
    """A refit on the flexible base; where an effect jumps, with another search for its position.

    On the base itself the position was fitted to what its misfit left. At most `steps` each.
    """
    tolerance = THRESHOLDS.flexible_tolerance
    end = refit_beside_jumps(refit, state, steps, tolerance)
    if all(type(effect).smooth for effect in end.effects):
        return end
    for _ in range(THRESHOLDS.jump_rounds):
        if not _misfits(end):
            break
        before = end
        searched = search_jump_parameters(refit, end, cost_without)
        end = refit_beside_jumps(refit, searched, steps, tolerance)
        if before.cost - end.cost < THRESHOLDS.flexible_round_gain * before.cost:
            break
    return end


def _flexible_about(refit: Refit, on_base: State) -> tuple[Refit, np.ndarray]:
    """The problem with the flexible form of the operator at `on_base`, and where it begins."""
    base = flexible_operator(refit.whitened, refit.base, on_base.values)
    if base is None:
        return refit, on_base.values
    return dataclasses.replace(refit, base=base), base.prior_mean


def _cost(state: State) -> float:
    return state.cost


def _misfits(state: State) -> bool:
    """Whether more of the synchronous part is left than noise and chance."""
    return state.synchronous > THRESHOLDS.flexible_misfit * state.errors.synchronous.size
