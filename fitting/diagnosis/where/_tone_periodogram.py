"""Power of one run's non-synchronous errors over noise, on a fine grid of frequencies."""

import dataclasses

import numpy as np
from jaxtyping import Float, Int

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.noise._thresholds import THRESHOLDS as NOISE
from fitting.noise import EXPONENTIAL_MEDIAN

from ._thresholds import THRESHOLDS

_TINY = 1e-300


@dataclasses.dataclass(frozen=True, eq=False)
class Periodogram:
    """How strong a tone of each frequency would be in one run, over its noise.

    - `seconds`: of the run. `length`: of the padded transform; `line`: in it, of each frequency.
    - `kept`: share of a tone's power that does not repeat with the scan; 0 where none is sought.
    - `level`: of noise, by its spectrum. `weight`: of a tone's squared amplitude in `z`.
    - `z`: exponential with mean 1 where there is noise alone.
    """

    seconds: float
    length: int
    line: Int[np.ndarray, " grid"]
    kept: Float[np.ndarray, " grid"]
    level: Float[np.ndarray, " grid"]
    weight: Float[np.ndarray, " grid"]
    z: Float[np.ndarray, " grid"]


def periodogram(
    error: Float[np.ndarray, "periods phases"],
    block: PeriodBlock,
    spectrum: Spectrum,
    grid: Float[np.ndarray, " grid"],
) -> Periodogram:
    """Of a run of several periods, at the frequencies `grid`, Hz."""
    periods, phases = error.shape
    seconds = error.size * block.step_s
    length = 1 << int(np.ceil(np.log2(8 * error.size)))
    line = np.round(grid * length * block.step_s).astype(int)
    cycles = grid * phases * block.step_s
    with np.errstate(invalid="ignore", divide="ignore"):
        comb = np.sin(np.pi * cycles * periods) / (periods * np.sin(np.pi * cycles))
    kept = 1.0 - np.where(np.isfinite(comb), comb, 1.0) ** 2
    slow, fast = NOISE.slowest_line / seconds, 0.5 / block.step_s - 2.0 / seconds
    kept = np.where(
        (grid >= slow) & (grid <= fast) & (kept > THRESHOLDS.least_tone_share), kept, 0.0
    )
    level = np.maximum(spectrum.variance(grid, block.step_s), _TINY)
    line = np.minimum(line, length // 2)
    empty = Periodogram(seconds, length, line, kept, level, kept, kept)
    return measure_again(empty, error, block, spectrum, grid)


def measure_again(
    search: Periodogram,
    error: Float[np.ndarray, "periods phases"],
    block: PeriodBlock,
    spectrum: Spectrum,
    grid: Float[np.ndarray, " grid"],
) -> Periodogram:
    """The same of other errors of that run, such as those less a tone."""
    rest = (error - error.mean(axis=0)[None, :]).ravel()
    size, kept = rest.size, search.kept
    power = np.abs(np.fft.rfft(rest, search.length)[search.line]) ** 2 / size
    # Where the spectrum's form falls short of the noise, the level all around counts.
    hertz = np.fft.rfftfreq(size, block.step_s)
    level = np.maximum(spectrum.variance(hertz, block.step_s), _TINY)
    own = np.abs(np.fft.rfft(rest)) ** 2 / size / level
    here = _local_level(own[np.arange(own.size) % block.periods != 0])
    excess = np.maximum(np.interp(grid, np.linspace(0.0, hertz[-1], here.size), here), 1.0)
    z = np.where(kept > 0, power / (search.level * excess * np.where(kept > 0, kept, 1.0)), 0.0)
    weight = kept * size / (4.0 * search.level * excess)
    return dataclasses.replace(search, weight=weight, z=z)


def _local_level(power: np.ndarray) -> np.ndarray:
    """The level about each line, from the median of blocks of lines."""
    blocks = max(power.size // (2 * THRESHOLDS.level_lines), 1)
    edges = np.linspace(0, power.size, blocks + 1).astype(int)
    level = [
        np.median(power[a:b]) / EXPONENTIAL_MEDIAN
        for a, b in zip(edges[:-1], edges[1:], strict=True)
    ]
    middle = (edges[:-1] + edges[1:] - 1) / 2.0
    return np.interp(np.arange(power.size), middle, np.array(level))
