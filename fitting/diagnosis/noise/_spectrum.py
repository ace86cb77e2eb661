"""Noise from repeated periods: its spectrum, the exact split into locked and not, the whitening.

The discrete Fourier transform of `P` whole periods puts all that repeats with the scan into every
`P`-th line and nothing else there but noise; all other lines hold what does not repeat.
"""

import dataclasses
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from ._periods import PeriodBlock

_BINS = 24  # of log frequency, for the medians
_SLOWEST = 6  # lines of one run below which slow effects, not noise, rule
_PASSES = 3
_BELOW = 4.0  # times the slowest frequency seen, that the corner may lie below it
_FLICKER = 0.7  # the least power
_CHANCE = 2.0  # fall of the cost (half a sum of squares) that one more number brings
_MEDIAN = np.log(2.0)  # of an exponential variable with mean 1
_RESOLUTION = 1e-6  # of the readings' span: what no reading is better than


@dataclasses.dataclass(frozen=True)
class Spectrum:
    r"""Noise of a sample: $S(f) = w + (h/\Delta t) a / (1 + (f/f_c)^p)$, a variance a line.

    The white part is that of one reading. The slow part is a process in time, so a line of faster
    samples holds more of it: `low` is what it has at a sampling interval of `step_s` ($h$, s). Its
    `power` ($p$) is 2 for one relaxation, and about 1 for the many that make flicker noise.
    `white`, `low`: variances in the response's unit squared. `corner`: Hz. `known`: whether
    repeated periods measured it; where not, it is read off the fastest lines of the residual, and
    is only an upper edge of the white part.
    """

    white: float
    low: float
    corner: float
    known: bool
    step_s: float = 1.0
    power: float = 2.0

    def at(self, hertz: np.ndarray, step_s: float) -> np.ndarray:
        """Variance a sample at each frequency, for samples every `step_s`."""
        return self.white + self.slow(hertz, step_s)

    def slow(self, hertz: np.ndarray, step_s: float) -> np.ndarray:
        """The part of the process in time alone."""
        return self.low * (self.step_s / step_s) / (1.0 + (hertz / self.corner) ** self.power)

    def mean(self, lines: "SpectralLines", pick: np.ndarray | float = 1.0) -> float:
        """Variance of a reading; `pick`: 1 for the lines that count, 0 for others."""
        weight = lines.twice * pick
        return float(weight @ self.at(lines.hertz, lines.step_s) / max(weight.sum(), 1.0))


