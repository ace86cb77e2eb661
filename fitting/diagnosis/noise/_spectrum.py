"""Noise spectrum of a recording, measured from what does not repeat with the scan."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float

from ._lines import SpectralLines, to_lines
from ._periods import PeriodBlock
from ._spectrum_fit import EXPONENTIAL_MEDIAN, fit_spectrum
from ._thresholds import THRESHOLDS

_TINY = 1e-300


@dataclasses.dataclass(frozen=True)
class Spectrum:
    r"""Noise of a sample: $S(f) = w + (h/\Delta t) a / (1 + (f/f_c)^p)$, a variance a line.

    The white part is that of one reading. The red part is a process in time, so a line of faster
    samples holds more of it.

    - `white` ($w$), `red` ($a$): variances in the response's unit squared; the red one at a
      sampling interval of `step_s` ($h$, s).
    - `corner_hz` ($f_c$): Hz. `exponent` ($p$): 2 for one relaxation, about 1 for the many that
      make flicker noise.
    - `measured`: whether repeated periods measured it; where not, it is read off the fastest lines
      of the residual, and is only an upper bound of the white part.
    """

    white: float
    red: float
    corner_hz: float
    measured: bool
    step_s: float = 1.0
    exponent: float = 2.0

    def variance(
        self, hertz: Float[np.ndarray, " frequencies"], step_s: float
    ) -> Float[np.ndarray, " frequencies"]:
        """Variance a sample at each frequency, for samples every `step_s`."""
        return self.white + self.red_variance(hertz, step_s)

    def red_variance(
        self, hertz: Float[np.ndarray, " frequencies"], step_s: float
    ) -> Float[np.ndarray, " frequencies"]:
        """The red part of it."""
        return self.red * (self.step_s / step_s) / (1.0 + (hertz / self.corner_hz) ** self.exponent)

    def mean_variance(
        self,
        lines: SpectralLines,
        pick: Float[np.ndarray, " lines"] | Bool[np.ndarray, " lines"] | float = 1.0,
    ) -> float:
        """Variance of a reading; `pick`: 1 for the lines that count, 0 for others."""
        weight = lines.multiplicity * pick
        variance = self.variance(lines.hertz, lines.step_s)
        return float(weight @ variance / max(weight.sum(), 1.0))


def measure_spectrum(errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock]) -> Spectrum:
    """The noise spectrum of the runs from `errors` ("periods phases"), robust against effects.

    Medians over lines that do not repeat, so single lines (pickup) do not count, and without the
    slowest lines of each run (drift, creep). Simulated readings without noise count as rounded to
    a millionth of their span: what a refit leaves of them is no gap.
    """
    found = _measure(errors, blocks)
    least = (THRESHOLDS.resolution * max(float(np.ptp(b.data)) for b in blocks)) ** 2
    return dataclasses.replace(found, white=max(found.white, least))


def noise_lines(lines: SpectralLines) -> np.ndarray:
    """Lines of a repeating run from which noise is read: not synchronous, and not the slowest."""
    slow = np.arange(lines.hertz.size) < THRESHOLDS.slowest_line
    return ~lines.synchronous & ~slow & (lines.multiplicity == 2)


def _measure(errors: list[np.ndarray], blocks: list[PeriodBlock]) -> Spectrum:
    hertz, power, density = [], [], []
    step = float(np.median([b.step_s for b in blocks]))
    measured = any(b.periods > 1 for b in blocks)
    for error, block in zip(errors, blocks, strict=True):
        lines = SpectralLines.of(block)
        p = np.abs(to_lines(error)) ** 2
        if measured:
            pick = noise_lines(lines) & (block.periods > 1)
        else:
            pick = np.arange(p.size) > THRESHOLDS.fastest_fraction * p.size
        hertz.append(lines.hertz[pick])
        power.append(p[pick])
        density.append(np.full(int(pick.sum()), step / block.step_s))
    f, p, k = np.concatenate(hertz), np.concatenate(power), np.concatenate(density)
    if p.size < THRESHOLDS.least_lines or not p.max() > 0:
        floor = float(np.mean(p)) if p.size else 0.0
        return Spectrum(max(floor, _TINY), 0.0, 1.0, measured)
    if not measured:
        return Spectrum(float(np.median(p)) / EXPONENTIAL_MEDIAN, 0.0, 1.0, False)
    bins = THRESHOLDS.frequency_bins
    edges = np.geomspace(f[f > 0].min(), f.max() * (1 + 1e-9), bins + 1)
    where = np.digitize(f, edges)
    groups = [np.flatnonzero(where == b) for b in range(1, bins + 1)]
    groups = [g for g in groups if g.size >= THRESHOLDS.least_bin_lines]
    if len(groups) < THRESHOLDS.least_bins:
        return Spectrum(float(np.median(p)) / EXPONENTIAL_MEDIAN, 0.0, 1.0, True)
    white, red, corner, exponent = fit_spectrum(f, p, k, groups)
    return Spectrum(white, red, corner, True, step, exponent)
