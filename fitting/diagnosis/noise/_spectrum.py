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


def measure_spectrum(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock], *, of_fit: bool = False
) -> Spectrum:
    """The noise spectrum of the runs from `errors` ("periods phases"), robust against effects.

    Medians over lines that do not repeat, so single lines (pickup) do not count, and without the
    slowest lines of each run (drift, creep). `of_fit`: whether the errors are a fit's; then runs
    that do not repeat tell the noise where no other does, see `fast_lines`. Simulated readings
    without noise count as rounded to a millionth of their span: what a refit leaves of them is no
    gap.
    """
    found = _measure(errors, blocks, of_fit)
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


def fast_lines(blocks: list[PeriodBlock]) -> list[np.ndarray]:
    """Lines above all that repeating runs show, in the fastest part of runs that do not repeat.

    Readings sampled faster than those of any run that repeats hold noise of which that run says
    only how much there is, not at which frequencies. A model misses little so fast.
    """
    lines = [SpectralLines.of(block) for block in blocks]
    repeating = [each.hertz[-1] for each, b in zip(lines, blocks, strict=True) if b.periods > 1]
    band = max(repeating, default=np.inf)
    return [
        (each.hertz > band) & (np.arange(each.hertz.size) > _first_fast(each)) & (b.periods == 1)
        for each, b in zip(lines, blocks, strict=True)
    ]


def _first_fast(lines: SpectralLines) -> float:
    return THRESHOLDS.fastest_fraction * lines.hertz.size


def _measure(errors: list[np.ndarray], blocks: list[PeriodBlock], of_fit: bool) -> Spectrum:
    measured = any(b.periods > 1 for b in blocks)
    runs = []
    for error, block in zip(errors, blocks, strict=True):
        lines = SpectralLines.of(block)
        if measured:
            pick = noise_lines(lines) & (block.periods > 1)
        else:
            pick = np.arange(lines.hertz.size) > _first_fast(lines)
        runs.append(_run_lines(error, block, pick))
    power = np.concatenate([run.power for run in runs])
    if power.size < THRESHOLDS.least_lines or not power.max() > 0:
        floor = float(np.mean(power)) if power.size else 0.0
        return Spectrum.of_white(max(floor, _TINY), measured=measured)
    if not measured:
        return Spectrum.of_white(float(np.median(power)) / EXPONENTIAL_MEDIAN, measured=False)
    runs = [run for run in runs if run.line.size]
    found = Spectrum(*estimate_shared_noise(runs), True)
    fast = _fast_noise(errors, blocks, found.total) if of_fit else []
    return Spectrum(*estimate_shared_noise(runs + fast), True) if fast else found


def _fast_noise(
    errors: list[np.ndarray], blocks: list[PeriodBlock], total: float
) -> list[RunLines]:
    """The fast lines of runs in which they hold no more than `total`, the variance of a reading.

    What holds more is not noise of runs whose readings vary by that alone: the fit misses it.
    """
    out = []
    for error, block, pick in zip(errors, blocks, fast_lines(blocks), strict=True):
        run = _run_lines(error, block, pick)
        if run.line.size:
            held = np.median(run.power) / EXPONENTIAL_MEDIAN * run.line.size / pick.size
            out += [run] if held <= total else []
    return out


def _run_lines(error: np.ndarray, block: PeriodBlock, pick: np.ndarray) -> RunLines:
    power = np.abs(to_lines(error)) ** 2
    return RunLines(block.step_s, block.size, np.flatnonzero(pick), power[pick])
