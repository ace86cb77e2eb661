"""Cycles that follow each other and are alike: of one rate and one pair of levels."""

from rapi_jax.io.imports._thresholds import THRESHOLDS

from ._cycles import Cycle, Samples, count_samples, find_both_cycles


def find_repeating(drive: Samples, step_s: float) -> list[Cycle]:
    """The complete cycles between minima or between maxima, of which more samples repeat.

    A drive that rests between runs rests at one of them, and hides where cycles begin there.
    """

    def key(cycles: list[Cycle]) -> tuple[int, int]:
        return sum(map(count_samples, repeated_cycles(cycles))), count_samples(cycles)

    return max(find_both_cycles(drive, step_s), key=key)


def repeated_cycles(cycles: list[Cycle]) -> list[list[Cycle]]:
    """The groups of cycles that are alike; a cycle alone where there is no other."""
    groups = _group(cycles)
    repeated = [group for group in groups if len(group) > 1]
    return repeated or (groups if len(groups) == 1 else [])


def _group(cycles: list[Cycle]) -> list[list[Cycle]]:
    """Neighbouring cycles of one rate and one pair of levels."""
    groups: list[list[Cycle]] = []
    for cycle in cycles:
        if groups and groups[-1][-1].last == cycle.first and _alike(groups[-1][0], cycle):
            groups[-1].append(cycle)
        else:
            groups.append([cycle])
    return groups


def _alike(one: Cycle, other: Cycle) -> bool:
    swing = max(one.swing, other.swing)
    return (
        abs(one.rate - other.rate) < THRESHOLDS.same_rate * max(one.rate, other.rate)
        and abs(one.low - other.low) < THRESHOLDS.same_level * swing
        and abs(one.high - other.high) < THRESHOLDS.same_level * swing
    )
