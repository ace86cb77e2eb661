r"""Whether another form of an effect's mechanism explains what its equation leaves.

An effect may say which functions its mechanism adds in any form (`AbstractEffect.other_forms`).
Their sizes are linear: with a normal prior of one standard deviation they are integrated out in
closed form, beside the base and the density of plays, and the prior's deviation is that of greatest
evidence. So a set of sixty harmonics pays for each that it does not need.
"""

import dataclasses
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.refit._effect_vector import Effects
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._effect_sets import insert_effect
from fitting.diagnosis.which._excess import is_unexplained, leaves_nonsynchronous
from fitting.diagnosis.which._thresholds import THRESHOLDS
from rapi_jax.effects import AbstractEffect, Contribution

_SCALES = np.geomspace(1e-3, 1e2, 26)  # of a function's size, in units of the effect's own


def with_other_form(candidate: Candidate, *, in_any_case: bool = False) -> Candidate:
    """A single effect's candidate with another form of it, where that alone explains the data.

    Else, or where noise is not known, the same. `in_any_case`: also where the equation leaves no
    more than a base may that is not quite the device's.
    """
    refit, state = candidate.flexible_refit, candidate.on_flexible_base
    if len(candidate.effects) != 1 or not refit.whitener.spectrum.measured:
        return candidate
    if not (in_any_case or is_unexplained(state) or leaves_nonsynchronous(state)):
        return candidate
    (effect,) = candidate.effects
    here = contribution_of(effect, refit, state)
    forms = list(effect.other_forms(here))
    best = _likeliest(forms, refit, state)
    if best.cost > state.cost - THRESHOLDS.chance_fall or is_unexplained(best):
        return candidate
    alone = _without(here.added, refit, state)
    if _likeliest(effect.rival_forms(here), refit, alone).cost < best.cost:
        return candidate
    if effect.free_of_drive and synchronous_cost(forms, refit, state) < best.cost:
        return candidate  # of another mechanism, which follows the drive
    return dataclasses.replace(candidate, on_flexible_base=best, has_other_form=True)


def refit_form(
    refit: Refit, state: State, functions: list[Float[np.ndarray, "functions _ _"]]
) -> State:
    """The state with the sizes of `functions`, by run, integrated out at the likeliest scale.

    Its errors are those of the likeliest sizes; what these cost by their prior, and the
    determinant, count as prior cost, so that its cost is that of the marginal likelihood.
    """
    synchronous, nonsynchronous = refit.whitener.whiten(functions)
    columns = np.concatenate([synchronous, nonsynchronous], axis=1)
    errors = state.errors.all
    power, turn, along = _principal(columns, errors)
    variance = _SCALES[int(np.argmin(_cost_by_scale(power, along)))] ** 2
    sizes = turn @ (variance * along / (1.0 + variance * power))
    left = errors - sizes @ columns
    split = state.errors.synchronous.size
    price = float(sizes @ sizes) / variance + float(np.log1p(variance * power).sum())
    return dataclasses.replace(
        state,
        errors=state.errors._replace(synchronous=left[:split], nonsynchronous=left[split:]),
        prior_cost=state.prior_cost + price,
    )


