"""Whitening: errors divided by the noise spectrum, split into scan-synchronous and not, exactly."""

import copy
import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from ._lines import SpectralLines, to_lines
from ._misfit_covariance import MisfitCovariance
from ._periods import PeriodBlock
from ._spectrum import Spectrum


class Whitener:
    """Errors of all runs as two vectors of unit variance: synchronous and non-synchronous.

    `own_origin`: each run, or those told, has a zero of its own, so its mean says nothing. `use`:
    which runs count.
    What a base that is not quite the device's leaves is whitened, too, `with_misfit`.
    """

    def __init__(
        self,
        blocks: list[PeriodBlock],
        spectrum: Spectrum,
        own_origin: bool | Bool[np.ndarray, " runs"],
        *,
        use: Bool[np.ndarray, " runs"] | None = None,
    ) -> None:
        self.blocks, self.spectrum = blocks, spectrum
        self.misfit: MisfitCovariance | None = None
        self.lines = [SpectralLines.of(b) for b in blocks]
        scales = [np.sqrt(lines.multiplicity / spectrum.of_lines(lines)) for lines in self.lines]
        own = np.broadcast_to(own_origin, len(blocks))
        for k, scale in enumerate(scales):
            scale[0] *= not own[k]
            scale *= use is None or bool(use[k])
        multiplicity = [lines.multiplicity for lines in self.lines]
        repeating = [lines.synchronous for lines in self.lines]
        others = [
            ~on if block.periods > 1 else np.zeros_like(on)
            for on, block in zip(repeating, blocks, strict=True)
        ]
        self._synchronous = _RealLines.of(scales, multiplicity, repeating)
        self._nonsynchronous = _RealLines.of(scales, multiplicity, others)
        once = [
            [part[on] for part, on in zip(parts, repeating, strict=True)]
            for parts in (scales, multiplicity, repeating)
        ]
        self._mean_period = _RealLines.of(*once)

    @cached_property
    def reading_variance(self) -> list[float]:
        """Variance of the noise of a reading of each run."""
        return [self.spectrum.mean_variance(lines) for lines in self.lines]

    @cached_property
    def used_lines(self) -> int:
        """How many whitened errors there are, without those of runs and means that do not count."""
        parts = (self._synchronous, self._nonsynchronous)
        return int(sum(np.count_nonzero(part.scale) for part in parts))

    def with_misfit(self, misfit: MisfitCovariance) -> "Whitener":
        """The same, where synchronous errors have this covariance beyond that of noise."""
        out = copy.copy(self)
        out.misfit = misfit
        return out

    @property
    def run_of_line(self) -> Int[np.ndarray, " lines"]:
        """The run that each whitened error is of: of the synchronous ones, then of the others."""
        parts: list[np.ndarray] = []
        for synchronous in (True, False):
            for k, (lines, block) in enumerate(zip(self.lines, self.blocks, strict=True)):
                on = lines.synchronous == synchronous
                if synchronous or block.periods > 1:
                    parts.append(np.full(int(lines.multiplicity[on].sum()), k))
        return np.concatenate(parts)

    def whiten(
        self, values: list[Float[np.ndarray, "*more _ _"]]
    ) -> tuple[Float[np.ndarray, "*more synchronous"], Float[np.ndarray, "*more nonsynchronous"]]:
        """Synchronous and non-synchronous part of values of each run, "periods phases"."""
        lines = np.concatenate([to_lines(value) for value in values], axis=-1)
        return self._whiten_misfit(self._synchronous(lines)), self._nonsynchronous(lines)

    def whiten_mean_period(
        self, periods: list[Float[np.ndarray, "*more 1 _"]]
    ) -> Float[np.ndarray, "*more synchronous"]:
        """The synchronous part of values over one period, "1 phases", all periods being alike."""
        lines = [
            to_lines(values) * np.sqrt(block.periods)
            for values, block in zip(periods, self.blocks, strict=True)
        ]
        return self._whiten_misfit(self._mean_period(np.concatenate(lines, axis=-1)))

    def _whiten_misfit(
        self, synchronous: Float[np.ndarray, "*more synchronous"]
    ) -> Float[np.ndarray, "*more synchronous"]:
        return synchronous if self.misfit is None else self.misfit.whiten(synchronous)


@dataclasses.dataclass(frozen=True, eq=False)
class _RealLines:
    """Real and imaginary parts of some lines of all runs, in units of their noise.

    Run after run: the real parts, then the imaginary parts of lines that have one. `place`: of each
    among the real and imaginary parts of all lines in turn.
    """

    place: Int[np.ndarray, " parts"]
    scale: Float[np.ndarray, " parts"]

    @classmethod
    def of(
        cls,
        scales: list[Float[np.ndarray, " _"]],
        multiplicity: list[Float[np.ndarray, " _"]],
        picked: list[Bool[np.ndarray, " _"]],
    ) -> "_RealLines":
        """Those `picked` of the lines of each run."""
        places, factors, begin = [], [], 0
        for scale, parts, on in zip(scales, multiplicity, picked, strict=True):
            at = np.flatnonzero(on)
            both = at[parts[at] == 2]
            places += [2 * (begin + at), 2 * (begin + both) + 1]
            factors += [scale[at], scale[both]]
            begin += scale.size
        return cls(np.concatenate(places), np.concatenate(factors))

    def __call__(
        self, lines: Complex[np.ndarray, "*more lines"]
    ) -> Float[np.ndarray, "*more parts"]:
        """Those of `lines`, of all runs one after the other."""
        return np.ascontiguousarray(lines).view(float)[..., self.place] * self.scale
