"""Orders in which the readings may stand under the drives, the likeliest first."""

import dataclasses
from collections.abc import Sequence
from itertools import combinations, permutations

import numpy as np

from fitting.identification.data_checks._thresholds import THRESHOLDS
from fitting.identification.problem._problem import Problem
from fitting.identification.problem._solution import Evaluation
from rapi_jax import Recording, Run


def orders(runs: Sequence[Run]) -> list[tuple[int, ...]]:
    """Orders to try: all of up to four runs, else each pair exchanged, and the reverse."""
    count = len(runs)
    natural = tuple(range(count))
    if count <= THRESHOLDS.permuted_runs:
        found = list(permutations(natural))
    else:
        pairs = combinations(natural, 2)
        swaps = [{i: j, j: i} for i, j in pairs]
        found = [tuple(swap.get(k, k) for k in natural) for swap in swaps] + [natural[::-1]]
    return [
        order
        for order in found
        if order != natural
        and all(_exchangeable(runs[i], runs[j]) for i, j in enumerate(order) if i != j)
    ][: THRESHOLDS.exchanged_orders]


def likeliest_orders(
    problem: Problem, weight: np.ndarray, solution: Evaluation
) -> list[tuple[int, ...]]:
    """The orders of `orders`, by what the model leaves of the readings in each, to first order.

    The model follows the readings along its derivatives; plays are linear in their weights, so that
    is most of what a fit would do, and no fit is made.
    """
    jacobian = solution.jacobian
    length = np.linalg.norm(jacobian, axis=0)
    left, size, _ = np.linalg.svd(jacobian[:, length > 0] / length[length > 0], full_matrices=False)
    tangent = left[:, size > THRESHOLDS.changed_runs_rank * size.max(initial=0.0)]

    def remainder(order: tuple[int, ...]) -> float:
        y = problem.data.y
        error = (weight * (solution.error + y - y[list(order)])).ravel()
        return float(error @ error - np.sum((tangent.T @ error) ** 2))

    return sorted(orders(problem.recording.runs), key=remainder)


def _exchangeable(one: Run, other: Run) -> bool:
    """Whether their readings could stand under each other's drives."""
    return (
        one.drive.size == other.drive.size
        and one.drive.periods == other.drive.periods
        and one.drive.waveform == other.drive.waveform
        and not same_drive(one, other)
    )


def reordered(recording: Recording, order: tuple[int, ...]) -> Recording:
    """Each run with the readings of the run at its place in `order`."""
    runs = tuple(
        dataclasses.replace(run, response=recording.runs[place].response)
        for run, place in zip(recording.runs, order, strict=True)
    )
    return dataclasses.replace(recording, runs=runs)


def same_drive(one: Run, other: Run) -> bool:
    """Whether two runs were driven alike, sample for sample."""
    return (
        one.drive.rate == other.drive.rate
        and np.array_equal(one.drive.value, other.drive.value)
        and np.array_equal(one.drive.time, other.drive.time)
    )