def _principal(
    columns: Float[np.ndarray, "functions lines"], errors: Float[np.ndarray, " lines"]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Powers of the sums of columns that are orthogonal, these sums, and the errors along them."""
    power, turn = np.linalg.eigh(columns @ columns.T)
    return np.maximum(power, 0.0), turn, turn.T @ (columns @ errors)


def _cost_by_scale(power: np.ndarray, along: np.ndarray) -> Float[np.ndarray, " scales"]:
    """What integrating the sizes out adds to the cost, for each prior deviation of `_SCALES`."""
    price = np.log1p(_SCALES[:, None] ** 2 * power)
    gained = _SCALES[:, None] ** 2 * along**2 / (1.0 + _SCALES[:, None] ** 2 * power)
    return (price - gained).sum(axis=1)


def synchronous_cost(
    sets: Iterable[Float[np.ndarray, "functions samples"]], refit: Refit, state: State
) -> float:
    """The least cost with more of the functions in what repeats with the drive than in the rest.

    What does not depend on the drive has one size in both: the base may take some of the first up,
    and then holds less of it, never more. So a prior deviation for each, the synchronous one not
    the smaller, is that of another mechanism; the second is paid for by the number of its choices.
    """
    costs = []
    for functions in sets:
        synchronous, nonsynchronous = refit.whitener.whiten(_by_run(functions, refit))
        power, _, along = _principal(synchronous, state.errors.synchronous)
        repeated = _cost_by_scale(power, along)
        power, _, along = _principal(nonsynchronous, state.errors.nonsynchronous)
        rest = _cost_by_scale(power, along)
        larger = np.minimum.accumulate(repeated[::-1])[::-1]  # the least at this scale or a larger
        gain = (repeated + rest).min() - (larger + rest).min()
        whole = refit_form(refit, state, _by_run(functions, refit)).cost
        costs.append(whole - gain + 2.0 * np.log(_SCALES.size))
    return min(costs, default=np.inf)


def _without(added: Float[np.ndarray, " samples"], refit: Refit, state: State) -> State:
    """The state without what its effect adds, at the same base."""
    synchronous, nonsynchronous = refit.whitener.whiten(_by_run(added[None], refit))
    errors = state.errors
    left = errors._replace(
        synchronous=errors.synchronous - synchronous[0],
        nonsynchronous=errors.nonsynchronous - nonsynchronous[0],
    )
    return dataclasses.replace(state, errors=left)


def _likeliest(
    sets: Iterable[Float[np.ndarray, "functions samples"]], refit: Refit, state: State
) -> State:
    """The state with the likeliest of `sets`; as it is where there is none."""
    finite = (functions for functions in sets if np.isfinite(functions).all())
    ends = (refit_form(refit, state, _by_run(functions, refit)) for functions in finite)
    return min(ends, key=lambda end: end.cost, default=state)


def _by_run(
    functions: Float[np.ndarray, "functions samples"], refit: Refit
) -> list[Float[np.ndarray, "functions _ _"]]:
    blocks = refit.whitened.blocks
    ends = np.cumsum([block.size for block in blocks])[:-1]
    return [
        part.reshape(len(functions), *block.time.shape) * block.use
        for part, block in zip(np.split(functions, ends, axis=1), blocks, strict=True)
    ]


def contribution_of(effect: AbstractEffect, refit: Refit, state: State) -> Contribution:
    """What `effect`, one of the state's, adds to its response."""
    blocks, drives = refit.whitened.blocks, refit.whitened.recording.drives
    whole = _response(refit, state.values, state.effects)
    before = _response(
        refit, state.values, tuple(one for one in state.effects if one.name != effect.name)
    )

    def beside(other: AbstractEffect) -> Float[np.ndarray, " samples"]:
        return _response(refit, state.values, insert_effect(state.effects, other)) - whole

    return Contribution(
        np.concatenate([block.time.ravel() for block in blocks]),
        np.concatenate([block.drive.ravel() for block in blocks]),
        whole - before,
        before,
        np.repeat(np.arange(len(blocks)), [block.size for block in blocks]),
        np.array([drive.rate for drive in drives]),
        beside,
    )


def _response(
    refit: Refit, values: Float[np.ndarray, " values"], effects: Effects
) -> Float[np.ndarray, " samples"]:
    """The model's response at all readings, run after run."""
    whitened = refit.whitened
    nodes = whitened.operator_response(refit.base.operator, values, effects)
    rows = whitened.response_rows(effects, nodes)
    # Rows are padded to a rounded number of runs.
    parts = zip(whitened.blocks, rows, strict=False)
    return np.concatenate([block.interpolate(row).ravel() for block, row in parts])
