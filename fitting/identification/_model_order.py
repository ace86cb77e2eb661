"""The size of the model, chosen on data that took no part in the fit."""

import dataclasses
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from rapi_jax import ECDL, RAPI, Recording

from ._data_checks import check_usable
from ._fit import Progress, fit
from ._result import FitResult

_WORTH = 0.02  # a larger model must lower the held-out error by at least this share
_WHITE = 0.8  # share of the samples that residuals must be worth to count as white


@dataclasses.dataclass(frozen=True)
class Choice:
    """One size of model and its error on held-out runs, in the response's unit."""

    plays: int
    order: int
    each: tuple[str, ...]
    score: float
    parameters: int
    result: FitResult


def score(result: FitResult) -> float:
    """Error on data left out: rms over whole rates where there are several, else the last third.

    Errors are about each run's mean: a drifting origin says nothing about the size of the model.
    """
    by_rate = [h.std for h in result.held_out if h.scheme.startswith("rate")]
    last = [h.std for h in result.held_out if h.scheme == "last third"]
    return float(np.sqrt(np.mean(np.square(by_rate or last or [result.rmse]))))


def _complete(result: FitResult) -> bool:
    """Whether a trusted fit left residuals without correlation: no larger model can do better."""
    samples = sum(run.samples for run in result.runs)
    return bool(result.verdict.trusted and result.effective > _WHITE * samples)


def _within(choice: Choice, plays: int, order: int, each: Sequence[str]) -> bool:
    same = choice.plays == plays
    return same and choice.order <= order and set(choice.each) <= set(each)


def choose_order(
    recording: Recording,
    *,
    plays: Sequence[int] = (4, 7, 10, 14),
    order: Sequence[int] = (2, 3, 4),
    each: Sequence[Sequence[str]] = ((), ("lam",)),
    progress: Progress | None = None,
    **options: Any,
) -> list[Choice]:
    """Fit every size asked for, and rank: the chosen one first, the others by score.

    Chosen is the smallest model whose held-out error is within 2 % of the lowest. A size is not
    tried where a smaller one, contained in it, is trusted and leaves nothing but white noise.
    `options` are those of `fit`; fits are never refused here, each `Choice` holds its result with
    the verdict.
    """
    check_usable(recording)
    found = []
    for n1, n2, own in product(plays, order, each):
        if any(_complete(c.result) and _within(c, n1, n2, own) for c in found):
            continue
        if progress is not None:
            progress(f"{n1} plays, order {n2}, {'own ' + ', '.join(own) if own else 'all shared'}")
        start = ECDL(RAPI.guess(recording, plays=n1, order=n2, each=own))
        result = fit(start, recording, throw=False, **options)
        size = sum(not p.held for p in result.parameters)
        found.append(Choice(n1, n2, tuple(own), score(result), size, result))
    lowest = min(choice.score for choice in found)
    near = [choice for choice in found if choice.score <= (1.0 + _WORTH) * lowest]
    chosen = min(near, key=lambda choice: (choice.parameters, choice.plays, choice.score))
    rest = sorted((c for c in found if c is not chosen), key=lambda choice: choice.score)
    return [chosen, *rest]
