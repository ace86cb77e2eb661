"""Samples about a turn between two runs: which of them each run keeps."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.io.imports.cycles._cycles import Cycle
from rapi_jax.recording._drive import Drive

from ._piece import Piece

Samples = Float[np.ndarray, " samples"]


def part_runs(
    pieces: list[Piece], groups: list[list[Cycle]], rates: list[float], step_s: float
) -> list[Piece]:
    """Runs that share only a few samples, about a turn that noise displaces."""
    found = list(pieces)
    for k in range(len(found) - 1):
        if found[k].last < found[k + 1].first:
            continue
        turn = _turn(groups[k + 1], 1.0 / (rates[k + 1] * step_s))
        shared = turn - 1 + int(THRESHOLDS.shared_samples / (rates[k] * step_s))
        last = max(min(found[k].last, shared), groups[k][-1].last)
        found[k] = dataclasses.replace(found[k], last=last)
        found[k + 1] = dataclasses.replace(found[k + 1], first=max(turn, found[k + 1].first))
    return found


def _turn(group: list[Cycle], period: float) -> int:
    """Where the first cycle begins, by all of them: noise displaces each turn; rather early.

    By as much as turns are displaced, and no more: what is before is of the run before.
    """
    begins = np.array([cycle.first - k * period for k, cycle in enumerate(group)])
    first = float(np.median(begins))
    near = abs(first - group[0].first) < 2.0 * THRESHOLDS.shared_samples * period
    early = min(float(np.abs(begins - first).max()), THRESHOLDS.early_start * period)
    return max(int(np.ceil((first if near else group[0].first) - early - 1e-6)), 0)


def without_overlap(pieces: list[Piece], drive: Samples, step_s: float) -> list[Piece]:
    """Runs without the samples about a turn that they share with another one of another rate."""
    found = list(pieces)
    for k in range(len(found) - 1):
        if found[k].last < found[k + 1].first:
            continue
        one = found[k]
        value = drive[one.first : one.last + 1]
        run = Drive(step_s * np.arange(value.size), value, one.excitation_hz, one.waveform)
        inside = np.flatnonzero(run.period >= 0) if run.repeats else np.zeros(0, dtype=int)
        last = one.first + int(inside[-1]) if inside.size else one.last
        found[k] = dataclasses.replace(one, last=last)
        found[k + 1] = dataclasses.replace(found[k + 1], first=max(last, found[k + 1].first))
    return found
