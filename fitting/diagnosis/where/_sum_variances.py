"""Variances of the sums of squares, from the noise spectrum, and tests of noise alone."""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy import stats

from fitting.diagnosis.noise._lines import SpectralLines, to_lines
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum, noise_lines

from ._sums_of_squares import fill_masked
from ._thresholds import THRESHOLDS

_TINY = 1e-300


@dataclasses.dataclass(frozen=True, eq=False)
class SumVariances:
    """Variances of the sums of a run, and their derivatives by the noise's variances.

    - `synchronous`, `nonsynchronous`: of the sum of squares of the mean period, and about it.
    - `freedom`: degrees of freedom of noise in synchronous and in other lines, as of a chi-square.
    - `bands`: of the first harmonics, power and number of values, synchronous and not, noise being
      1.
    - `slope`: derivative of the noise summed over all lines, by the logarithm of the variance of
      each process; `picked`: of that of the lines the spectrum was read from. `information`: of
      those lines about the logarithms.
    """

    synchronous: float
    nonsynchronous: float
    freedom: tuple[float, float]
    bands: Float[np.ndarray, "bands 4"]
    slope: Float[np.ndarray, " processes"]
    picked: Float[np.ndarray, " processes"]
    information: Float[np.ndarray, "processes processes"]


def sum_variances(
    error: Float[np.ndarray, "periods phases"],
    block: PeriodBlock,
    spectrum: Spectrum,
    own_origin: bool,
) -> SumVariances:
    """The variances of one run's sums."""
    lines = SpectralLines.of(block)
    alive = lines.hertz > 0 if own_origin else lines.hertz >= 0
    weights, s = lines.multiplicity * alive, spectrum.of_lines(lines)
    power = np.abs(to_lines(fill_masked(error, block))) ** 2
    variance, freedom = [], []
    for at in (lines.synchronous, ~lines.synchronous):
        weight, level = weights[at], s[at]
        alone = 2.0 * float(weight @ level**2)
        # Noise times what is not noise; of all lines at once, as each alone is mostly chance.
        cross = 4.0 * float((weight * level) @ (power[at] - level))
        variance.append(alone + max(cross, 0.0))
        freedom.append(max(2.0 * float(weight @ level) ** 2 / max(alone, _TINY), 1.0))
    moves = spectrum.by_process(lines)
    pick = noise_lines(lines)
    relative = np.where(pick[None, :], moves / np.maximum(s, _TINY)[None, :], 0.0)
    return SumVariances(
        synchronous=variance[0],
        nonsynchronous=variance[1],
        freedom=(freedom[0], freedom[1]),
        bands=_band_sums(lines, weights, power / np.maximum(s, _TINY), block.periods),
        slope=moves @ weights,
        picked=moves @ (weights * pick),
        information=relative @ relative.T,
    )


def harmonic_bands() -> tuple[int, int]:
    """Numbers of first harmonics in which model error is looked for by itself."""
    return THRESHOLDS.first_harmonics, THRESHOLDS.more_harmonics


def _band_sums(
    lines: SpectralLines, weights: np.ndarray, power: np.ndarray, periods: int
) -> Float[np.ndarray, "bands 4"]:
    """Of the first few harmonics, and the lines among them; see `SumVariances.bands`."""
    rows = []
    for harmonics in harmonic_bands():
        weight = weights * (np.arange(power.size) <= (harmonics + 0.5) * periods)
        on, off = weight * lines.synchronous, weight * ~lines.synchronous
        rows.append([on @ power, on.sum(), off @ power, off.sum()])
    return np.array(rows)


def first_harmonics_p_values(variances: list[SumVariances]) -> list[float]:
    """Chances of noise alone in the first harmonics of all runs, by the lines among them.

    Most model error is slow, and is lost in the noise of all lines together.
    """
    total = np.sum([v.bands for v in variances], axis=0)
    ratio = (total[:, 0] / total[:, 1]) / np.maximum(total[:, 2] / total[:, 3], _TINY)
    return [float(p) for p in stats.f.sf(ratio, total[:, 1], total[:, 3])]


def chi_square_p_value(value: float, expected: float, variance: float) -> float:
    """How often noise alone gives `value`, with a chi-square of that mean and variance."""
    if value <= 0 or expected <= 0 or variance <= 0:
        return 1.0
    freedom = 2.0 * expected**2 / variance
    return float(stats.chi2.sf(freedom * value / expected, freedom))


def satterthwaite_freedom(parts: list[float], freedom: list[float]) -> float:
    """Degrees of freedom of a sum of mean squares that have theirs (Satterthwaite 1946)."""
    variance = sum(x**2 / f for x, f in zip(parts, freedom, strict=True))
    return max(sum(parts) ** 2 / max(variance, _TINY), 1.0)