@dataclasses.dataclass(frozen=True, eq=False)
class SpectralLines:
    """Which lines of a block's transform are what. `locked` are those that repeat with the scan."""

    hertz: np.ndarray
    step_s: float
    synchronous: np.ndarray
    twice: np.ndarray  # 2 for lines that stand for two (real and imaginary part count), 1 at ends

    @classmethod
    def of(cls, block: PeriodBlock) -> "SpectralLines":
        """The lines of a block."""
        k = np.arange(block.size // 2 + 1)
        synchronous = k % block.periods == 0
        twice = np.where((k == 0) | (2 * k == block.size), 1.0, 2.0)
        return cls(k / (block.size * block.step_s), block.step_s, synchronous, twice)


def to_lines(values: np.ndarray) -> np.ndarray:
    """Fourier lines of "... periods phases", scaled so that noise of variance v has power v."""
    flat = values.reshape(*values.shape[:-2], -1)
    return np.fft.rfft(flat, axis=-1) / np.sqrt(flat.shape[-1])


def measure_spectrum(errors: list[np.ndarray], blocks: list[PeriodBlock]) -> Spectrum:
    """The noise spectrum of the runs from `errors` ("periods phases"), robust against effects.

    Medians over lines that do not repeat, so single lines (pickup) do not count, and without the
    slowest lines of each run (drift, creep). Simulated readings without noise count as rounded to
    a millionth of their span: what a refit leaves of them is no gap.
    """
    found = _measure(errors, blocks)
    least = (_RESOLUTION * max(float(np.ptp(b.data)) for b in blocks)) ** 2
    return dataclasses.replace(found, white=max(found.white, least))


def _measure(errors: list[np.ndarray], blocks: list[PeriodBlock]) -> Spectrum:
    hertz, power, faster = [], [], []
    step = float(np.median([b.step_s for b in blocks]))
    known = any(b.periods > 1 for b in blocks)
    for error, block in zip(errors, blocks, strict=True):
        lines = SpectralLines.of(block)
        p = np.abs(to_lines(error)) ** 2
        if known:
            pick = ~lines.synchronous & (np.arange(p.size) >= _SLOWEST) & (lines.twice == 2)
            pick &= block.periods > 1
        else:
            pick = np.arange(p.size) > 0.6 * p.size
        hertz.append(lines.hertz[pick])
        power.append(p[pick])
        faster.append(np.full(int(pick.sum()), step / block.step_s))
    f, p, k = np.concatenate(hertz), np.concatenate(power), np.concatenate(faster)
    if p.size < 8 or not p.max() > 0:
        floor = float(np.mean(p)) if p.size else 0.0
        return Spectrum(max(floor, 1e-300), 0.0, 1.0, known)
    if not known:
        return Spectrum(float(np.median(p)) / _MEDIAN, 0.0, 1.0, False)
    edges = np.geomspace(f[f > 0].min(), f.max() * (1 + 1e-9), _BINS + 1)
    where = np.digitize(f, edges)
    groups = [np.flatnonzero(where == b) for b in range(1, _BINS + 1)]
    groups = [g for g in groups if g.size >= 6]
    if len(groups) < 4:
        return Spectrum(float(np.median(p)) / _MEDIAN, 0.0, 1.0, True)
    white, low, corner, steep = _smooth(f, p, k, groups)
    return Spectrum(white, low, corner, True, step, steep)


def _smooth(
    f: np.ndarray, p: np.ndarray, k: np.ndarray, groups: list[np.ndarray]
) -> tuple[float, float, float, float]:
    """White part, slow part, corner and power through the medians of groups of lines.

    The lines of a group differ in what they should be: by frequency, and by the sampling of their
    runs. So after a first pass the median is that of power over what the first pass expects.
    """
    x = np.array([np.exp(np.mean(np.log(f[g]))) for g in groups])
    share = np.array([np.mean(k[g]) for g in groups])
    weight = np.sqrt([min(g.size, 200.0) for g in groups])
    expected = np.ones_like(p)
    q, before = np.zeros(4), []
    for again in range(_PASSES):
        level = np.array([np.median(p[g] / expected[g]) for g in groups]) / _MEDIAN
        if again:
            level *= _law(q, x, share)
        q, before = _through(x, np.log(np.maximum(level, 1e-300)), weight, share, before)
        expected = _law(q, f, k)
    scale = float(np.median(p / expected)) / _MEDIAN  # of all lines
    white, low, corner = np.exp(q[:3])
    return float(scale * white), float(scale * low), float(corner), float(q[3])


def _law(q: np.ndarray, hertz: np.ndarray, share: np.ndarray) -> np.ndarray:
    return np.exp(q[0]) + share * np.exp(q[1]) / (1.0 + (hertz / np.exp(q[2])) ** q[3])


def _slopes(q: np.ndarray, hertz: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Derivatives of the law's logarithm by the four numbers: "frequencies numbers"."""
    ratio = np.log(hertz) - q[2]
    above = 1.0 / (1.0 + np.exp(-q[3] * ratio))  # of the slow part, what its corner takes away
    slow = share * np.exp(q[1]) * (1.0 - above)
    by = np.stack(
        [np.full(hertz.size, np.exp(q[0])), slow, slow * above * q[3], -slow * above * ratio]
    )
    return (by / _law(q, hertz, share)).T


def _through(
    x: np.ndarray,
    y: np.ndarray,
    weight: np.ndarray,
    share: np.ndarray,
    before: list[np.ndarray],
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Logarithms of white part, slow part and corner, and the power, through medians.

    A power other than 2 is taken where it draws the medians better by more than chance. Also both
    fits, with that power and another: the next pass starts from those of the one `before`.
    """
    top, bottom = float(np.exp(y.max())), float(np.exp(y[-4:].mean()))
    low = np.array([np.log(bottom) - 12.0, np.log(bottom) - 14.0, np.log(x[0] / _BELOW), _FLICKER])
    high = np.array([np.log(top) + 2.0, np.log(top) + 3.0, np.log(x[-1]) + 3.0, 2.0])
    size = np.log(max(top - bottom, 0.05 * bottom))
    corners = np.log(np.geomspace(max(x[0], 1e-3), x[-1], 4))

    def best(free: int) -> tuple[float, np.ndarray]:
        """The best fit with the first `free` of the four numbers moved."""
        fits = []
        steep = 2.0 if free == 3 else 1.2
        starts = [np.array([np.log(bottom), size, corner, steep]) for corner in corners]
        for start in [before[free - 3]] if before else starts:
            rest = start[free:]

            def errors(q: np.ndarray, rest: np.ndarray = rest) -> np.ndarray:
                return weight * (np.log(_law(np.concatenate([q, rest]), x, share)) - y)

            def slopes(q: np.ndarray, rest: np.ndarray = rest) -> np.ndarray:
                return weight[:, None] * _slopes(np.concatenate([q, rest]), x, share)[:, :free]

            given: Any = slopes  # typed as a string upstream
            fit = least_squares(
                errors,
                np.clip(start, low + 1e-6, high - 1e-6)[:free],
                given,
                bounds=(low[:free], high[:free]),
                loss="soft_l1",
                f_scale=2.0,
                xtol=1e-9,
                ftol=1e-9,
                gtol=1e-9,
            )
            fits.append((float(fit.cost), np.concatenate([fit.x, start[free:]])))
        return min(fits, key=lambda pair: pair[0])

    (one, simple), (many, flicker) = best(3), best(4)
    return flicker if one - many > _CHANCE else simple, [simple, flicker]


class Whitener:
    """Errors of all runs as two vectors of unit variance: locked to the scan, and not.

    `own_origin`: each run has a zero of its own, so its mean says nothing. `use`: which runs count.
    """

    def __init__(
        self,
        blocks: list[PeriodBlock],
        spectrum: Spectrum,
        own_origin: bool,
        *,
        use: np.ndarray | None = None,
    ) -> None:
        self.blocks, self.spectrum = blocks, spectrum
        self.lines = [SpectralLines.of(b) for b in blocks]
        self._scale = [
            np.sqrt(lines.twice / spectrum.at(lines.hertz, lines.step_s)) for lines in self.lines
        ]
        for k, scale in enumerate(self._scale):
            scale[0] *= not own_origin
            scale *= use is None or bool(use[k])

    def both(self, values: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """What repeats with the scan, and what does not, of values over all periods.

        Last axes "periods phases".
        """
        synchronous, nonsynchronous = [], [np.zeros((*values[0].shape[:-2], 0))]
        for value, lines, scale, block in zip(
            values, self.lines, self._scale, self.blocks, strict=True
        ):
            line = to_lines(value) * scale
            synchronous.append(
                self._split(line[..., lines.synchronous], lines.twice[lines.synchronous])
            )
            if block.periods > 1:
                nonsynchronous.append(
                    self._split(line[..., ~lines.synchronous], lines.twice[~lines.synchronous])
                )
        return np.concatenate(synchronous, axis=-1), np.concatenate(nonsynchronous, axis=-1)

    def synchronous(self, periods: list[np.ndarray]) -> np.ndarray:
        """What repeats with the scan, of values over one period; last axes "1 phases"."""
        parts = []
        for values, lines, scale, block in zip(
            periods, self.lines, self._scale, self.blocks, strict=True
        ):
            line = to_lines(values) * np.sqrt(block.periods)
            parts.append(
                self._split(line * scale[lines.synchronous], lines.twice[lines.synchronous])
            )
        return np.concatenate(parts, axis=-1)

    @staticmethod
    def _split(line: np.ndarray, twice: np.ndarray) -> np.ndarray:
        return np.concatenate([np.real(line), np.imag(line[..., twice == 2])], axis=-1)
