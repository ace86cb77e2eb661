r"""Whether another form of an effect's mechanism explains what its equation leaves.

An effect may say which functions its mechanism adds in any form (`AbstractEffect.other_forms`).
Their sizes are linear: with a normal prior of one standard deviation they are integrated out in
closed form, beside the base and the density of plays, and the prior's deviation is that of greatest
evidence. So a set of sixty harmonics pays for each that it does not need.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import acts_before_operator
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._excess import is_unexplained
from rapi_jax.effects import AbstractEffect, Contribution

_SCALES = np.geomspace(1e-3, 1e2, 26)  # of a function's size, in units of the effect's own


def with_other_form(candidate: Candidate) -> Candidate:
    """A single effect's candidate with another form of it, where that alone explains the data.

    Else, or where noise is not known, the same.
    """
    refit, state = candidate.flexible_refit, candidate.on_flexible_base
    if len(candidate.effects) != 1 or not refit.whitener.spectrum.measured:
        return candidate
    if not is_unexplained(state):
        return candidate
    (effect,) = candidate.effects
    ends = [refit_form(refit, state, functions) for functions in _sets(effect, refit, state)]
    best = min(ends, key=lambda end: end.cost, default=state)
    if best.cost >= state.cost or is_unexplained(best):
        return candidate
    return dataclasses.replace(candidate, on_flexible_base=best, has_other_form=True)


def refit_form(
    refit: Refit, state: State, functions: list[Float[np.ndarray, "functions periods phases"]]
) -> State:
    """The state with the sizes of `functions`, by run, integrated out at the likeliest scale.

    Its errors are those of the likeliest sizes; what these cost by their prior, and the
    determinant, count as prior cost, so that its cost is that of the marginal likelihood.
    """
    synchronous, nonsynchronous = refit.whitener.whiten(functions)
    columns = np.concatenate([synchronous, nonsynchronous], axis=1)
    errors = state.errors.all
    power, turn = np.linalg.eigh(columns @ columns.T)
    power, along = np.maximum(power, 0.0), turn.T @ (columns @ errors)
    costs = []
    for scale in _SCALES:
        variance = scale**2
        gained = variance * along**2 / (1.0 + variance * power)
        costs.append(float(np.log1p(variance * power).sum() - gained.sum()))
    variance = _SCALES[int(np.argmin(costs))] ** 2
    sizes = turn @ (variance * along / (1.0 + variance * power))
    left = errors - sizes @ columns
    split = state.errors.synchronous.size
    price = float(sizes @ sizes) / variance + float(np.log1p(variance * power).sum())
    return dataclasses.replace(
        state,
        errors=state.errors._replace(synchronous=left[:split], nonsynchronous=left[split:]),
        prior_cost=state.prior_cost + price,
    )


def _sets(
    effect: AbstractEffect, refit: Refit, state: State
) -> list[list[Float[np.ndarray, "functions periods phases"]]]:
    """The effect's sets of functions, split by run; none for one that acts before the operator."""
    if acts_before_operator(effect):
        return []
    whitened = refit.whitened
    blocks = whitened.blocks
    others = tuple(one for one in state.effects if one.name != effect.name)
    added = [
        block.interpolate(row)
        for block, row in zip(
            blocks,
            whitened.response_rows(state.effects, state.operator_response)
            - whitened.response_rows(others, state.operator_response),
            strict=False,  # rows are padded to an even number of runs
        )
    ]
    here = Contribution(
        *(
            np.concatenate([part.ravel() for part in parts])
            for parts in ([b.time for b in blocks], [b.drive for b in blocks], added)
        )
    )
    ends = np.cumsum([block.size for block in blocks])[:-1]
    return [
        [
            part.reshape(len(functions), *block.time.shape) * block.use
            for part, block in zip(np.split(functions, ends, axis=1), blocks, strict=True)
        ]
        for functions in effect.other_forms(here)
    ]
