"""Times of several ways to do the same work, taken in turns in one process."""

import dataclasses
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np


class Disagree(RuntimeError):
    """Both sides did not do the same work, so that their times say nothing."""


@dataclasses.dataclass(frozen=True)
class Row:
    """One comparison; `ratios` are the peer's time over ours, one for each round.

    Costs are half the weighted sum of squares; `None` where nothing is fitted. `unit` is that of
    `ours_value` and `peer_value`.
    """

    work: str
    ours: str
    peer: str
    ours_value: float | None
    peer_value: float | None
    ratios: tuple[float, ...] = ()
    start_cost: float | None = None
    ours_cost: float | None = None
    peer_cost: float | None = None
    note: str = ""
    unit: str = "s"

    @property
    def ratio(self) -> float | None:
        """The median of the ratios; `None` where there is none."""
        return float(np.median(self.ratios)) if self.ratios else None


def take_turns(ways: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, np.ndarray]:
    """Seconds of each way in each round; call each of them once before, to compile.

    Every other round goes the other way round, so that none always follows the same one.
    """
    seconds: dict[str, list[float]] = {name: [] for name in ways}
    for number in range(rounds):
        names = list(ways) if number % 2 == 0 else list(ways)[::-1]
        for name in names:
            began = time.perf_counter()
            ways[name]()
            seconds[name].append(time.perf_counter() - began)
    return {name: np.array(taken) for name, taken in seconds.items()}


def compared(
    work: str, ours: str, peer: str, seconds: Mapping[str, np.ndarray], **fields: Any
) -> Row:
    """The row of `ours` against `peer`, both named in `seconds`."""
    mine, other = seconds[ours], seconds[peer]
    ratios = tuple((other / mine).tolist())
    return Row(work, ours, peer, float(np.median(mine)), float(np.median(other)), ratios, **fields)


def check_equal(what: str, ours: float, peer: float, relative: float) -> None:
    """Raise `Disagree` where two numbers that must be equal are not."""
    if not abs(ours - peer) <= relative * max(abs(ours), abs(peer)):
        raise Disagree(
            f"{what}: {ours:.12g} by ours, {peer:.12g} by the peer. Nothing is reported."
        )
