"""Model order selection: the number of plays, the polynomial order and what each play owns."""

import dataclasses
from collections.abc import Sequence
from itertools import product
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from rapi_jax import ECDL, RAPI, AbstractOperator, Recording
from rapi_jax.internal import float64, follow, scan_origin, takes

from ._fit import fit
from ._options import Progress, solver_options
from ._posed import Posed
from ._result import FitResult
from ._starts import Guesses, count_from, held_origin
from ._thresholds import THRESHOLDS
from .data_checks._data_checks import check_usable

PLAYS = (4, 7, 10, 14)  # numbers of plays among which to choose
ORDERS = (2, 3, 4)  # orders of the polynomial


@dataclasses.dataclass(frozen=True)
class Choice:
    """One size of model and its error on held-out runs, in the response's unit.

    >>> from fitting import choose_order
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> few = dict(order=(3,), each=((),), starts=2, hold_out=False)
    >>> (choice,) = choose_order(recording, plays=(10,), **few)
    >>> choice.plays, choice.order, choice.score == choice.result.rmse
    (10, 3, True)
    """

    plays: int
    order: int
    each: tuple[str, ...]
    score: float
    parameters: int
    result: FitResult


def held_out_error(result: FitResult) -> float:
    """Error on data left out: rms over whole rates where there are several, else the last third.

    Errors are about each run's mean: a drifting origin says nothing about the size of the model.
    """
    by_rate = [h.std for h in result.held_out if h.scheme.startswith("rate")]
    last = [h.std for h in result.held_out if h.scheme == "last third"]
    return float(np.sqrt(np.mean(np.square(by_rate or last or [result.rmse]))))


def _leaves_white_noise(result: FitResult) -> bool:
    """Whether a trusted fit left residuals without correlation: no larger model can do better."""
    samples = sum(run.samples for run in result.runs)
    return bool(result.verdict.trusted and result.effective > THRESHOLDS.white_share * samples)


def _is_contained(choice: Choice, plays: int, order: int, each: Sequence[str]) -> bool:
    same = choice.plays == plays
    return same and choice.order <= order and set(choice.each) <= set(each)


@float64
def guess_from(
    origin: float | None,
    operator: type[AbstractOperator],
    recording: Recording,
    plays: int,
    order: int,
    each: Sequence[str],
) -> tuple[ECDL, Guesses]:
    """A first model whose drive counts from `origin`, and the guesses of which it is the best.

    `None`: as the operator's guess has it.
    """
    counted = recording if origin is None else count_from(recording, origin)
    size: dict[str, Any] = {"plays": plays, "order": order, "each": each}
    guesses = Guesses.of(operator, counted, **size)
    if not guesses.operators:
        operator.guess(counted, **size)  # raises: there is none
    best = guesses.operators[0]
    if origin is None:
        return ECDL(best), guesses
    path = held_origin(best).path  # type: ignore[union-attr]
    return ECDL(eqx.tree_at(lambda o: follow(o, path), best, jnp.asarray(origin))), guesses


@float64
def _better_origin(
    result: FitResult,
    weights: str | Sequence[float],
    history: bool,
    drift: bool | None,
    max_steps: int,
) -> float | None:
    """`scan_origin`, if a model with it leaves clearly less than `result`; else `None`."""
    operator, recording = result.ecdl.operator, result.recording
    held, other = held_origin(operator), scan_origin(recording)
    if held is None or other == float(follow(operator, held.path)):
        return None
    size = operator.count, operator.coefficients.size
    ecdl, _ = guess_from(other, type(operator), recording, *size, ())
    posed = Posed.of(ecdl, recording, None, weights, history=history, drift=drift)
    start = posed.problem.start(ecdl)
    end = posed.problem.solve(start, posed.weight, solver_options(max_steps))
    rmse = float(np.sqrt(np.mean(end.error[posed.problem.data.use] ** 2)))
    return other if rmse < THRESHOLDS.origin_gain * result.rmse else None


@takes(recording=Recording)
def choose_order(
    recording: Recording,
    *,
    plays: Sequence[int] = PLAYS,
    order: Sequence[int] = ORDERS,
    each: Sequence[Sequence[str]] = ((), ("lam",)),
    operator: type[AbstractOperator] = RAPI,
    weights: str | Sequence[float] = "hysteresis",
    loss: str = "squares",
    starts: int = 6,
    history: bool = True,
    drift: bool | None = None,
    hold_out: bool | tuple[str, ...] = True,
    max_steps: int = 120,
    progress: Progress | None = None,
) -> list[Choice]:
    """Fit every size asked for, and rank: the chosen one first, the others by score.

    Chosen is the smallest model whose held-out error is within 2 % of the lowest, among those that
    are trusted where there are any. A size is not tried where a smaller one, contained in it, is
    trusted and leaves nothing but white noise.
    `operator` is the class to fit. The other arguments are those of `fit`;
    fits are never refused here,
    each `Choice` holds its result with the verdict. The drive counts from its zero, unless that is
    far or a model that counts from `scan_origin` leaves clearly less.

    >>> from fitting import choose_order
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> few = dict(order=(3,), each=((),), starts=2, hold_out=False)
    >>> [choice.plays for choice in choose_order(recording, plays=(10,), **few)]
    [10]
    """
    check_usable(recording)
    found, origin = [], None
    for n1, n2, own in product(plays, order, each):
        if any(_leaves_white_noise(c.result) and _is_contained(c, n1, n2, own) for c in found):
            continue
        if progress is not None:
            progress(f"{n1} plays, order {n2}, {'own ' + ', '.join(own) if own else 'all shared'}")

        def fit_from(
            origin: float | None, size: tuple[int, int, Sequence[str]] = (n1, n2, own)
        ) -> FitResult:
            first, guesses = guess_from(origin, operator, recording, *size)
            return fit(
                first,
                recording,
                guess=guesses,
                weights=weights,
                loss=loss,
                starts=starts,
                history=history,
                drift=drift,
                hold_out=hold_out,
                max_steps=max_steps,
                throw=False,
            )

        result = fit_from(origin)
        if not found and not _leaves_white_noise(result):
            origin = _better_origin(result, weights, history, drift, max_steps)
            result = result if origin is None else fit_from(origin)
        size = sum(not p.held for p in result.parameters)
        found.append(Choice(n1, n2, tuple(own), held_out_error(result), size, result))
    pool = [choice for choice in found if choice.result.verdict.trusted] or found
    lowest = min(choice.score for choice in pool)
    near = [choice for choice in pool if choice.score <= (1.0 + THRESHOLDS.order_gain) * lowest]
    chosen = min(near, key=lambda choice: (choice.parameters, choice.plays, choice.score))
    rest = sorted((c for c in found if c is not chosen), key=lambda choice: choice.score)
    return [chosen, *rest]
