"""`fit`: identify the free parameters of a model on all runs of a recording (Eqs. 25 to 27)."""

import time
from collections.abc import Callable, Sequence
from typing import Any

from rapi_jax import ECDL, Recording
from rapi_jax.internal import float64, takes

from ._conclude import conclude
from ._options import Progress, solver_options
from ._posed import Posed
from ._result import FitResult, UntrustedFit
from ._starts import Guesses, search_starts
from .assessment._ends import Start
from .data_checks._thinning import thin
from .problem._problem import Solution
from .robust._loss import loss_of


@takes(ecdl=ECDL, recording=Recording)
@float64
def fit(
    ecdl: ECDL,
    recording: Recording,
    *,
    free: Callable[[ECDL], Any] | None = None,
    weights: str | Sequence[float] = "hysteresis",
    loss: str = "squares",
    starts: int = 6,
    guess: bool | Sequence[ECDL] | Guesses = True,
    history: bool = True,
    drift: bool | None = None,
    hold_out: bool | tuple[str, ...] = True,
    max_steps: int = 120,
    throw: bool = True,
    progress: Progress | None = None,
) -> FitResult:
    """Identify the free parameters of `ecdl` on `recording`.

    **Arguments:**

    - `ecdl`: the model to fit; its values are one of the starts. It counts drives from its own
      origin, which stands unless freed: where drives may be written with an offset of up to four
      times their range, `identify` finds which origin fits, and `fit` does not.
    - `recording`: of more than 400 000 samples it is thinned; the result holds what was fitted.
    - `free`: selects what may move, as in `equinox.tree_at`: `lambda e: e.operator`, or
      `lambda e: (e.operator.lam, e.effects[-1])`. Default: see `default_free`.
    - `weights`: `A_j` of Eq. 26: "hysteresis" (its percentage), "uniform", or one number per run.
    - `loss`: the loss function. "squares", with outliers left out and listed; or, for data that
      cannot be cleaned, "huber" or "student" (heavier tails): every reading counts, by a weight.
    - `starts`: at most so many first guesses; two that end with nearly the same response are
      enough. Starts beside an end found before come on top: see `search_starts`.
    - `guess`: let first guesses from the data be among the starts; or models to use as such,
      or guesses made before.
    - `history`: fit the plays' initial values in runs that do not repeat.
    - `drift`: let the origin creep with the logarithm of session time, as piezos do. By default
      where some run holds six periods or more; the model itself keeps no drift.
    - `hold_out`: also refit without the last third, and without each rate and swing; or some of
      "last third", "rate" and "swing".
    - `max_steps`: the limit of solver steps in each fit, looked at every forty.
    - `throw`: raise `UntrustedFit` where the fit is not to be trusted.
    - `progress`: called with a line before each step.

    **Returns** a `FitResult`. Raises `DataError` where the recording holds fewer usable samples
    than there are parameters.

    >>> from fitting import fit
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> result.rmse < 0.025  # GHz: the noise is 0.02
    True
    """
    began = time.perf_counter()
    report = progress or (lambda line: None)
    options = solver_options(max_steps)
    kind = loss_of(loss)
    given, (recording, note) = recording, thin(recording)
    if note is not None:
        report(note)
    posed = Posed.of(ecdl, recording, free, weights, history=history, drift=drift)

    def search(posed: Posed) -> tuple[Solution, list[Start]]:
        report("starts")
        return search_starts(posed.problem, posed.weight, starts, options, guess=guess)

    if kind is None:
        posed, (solution, ends) = posed.without_outliers(search)
    else:
        posed, (solution, ends) = posed.reweighted(loss, kind, search, options)
    result = conclude(posed, solution, ends, hold_out, options, began, report)
    result = result.noting(note, given)
    if throw and not result.verdict.trusted:
        raise UntrustedFit(result)
    return result
