"""Whitening: errors divided by the noise spectrum, split into scan-synchronous and not, exactly."""

import copy

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from ._lines import SpectralLines, to_lines
from ._misfit_covariance import MisfitCovariance
from ._periods import PeriodBlock
from ._spectrum import Spectrum


class Whitener:
    """Errors of all runs as two vectors of unit variance: synchronous and non-synchronous.

    `own_origin`: each run has a zero of its own, so its mean says nothing. `use`: which runs count.
    What a base that is not quite the device's leaves is whitened, too, `with_misfit`.
    """

    def __init__(
        self,
        blocks: list[PeriodBlock],
        spectrum: Spectrum,
        own_origin: bool,
        *,
        use: Bool[np.ndarray, " runs"] | None = None,
    ) -> None:
        self.blocks, self.spectrum = blocks, spectrum
        self.misfit: MisfitCovariance | None = None
        self.lines = [SpectralLines.of(b) for b in blocks]
        self._scale = [
            np.sqrt(lines.multiplicity / spectrum.of_lines(lines)) for lines in self.lines
        ]
        for k, scale in enumerate(self._scale):
            scale[0] *= not own_origin
            scale *= use is None or bool(use[k])

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
        synchronous, nonsynchronous = [], [np.zeros((*values[0].shape[:-2], 0))]
        for value, lines, scale, block in zip(
            values, self.lines, self._scale, self.blocks, strict=True
        ):
            line = to_lines(value) * scale
            on = lines.synchronous
            synchronous.append(_to_real(line[..., on], lines.multiplicity[on]))
            if block.periods > 1:
                nonsynchronous.append(_to_real(line[..., ~on], lines.multiplicity[~on]))
        return (
            self._whiten_misfit(np.concatenate(synchronous, axis=-1)),
            np.concatenate(nonsynchronous, axis=-1),
        )

    def whiten_mean_period(
        self, periods: list[Float[np.ndarray, "*more 1 _"]]
    ) -> Float[np.ndarray, "*more synchronous"]:
        """The synchronous part of values over one period, "1 phases", all periods being alike."""
        parts = []
        for values, lines, scale, block in zip(
            periods, self.lines, self._scale, self.blocks, strict=True
        ):
            line = to_lines(values) * np.sqrt(block.periods)
            on = lines.synchronous
            parts.append(_to_real(line * scale[on], lines.multiplicity[on]))
        return self._whiten_misfit(np.concatenate(parts, axis=-1))

    def _whiten_misfit(
        self, synchronous: Float[np.ndarray, "*more synchronous"]
    ) -> Float[np.ndarray, "*more synchronous"]:
        return synchronous if self.misfit is None else self.misfit.whiten(synchronous)


def _to_real(
    line: Complex[np.ndarray, "*more lines"], multiplicity: Float[np.ndarray, " lines"]
) -> Float[np.ndarray, "*more _"]:
    """Real parts, then the imaginary parts of lines that have one."""
    return np.concatenate([np.real(line), np.imag(line[..., multiplicity == 2])], axis=-1)
