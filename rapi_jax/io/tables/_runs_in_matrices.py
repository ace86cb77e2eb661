"""Matrices of one shape of which each column is a run, as MATLAB's users save them."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ._table import is_time_name
from ._units import split_unit


@dataclasses.dataclass(frozen=True)
class RunsInMatrices:
    """`time`: the name of the clock, a matrix or one column for all; `others`: of the matrices.

    `width`: how many runs there are.
    """

    time: str
    others: tuple[str, ...]
    width: int


def find_runs(
    shapes: Sequence[tuple[str, Sequence[int]]], load: Callable[[str], np.ndarray]
) -> RunsInMatrices | None:
    """The runs that stand beside each other in matrices of one shape; `None` where it may be else.

    A single matrix may hold time, drive and response in its columns. Several that a time belongs to
    hold a run in each.

    **Arguments:**

    - `shapes`: names and shapes of one or two dimensions, samples along the first axis.
    - `load`: the values of a name, with the same axes; asked for of clocks alone.
    """
    for name, shape in shapes:
        if not is_time_name(last_part(name)) or shape[0] < 3:
            continue
        same = [
            (other, tuple(its))
            for other, its in shapes
            if other != name and len(its) == 2 and its[0] == shape[0]
        ]
        width = shape[1] if len(shape) == 2 else same[0][1][1] if same else 0
        others = tuple(other for other, its in same if its[1] == width)
        if len(others) > 1 and width > 1 and bool((np.diff(load(name), axis=0) > 0).all()):
            return RunsInMatrices(name, others, width)
    return None


def last_part(name: str) -> str:
    """What a field is called without the structures and groups that it is in."""
    return split_unit(name)[0].replace("/", ".").rpartition(".")[2]
