"""The most likely variances of few processes, given the power in bins of lines."""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from ._thresholds import THRESHOLDS

_TINY = 1e-300


@dataclasses.dataclass(frozen=True, eq=False)
class Bins:
    """Bins of runs that hold enough: power, expected power of each process, and freedom.

    `known`: power that is there for other reasons. `harmonic`: the slowest line of each bin, in
    scan rates.
    """

    power: Float[np.ndarray, " bins"]
    expected: Float[np.ndarray, "processes bins"]
    known: Float[np.ndarray, " bins"]
    freedom: Float[np.ndarray, " bins"]
    run: Int[np.ndarray, " bins"]
    harmonic: Float[np.ndarray, " bins"]
    runs: int

    def pick(self, these: Bool[np.ndarray, " bins"]) -> "Bins":
        """Some of the bins."""
        return Bins(
            self.power[these],
            self.expected[:, these],
            self.known[these],
            self.freedom[these],
            self.run[these],
            self.harmonic[these],
            self.runs,
        )

    def total(self, values: Float[np.ndarray, "*more bins"]) -> Float[np.ndarray, "*more runs"]:
        """Sums over the bins of each run."""
        return values @ self._of_run

    @cached_property
    def _of_run(self) -> Float[np.ndarray, "bins runs"]:
        """1 where a bin is of a run."""
        return (self.run[:, None] == np.arange(self.runs)).astype(float)


@dataclasses.dataclass(frozen=True, eq=False)
class Maximum:
    """Variance of each process in each run, and the log-likelihood less what chance gains."""

    by_run: Float[np.ndarray, "runs processes"]
    score: float


def maximise(data: Bins) -> Maximum:
    """Processes are added one by one, the most likely first, while each gains more than chance."""
    count = data.expected.shape[0]
    if not data.power.sum() > 0:
        return Maximum(np.zeros((data.runs, count)), 0.0)
    chosen: list[int] = []
    best = -np.inf, np.zeros(0), np.ones(data.runs)
    while len(chosen) < THRESHOLDS.most_processes:
        sets = np.array([[*chosen, j] for j in range(count) if j not in chosen])
        start = np.full((sets.shape[0], sets.shape[1]), float(data.power.mean()))
        if chosen:
            start[:, :-1] = best[1]
            start[:, -1] = THRESHOLDS.new_share * best[1].sum()
        variance, scale, likelihood = _score(data, sets, start)
        at = int(np.argmax(likelihood))
        if likelihood[at] < best[0] + THRESHOLDS.chance_gain:
            break
        best = float(likelihood[at]), variance[at], scale[at]
        chosen = list(sets[at])
    by_run = np.zeros((data.runs, count))
    by_run[:, chosen] = best[2][:, None] * best[1]
    present = int((data.total(data.freedom) > 0).sum())
    return Maximum(by_run, best[0] - THRESHOLDS.chance_gain * (len(chosen) + 0.5 * (present - 1)))


def _score(
    data: Bins, sets: Int[np.ndarray, "sets chosen"], start: Float[np.ndarray, "sets chosen"]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fisher scoring in the logarithms of variances, for many sets of processes at once.

    Returns variances, scales of runs (1 on average) and log-likelihoods.
    """
    columns = data.expected[sets]  # sets chosen bins
    log = np.log(np.maximum(start, _TINY))
    least = log.max() - THRESHOLDS.least_log_variance
    total = data.total(data.freedom)
    several = (total > 0).sum() > 1
    step, settled = 0, False
    while True:
        parts = np.exp(log)[:, :, None] * columns
        plain = np.maximum(parts.sum(axis=1) + data.known, _TINY)
        scale = np.ones((sets.shape[0], data.runs))
        if several:
            scale = data.total(data.freedom * data.power / plain) / np.maximum(total, _TINY)
            scale = np.where(total > 0, np.maximum(scale, _TINY), 1.0)
        if settled or step == THRESHOLDS.steps:
            break
        share = parts / plain[:, None, :]
        error = data.power / (plain * scale[:, data.run]) - 1.0
        slope = np.einsum("scb,sb->sc", share, data.freedom * error)
        fisher = (share * data.freedom) @ share.transpose(0, 2, 1)
        size = np.einsum("scc->sc", fisher).max(axis=1)[:, None, None]
        fisher = fisher + THRESHOLDS.damping * size * np.eye(log.shape[1])
        change = np.linalg.solve(fisher, slope[:, :, None])[:, :, 0]
        before, log = log, np.maximum(log + np.clip(change, -2.0, 2.0), least)
        step, settled = step + 1, np.abs(log - before).max() < THRESHOLDS.settled
    model = plain * scale[:, data.run]
    likelihood = -0.5 * (np.log(model) + data.power / model) @ data.freedom
    return np.exp(log), scale, likelihood
