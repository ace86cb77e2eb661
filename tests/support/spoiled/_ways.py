"""The table of ways to spoil, and what is done to one run or to each."""

from collections.abc import Callable

from ._columns import Columns

Spoil = Callable[[Columns], None]
WAYS: dict[str, Spoil] = {}


def way(name: str) -> Callable[[Spoil], Spoil]:
    """Enter a way to spoil under its name."""

    def enter(spoil: Spoil) -> Spoil:
        assert name not in WAYS
        WAYS[name] = spoil
        return spoil

    return enter


def every(change: Callable[[Columns, int], None]) -> Spoil:
    """What is done to each run."""

    def spoil(columns: Columns) -> None:
        for row in range(len(columns.time)):
            change(columns, row)

    return spoil


def only(change: Callable[[Columns, int], None], row: int = 2) -> Spoil:
    """What is done to one run."""
    return lambda columns: change(columns, row)
