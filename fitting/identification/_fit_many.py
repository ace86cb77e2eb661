"""`fit_many`: fits of many recordings, those of one shape solved together."""

import dataclasses
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import numpy as np

from fitting.solver._batched_least_squares import least_squares_many
from fitting.solver._bound_transform import Bounds
from fitting.solver._least_squares import SolverOptions
from rapi_jax import ECDL, Recording
from rapi_jax.internal import float64, takes

from ._conclude import conclude
from ._options import solver_options
from ._posed import Posed
from ._result import FitResult
from ._starts import average_groups, perturb, search_starts, tied_groups
from ._thresholds import THRESHOLDS
from .assessment._ends import Start, rank_ends, settled
from .intervals._data import IntervalData
from .intervals._residual import IntervalResidual
from .intervals._sums import IntervalSums
from .problem._bounds import bounds_of
from .problem._minimise import stop_by_chi_square
from .problem._problem import Solution
from .robust._loss import loss_of


@takes(models=ECDL | Sequence, recordings=[Recording])
@float64
def fit_many(
    models: ECDL | Sequence[ECDL],
    recordings: Sequence[Recording],
    *,
    free: Callable[[ECDL], Any] | None = None,
    weights: str | Sequence[float] = "hysteresis",
    loss: str = "squares",
    check: bool = True,
    starts: int = 6,
    history: bool = True,
    drift: bool | None = None,
    hold_out: bool | tuple[str, ...] = False,
    max_steps: int = 120,
    lanes: int | None = None,
) -> list[FitResult]:
    """Identify a model on each of many recordings, from the model given for it.

    Each recording is fitted from its model and, with `check`, once more from values beside the end.
    Where these two disagree, it is fitted as `fit` does, from up to `starts` starts.

    **Arguments:**

    - `models`: one for all recordings, or one for each.
    - `lanes`: how many fits of one shape are solved by one program; by default 1024 on an
      accelerator, and 1 on a CPU, where together they take nearly as long as one after the other.
    - the others: as for `fit`. A fit that is not to be trusted raises no error here.

    **Returns** one `FitResult` per recording, in their order. Raises `DataError`, before any fit,
    where a recording holds too few usable samples.

    >>> from fitting import fit_many
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> results = fit_many(paper_device(), [recording, recording])
    >>> [result.rmse < 0.025 for result in results]  # GHz
    [True, True]
    """
    began = time.perf_counter()
    given = [models] * len(recordings) if isinstance(models, ECDL) else list(models)
    if len(given) != len(recordings):
        raise ValueError(
            f"Argument `models` must be one model or one per recording, but there are {len(given)} "
            f"of {len(recordings)}."
        )
    kind, options = loss_of(loss), solver_options(max_steps)
    posed = [
        Posed.of(model, recording, free, weights, history=history, drift=drift)
        for model, recording in zip(given, recordings, strict=True)
    ]
    width = default_lanes() if lanes is None else lanes
    begins = [one.problem.start(model) for one, model in zip(posed, given, strict=True)]
    first = _solve_tied_first(posed, begins, options, width)
    ends = [[("given", end)] for end in first]
    if check:
        beside = [
            perturb(one.problem, end.start, 0, THRESHOLDS.perturbation)
            for one, end in zip(posed, first, strict=True)
        ]
        for found, end in zip(ends, solve_many(posed, beside, options, width), strict=True):
            found.append(("best, shaken 1", end))

    def search(posed: Posed) -> tuple[Solution, list[Start]]:
        return search_starts(posed.problem, posed.weight, starts, options)

    results = []
    for one, found in zip(posed, ends, strict=True):
        if check and not settled(one.problem, one.weight, found):
            ranked = search(one)
        else:
            ranked = rank_ends(one.problem, one.weight, found, nearby=len(found) - 1)
        if kind is None:
            one, ranked = one.without_outliers(search, ranked)
        else:
            one, ranked = one.reweighted(loss, kind, search, options, ranked)
        results.append(conclude(one, *ranked, hold_out, options, began, lambda line: None))
        began = time.perf_counter()
    return results


def default_lanes() -> int:
    """How many fits are solved by one program on this machine."""
    return 1 if jax.default_backend() == "cpu" else THRESHOLDS.lanes


