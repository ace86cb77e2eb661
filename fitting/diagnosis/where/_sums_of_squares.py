"""Sums of squares of errors, phase by phase: of the mean period and about it."""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._lines import SpectralLines
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum

_TINY = 1e-300


@dataclasses.dataclass(frozen=True, eq=False)
class RunSums:
    """Sums of one run.

    - `count`: readings at each phase. `mean`: of the error there, over periods. `scatter`: sum of
      squares about it.
    - `noise`: irreducible variance a reading. `colour`: noise of a synchronous line over that of
      another.
    - `lost_freedom`: degrees of freedom that fits and an origin of the run's own took away.
    """

    count: Float[np.ndarray, " phases"]
    mean: Float[np.ndarray, " phases"]
    scatter: Float[np.ndarray, " phases"]
    noise: float
    colour: float
    lost_freedom: float

    @property
    def readings(self) -> float:
        """Number of readings."""
        return float(self.count.sum())

    @property
    def phases(self) -> float:
        """Number of phases with a reading."""
        return float((self.count > 0).sum())

    @property
    def freedom(self) -> float:
        """Degrees of freedom that are left."""
        return max(self.readings - self.lost_freedom, 1.0)

    @property
    def scatter_variance(self) -> float:
        """Variance about the mean period; that of the noise where there is one period."""
        nonsynchronous = self.readings - self.phases
        return float(self.scatter.sum()) / nonsynchronous if nonsynchronous > 0 else self.noise

    @property
    def synchronous_noise(self) -> float:
        """What noise alone adds to the sum of squares of the mean period."""
        return max(self.phases - self.lost_freedom, 0.0) * self.colour * self.scatter_variance


def fill_masked(
    error: Float[np.ndarray, "periods phases"], block: PeriodBlock
) -> Float[np.ndarray, "periods phases"]:
    """Errors with the mean of the other periods where a reading is masked."""
    if block.use.all():
        return error
    count = block.use.sum(axis=0)
    mean = (error * block.use).sum(axis=0) / np.maximum(count, 1.0)
    return np.where(block.use > 0, error, mean[None, :])


def used_fraction(blocks: list[PeriodBlock]) -> float:
    """Share of readings in use; masked ones are zeros in the lines the spectrum was read from."""
    size = sum(b.size for b in blocks)
    return max(float(sum(b.use.sum() for b in blocks)) / size, 1e-6)


def sum_squares(
    errors: list[Float[np.ndarray, "_ _"]],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    *,
    own_origin: bool = False,
    fitted: int = 0,
) -> list[RunSums]:
    """The sums of each run. `fitted` parameters are shared out by numbers of phases."""
    phases = [float((b.use.sum(axis=0) > 0).sum()) for b in blocks]
    used = used_fraction(blocks)
    out = []
    for error, block, own in zip(errors, blocks, phases, strict=True):
        count = block.use.sum(axis=0)
        value = error * block.use
        if own_origin:
            value = (value - value.sum() / max(count.sum(), 1.0)) * block.use
        mean = value.sum(axis=0) / np.maximum(count, 1.0)
        scatter = (block.use * (value - mean[None, :]) ** 2).sum(axis=0)
        lines = SpectralLines.of(block)
        alive = lines.hertz > 0 if own_origin else lines.hertz >= 0
        colour = 1.0
        if block.periods > 1:
            other = spectrum.mean_variance(lines, ~lines.synchronous)
            colour = spectrum.mean_variance(lines, lines.synchronous & alive) / max(other, _TINY)
        noise = spectrum.mean_variance(lines, alive) / used
        lost = float(own_origin) + fitted * own / max(sum(phases), 1.0)
        out.append(RunSums(count, mean, scatter, noise, colour, lost))
    return out
