"""Whether runs with an origin of their own explain more than any effect: a fault, not a drift.

Readings that lie apart before or after an instant may be a drift of the device, or a zero that was
set anew between two runs. A drift also moves within the runs.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.mechanism._other_form import with_other_form
from fitting.diagnosis.noise._whitening import Whitener
from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks.runs._change_fault import (
    DIFFERS_WITH_TIME,
    runs_apart_in_time,
)
from rapi_jax import AbstractOperator

from ._base import FittedBase, fit_starts, with_all_free
from ._forward_selection import Attribution, without_effects
from ._thresholds import THRESHOLDS


def in_any_form(attribution: Attribution, found: Sequence[Fault]) -> Attribution:
    """The same with single effects in another form, where one is likelier and runs lie apart.

    A drift that wanders leaves little beside an exponential where runs are short, and then runs
    would seem to have origins of their own.
    """
    if all(fault.kind != DIFFERS_WITH_TIME for fault in found):
        return attribution
    every = [with_other_form(one, in_any_case=True) for one in attribution.candidates]
    return Attribution(attribution.none, tuple(sorted(every, key=lambda one: one.cost)))


def faults_of_origin(
    fitted: FittedBase, attribution: Attribution, found: Sequence[Fault]
) -> list[Fault]:
    """Of the faults `found` that a drift may explain those that an origin of some runs does better.

    Fitted on the base that `attribution` stands on.
    """
    recording = fitted.refit.whitened.recording
    return [
        fault
        for fault in found
        if fault.kind == DIFFERS_WITH_TIME
        and _have_own_origin(fitted, attribution, runs_apart_in_time(recording, fault))
    ]


def _have_own_origin(fitted: FittedBase, attribution: Attribution, runs: Sequence[int]) -> bool:
    """Whether an origin of its own for each of `runs`, and no effect, is likelier than any answer.

    By chi-square with the price of each origin (twice the logarithm of the response's span over
    what is known of it, as evidence has it), and of the best answer's parameters.
    """
    refit, effects = fitted.refit, fitted.state.effects
    whitened, own = refit.whitened, np.zeros(len(refit.whitened.blocks), dtype=bool)
    own[list(runs)] = True
    whitener = Whitener(whitened.blocks, refit.whitener.spectrum, own | whitened.own_origin)
    starts = [fitted.operator, *_guesses(fitted)]  # what origins have bent may not find back
    held, start = fit_starts(whitened, starts, effects, whitener.spectrum, whitener=whitener)
    free = with_all_free(held)
    shifted = without_effects(free, free.minimise(start, THRESHOLDS.base_steps), start)
    span = max(float(np.ptp(block.data)) for block in whitened.blocks)
    error = np.array(
        [
            np.sqrt(whitener.spectrum.of_lines(whitener.lines[k])[0] / whitened.blocks[k].size)
            for k in runs
        ]
    )
    price = float(2.0 * np.log(span / error).sum())
    best = attribution.best
    lines = shifted.on_base.errors.all.size
    return bool(shifted.cost + price < best.cost + best.count * np.log(lines))


def _guesses(fitted: FittedBase) -> Sequence[AbstractOperator]:
    """Operators of the same kind and size for runs with origins of their own."""
    operator, recording = fitted.operator, fitted.refit.whitened.recording
    return operator.initial_guesses(
        dataclasses.replace(recording, response_origin="run"),
        plays=operator.count,
        order=operator.coefficients.size,
        count=THRESHOLDS.guesses_beside_given,
    )