def _solve_tied_first(
    posed: list[Posed], begins: list[np.ndarray], options: SolverOptions, lanes: int
) -> list[Solution]:
    """Fits from `begins`; where plays have values of their own, first with these tied to one."""
    groups = [tied_groups(one.problem.ecdl.operator, one.problem) for one in posed]
    if any(group is not None for group in groups):
        averaged = [
            begin if group is None else average_groups(one.problem, begin, group)
            for one, begin, group in zip(posed, begins, groups, strict=True)
        ]
        tied = solve_many(posed, averaged, options, lanes, groups)
        begins = [end.start for end in tied]
    return solve_many(posed, begins, options, lanes)


def solve_many(
    posed: Sequence[Posed],
    begins: Sequence[np.ndarray],
    options: SolverOptions,
    lanes: int,
    groups: Sequence[np.ndarray | None] | None = None,
) -> list[Solution]:
    """`Problem.solve` of each, up to `lanes` of one shape together.

    `groups`: of values that move together; see `tied_groups`.
    """
    ties = [
        None if group is None else np.r_[group, np.arange(group.size, one.problem.own_size)]
        for one, group in zip(posed, groups or [None] * len(posed), strict=True)
    ]
    ends: list[Solution | None] = [None] * len(posed)
    for part in _parts(posed, begins, ties, lanes) if lanes > 1 else ():
        for lane, end in zip(part, _solve_lanes(part, options), strict=True):
            ends[lane.place] = end
    return [
        one.problem.solve(begin, one.weight, options, ties=tie) if end is None else end
        for one, begin, tie, end in zip(posed, begins, ties, ends, strict=True)
    ]


@dataclasses.dataclass(frozen=True, eq=False)
class _Lane:
    """One problem over intervals: its place in the list, and what a program needs of it."""

    place: int
    posed: Posed
    own: np.ndarray
    move: np.ndarray
    ties: np.ndarray | None
    sums: IntervalSums
    arrays: tuple[IntervalResidual, IntervalData, Bounds]

    @property
    def shape(self) -> Any:
        """Equal where one program solves both."""
        leaves, structure = jax.tree_util.tree_flatten(self.arrays)
        shapes = tuple(np.shape(leaf) for leaf in leaves)
        return (
            structure,
            shapes,
            self.move.tobytes(),
            None if self.ties is None else tuple(self.ties),
        )


def _parts(
    posed: Sequence[Posed],
    begins: Sequence[np.ndarray],
    ties: Sequence[np.ndarray | None],
    lanes: int,
) -> Iterator[list[_Lane]]:
    """The problems for which intervals can stand, up to `lanes` of one shape at a time."""
    waiting: dict[Any, list[_Lane]] = {}
    for place, (one, begin, tie) in enumerate(zip(posed, begins, ties, strict=True)):
        own, move = one.problem.own_vector(begin)
        sums = IntervalSums.of(one.problem, own)
        if sums is None:
            continue
        residual = one.problem.interval_residual
        arrays = residual, sums.arrays(one.weight), bounds_of(one.problem, own)
        lane = _Lane(place, one, own, move, tie, sums, arrays)
        alike = waiting.setdefault(lane.shape, [])
        alike.append(lane)
        if len(alike) == lanes:
            yield waiting.pop(lane.shape)
    yield from waiting.values()


def _solve_lanes(lanes: Sequence[_Lane], options: SolverOptions) -> list[Solution | None]:
    """Problems of one shape together; `None` for one that did not reach an optimum so."""
    residual, data, bounds = jax.tree_util.tree_map(
        lambda *leaves: np.stack(leaves), *(lane.arrays for lane in lanes)
    )
    one = lanes[0]
    starts = np.stack([lane.own for lane in lanes])
    ends = least_squares_many(
        residual, starts, data, bounds=bounds, free=one.move, ties=one.ties,
        options=stop_by_chi_square(options, one.posed.weight),
    )  # fmt: skip
    return [
        lane.posed.problem.solution(lane.own, lane.move, lane.posed.weight, end)
        if end is not None and lane.sums.resolves(end, lane.arrays[1])
        else None
        for lane, end in zip(lanes, ends, strict=True)
    ]
