"""The noise that all runs share, from Fourier lines among which single ones may hold more."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from ._relaxations import Processes
from ._scoring import Bins, maximise
from ._thresholds import THRESHOLDS

EXPONENTIAL_MEDIAN = float(np.log(2.0))  # of an exponential variable with mean 1
_EFFICIENCY = EXPONENTIAL_MEDIAN**2  # variance of a mean over that of a scaled median, many lines
_TINY = 1e-300


@dataclasses.dataclass(frozen=True, eq=False)
class RunLines:
    """Fourier lines of a run of `size` samples every `step_s`: their numbers, and their power."""

    step_s: float
    size: int
    line: Int[np.ndarray, " lines"]
    power: Float[np.ndarray, " lines"]


def estimate_shared_noise(
    runs: Sequence[RunLines],
) -> tuple[Processes, Float[np.ndarray, " processes"]]:
    """Processes and their variances, by medians of lines that are near in frequency.

    As `estimate_noise`, but from what medians say of the power in bins: a tone moves none of them.
    The lines of a bin differ in what is expected of them, so after the first pass a median is that
    of power over what the pass before expects. Only processes with a variance are returned.
    """
    hertz = np.concatenate([r.line / (r.size * r.step_s) for r in runs])
    slowest = float(hertz.min()) / THRESHOLDS.corner_below
    processes = Processes.of([r.step_s for r in runs], [r.size for r in runs], slowest)
    shapes = {(r.step_s, r.size) for r in runs}
    each = {shape: processes.periodogram(*shape) for shape in shapes}
    columns = np.concatenate([each[r.step_s, r.size][:, r.line] for r in runs], axis=1)
    power = np.concatenate([r.power for r in runs])
    groups = _neighbours(hertz)
    count = np.array([g.size for g in groups])
    usual = np.array([median_of_exponentials(int(n)) for n in count])
    mean = np.stack([columns[:, g].mean(axis=1) for g in groups], axis=1)
    expected, variance = np.ones(power.size), np.zeros(columns.shape[0])
    for _ in range(THRESHOLDS.median_passes):
        level = np.array([np.median(power[g] / expected[g]) for g in groups]) / usual
        data = Bins(
            power=level * np.array([expected[g].mean() for g in groups]),
            expected=mean,
            known=np.zeros(count.size),
            freedom=2.0 * _EFFICIENCY * count,
            run=np.zeros(count.size, dtype=int),
            harmonic=np.zeros(count.size),
            runs=1,
        )
        variance = maximise(data).by_run[0]
        expected = np.maximum(variance @ columns, _TINY)
    variance = variance * float(np.median(power / expected)) / EXPONENTIAL_MEDIAN
    chosen = np.flatnonzero(variance > 0)
    return processes.pick(chosen), variance[chosen]


def median_of_exponentials(count: int) -> float:
    """The expected median of so many exponential variables with mean 1: log 2 for many."""
    harmonic = np.concatenate([[0.0], np.cumsum(1.0 / np.arange(1, count + 1))])
    half = count // 2
    if count % 2:
        return float(harmonic[count] - harmonic[half])
    return float(harmonic[count] - 0.5 * (harmonic[half] + harmonic[half - 1]))


def _neighbours(hertz: Float[np.ndarray, " lines"]) -> list[Int[np.ndarray, " _"]]:
    """Lines in groups of near frequency; as many in each as a median needs."""
    order = np.argsort(hertz, kind="stable")
    edges, least = [0], THRESHOLDS.least_group_lines
    for k in range(1, order.size):
        far = hertz[order[k]] > THRESHOLDS.bin_ratio * hertz[order[edges[-1]]]
        if far and k - edges[-1] >= least and order.size - k >= least:
            edges.append(k)
    return [g for g in np.split(order, edges[1:]) if g.size]
