"""Stretches of drive on which the slope of an operator is not positive."""

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from ._slopes import Slopes


@dataclasses.dataclass(frozen=True)
class Failure:
    """A stretch of drive on which some history makes the response fall as the drive rises."""

    low: float
    high: float
    direction: str  # of the drive: "up" or "down"
    slope: float  # the smallest there, response units per drive unit
    plays: tuple[int, ...]  # in contact at that slope, counted from 1


def join_failures(found: Sequence[Slopes], margin: float, origin: float) -> Iterator[Failure]:
    """Joined stretches whose slope is not above `margin`, with their exact ends."""
    for slopes in found:
        failures: list[Failure] = []
        edges, least = slopes.edges, slopes.least.min(axis=1)
        for n in map(int, np.flatnonzero(least <= margin)):
            low, high = slopes.where(n, margin)
            new = Failure(
                low + origin, high + origin, slopes.direction, float(least[n]), slopes.contacts(n)
            )
            if failures and abs(failures[-1].high - new.low) < 1e-9 * (edges[-1] - edges[0]):
                last = failures.pop()
                worse = min(last, new, key=lambda f: f.slope)
                new = dataclasses.replace(worse, low=last.low, high=new.high)
            failures.append(new)
        yield from failures
