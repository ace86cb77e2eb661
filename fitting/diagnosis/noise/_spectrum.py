"""Noise spectrum of a recording, measured from what does not repeat with the scan."""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from fitting.noise import EXPONENTIAL_MEDIAN, Processes, RunLines, estimate_shared_noise

from ._lines import SpectralLines, to_lines
from ._periods import PeriodBlock
from ._thresholds import THRESHOLDS

_TINY = 1e-300


@dataclasses.dataclass(frozen=True, eq=False)
class Spectrum:
    """Noise of all runs as few processes in time, as `fitting.noise` describes it.

    - `processes`, `variances`: of each, in the response's unit squared.
    - `measured`: whether repeated periods measured it; where not, it is read off the fastest lines
      of the residual, and is only an upper bound of the white part.
    """

    processes: Processes
    variances: Float[np.ndarray, " processes"]
    measured: bool

    @classmethod
    def of_white(cls, variance: float, *, measured: bool = True) -> "Spectrum":
        """White noise alone."""
        return cls(Processes(np.zeros(0), np.ones((1, 1))), np.array([variance]), measured)

    @property
    def white(self) -> float:
        """Variance of what is white from reading to reading."""
        return float(self.variances @ self.processes.shares[:, 0])

    @property
    def total(self) -> float:
        """Variance of a reading, the slowest noise included."""
        return float(self.variances @ self.processes.shares.sum(axis=1))

    def variance(
        self, hertz: Float[np.ndarray, " frequencies"], step_s: float
    ) -> Float[np.ndarray, " frequencies"]:
        """Variance a sample at each frequency, for long records of samples every `step_s`."""
        return self.variances @ self.processes.spectrum(hertz, step_s)

    def by_process(self, lines: SpectralLines) -> Float[np.ndarray, "processes lines"]:
        """The expected power of each process at the lines of a run."""
        key = lines.step_s, lines.size
        if key not in self._known:
            self._known[key] = self.variances[:, None] * self.processes.periodogram(*key)
        return self._known[key]

    @cached_property
    def _known(self) -> dict[tuple[float, int], np.ndarray]:
        """What was worked out, by sampling interval and size."""
        return {}

    def of_lines(self, lines: SpectralLines) -> Float[np.ndarray, " lines"]:
        """The expected power at the lines of a run."""
        return self.by_process(lines).sum(axis=0)

    def mean_variance(
        self,
        lines: SpectralLines,
        pick: Float[np.ndarray, " lines"] | Bool[np.ndarray, " lines"] | float = 1.0,
    ) -> float:
        """Variance of a reading; `pick`: 1 for the lines that count, 0 for others."""
        weight = lines.multiplicity * pick
        return float(weight @ self.of_lines(lines) / max(weight.sum(), 1.0))


def measure_spectrum(errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock]) -> Spectrum:
    """The noise spectrum of the runs from `errors` ("periods phases"), robust against effects.

    Medians over lines that do not repeat, so single lines (pickup) do not count, and without the
    slowest lines of each run (drift, creep). Simulated readings without noise count as rounded to
    a millionth of their span: what a refit leaves of them is no gap.
    """
    found = _measure(errors, blocks)
    least = (THRESHOLDS.resolution * max(float(np.ptp(b.data)) for b in blocks)) ** 2
    if found.white >= least:
        return found
    white, shares = np.array([least - found.white]), np.eye(1, found.processes.shares.shape[1])
    processes = Processes(
        found.processes.corner_hz, np.concatenate([shares, found.processes.shares])
    )
    return Spectrum(processes, np.concatenate([white, found.variances]), found.measured)


def noise_lines(lines: SpectralLines) -> np.ndarray:
    """Lines of a repeating run from which noise is read: not synchronous, and not the slowest."""
    slow = np.arange(lines.hertz.size) < THRESHOLDS.slowest_line
    return ~lines.synchronous & ~slow & (lines.multiplicity == 2)


def _measure(errors: list[np.ndarray], blocks: list[PeriodBlock]) -> Spectrum:
    measured = any(b.periods > 1 for b in blocks)
    runs = []
    for error, block in zip(errors, blocks, strict=True):
        lines, power = SpectralLines.of(block), np.abs(to_lines(error)) ** 2
        if measured:
            pick = noise_lines(lines) & (block.periods > 1)
        else:
            pick = np.arange(power.size) > THRESHOLDS.fastest_fraction * power.size
        runs.append(RunLines(block.step_s, block.size, np.flatnonzero(pick), power[pick]))
    power = np.concatenate([run.power for run in runs])
    if power.size < THRESHOLDS.least_lines or not power.max() > 0:
        floor = float(np.mean(power)) if power.size else 0.0
        return Spectrum.of_white(max(floor, _TINY), measured=measured)
    if not measured:
        return Spectrum.of_white(float(np.median(power)) / EXPONENTIAL_MEDIAN, measured=False)
    return Spectrum(*estimate_shared_noise(runs), True)
