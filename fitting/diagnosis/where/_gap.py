r"""How large the gap is: locked to the scan, not locked, and the noise that nothing takes away.

With `P` periods, `rbar` their mean and `s2` the variance about it, the mean square of an error is
`(<rbar^2> - <s2>/P) + s2`: what repeats with the scan, and all else. Of `s2`, the irreducible part
is read off the noise spectrum. So `total^2 = locked + not_locked + noise_floor^2`, exactly.
"""

import dataclasses

import numpy as np
from scipy import stats

from fitting.diagnosis.noise._lines import SpectralLines, to_lines
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum, noise_lines
from fitting.diagnosis.noise._spectrum_fit import EXPONENTIAL_MEDIAN

LEVEL = 0.01  # of a false alarm
_BEYOND_DOUBT = (4.0, 1e-6)  # mean square over white noise, and level, where nothing repeats
# Variance of the median of exponential numbers, over that of their mean, both as estimates of it.
_MEDIAN_COST = 1.0 / EXPONENTIAL_MEDIAN**2
_FIRST = (4, 16)  # harmonics in which model error is looked for by itself
_TINY = 1e-300
_NOTHING_REPEATS = (
    "Nothing repeats, so noise cannot be told from error: the noise taken off is that of the "
    "fastest lines, and the gap is a lower edge if noise is white."
)
_ONE_PERIOD = "One period: noise is taken as in the other runs, and all above it counts as locked."


@dataclasses.dataclass(frozen=True, eq=False)
class Gap:
    """The gap of one run, or of all (`runs` holds the parts).

    `total` and `noise_floor` are rms values, the others mean squares and may be negative: what is
    left of noise has either sign. `*_stderr`: one standard error, from the spectrum. All sums count
    a degree of freedom less for each parameter fitted. `noise_floor` is `None` where no run has
    two periods: `locked` is then only a lower edge of the gap (`note` says so).
    """

    total: float
    synchronous: float
    nonsynchronous: float
    structural2: float
    noise_floor: float | None
    synchronous_stderr: float
    nonsynchronous_stderr: float
    structural2_stderr: float
    floor2_stderr: float  # of `noise_floor` squared
    p_value: float
    significant: bool
    note: str = ""
    runs: tuple["Gap", ...] = ()


@dataclasses.dataclass(frozen=True, eq=False)
class Sums:
    """Sums of one run, phase by phase; `noise`: irreducible variance a reading.

    `colour`: noise of a line that repeats with the scan over that of one that does not.
    `taken`: degrees of freedom that fits and an origin of the run's own took away.
    """

    count: np.ndarray
    mean: np.ndarray
    spread: np.ndarray
    noise: float
    colour: float
    taken: float

    @property
    def readings(self) -> float:
        """Number of readings."""
        return float(self.count.sum())

    @property
    def phases(self) -> float:
        """Number of phases with a reading."""
        return float((self.count > 0).sum())

    @property
    def free(self) -> float:
        """Degrees of freedom left to judge by."""
        return max(self.readings - self.taken, 1.0)

    @property
    def s2(self) -> float:
        """Variance about the mean period; that of the noise where there is one period."""
        nonsynchronous = self.readings - self.phases
        return float(self.spread.sum()) / nonsynchronous if nonsynchronous > 0 else self.noise

    @property
    def synchronous_noise(self) -> float:
        """What noise alone adds to the sum of squares of the mean period."""
        return max(self.phases - self.taken, 0.0) * self.colour * self.s2


def filled(error: np.ndarray, block: PeriodBlock) -> np.ndarray:
    """Errors with the mean of the other periods where a reading is masked."""
    if block.use.all():
        return error
    count = block.use.sum(axis=0)
    mean = (error * block.use).sum(axis=0) / np.maximum(count, 1.0)
    return np.where(block.use > 0, error, mean[None, :])


def usage(blocks: list[PeriodBlock]) -> float:
    """Share of readings in use; masked ones are zeros in the lines the spectrum was read from."""
    size = sum(b.size for b in blocks)
    return max(float(sum(b.use.sum() for b in blocks)) / size, 1e-6)


def sums(
    errors: list[np.ndarray],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    *,
    own_origin: bool = False,
    fitted: int = 0,
) -> list[Sums]:
    """The sums of each run. `fitted` parameters are shared out by numbers of phases."""
    phases = [float((b.use.sum(axis=0) > 0).sum()) for b in blocks]
    used = usage(blocks)
    out = []
    for error, block, own in zip(errors, blocks, phases, strict=True):
        count = block.use.sum(axis=0)
        value = error * block.use
        if own_origin:
            value = (value - value.sum() / max(count.sum(), 1.0)) * block.use
        mean = value.sum(axis=0) / np.maximum(count, 1.0)
        spread = (block.use * (value - mean[None, :]) ** 2).sum(axis=0)
        lines = SpectralLines.of(block)
        alive = lines.hertz > 0 if own_origin else lines.hertz >= 0
        colour = 1.0
        if block.periods > 1:
            nonsynchronous = spectrum.mean_variance(lines, ~lines.synchronous)
            colour = spectrum.mean_variance(lines, lines.synchronous & alive) / max(
                nonsynchronous, _TINY
            )
        noise = spectrum.mean_variance(lines, alive) / used
        taken = float(own_origin) + fitted * own / max(sum(phases), 1.0)
        out.append(Sums(count, mean, spread, noise, colour, taken))
    return out


@dataclasses.dataclass(frozen=True, eq=False)
class _Errors:
    """Variances of the sums, and how they move with the spectrum's three values."""

    synchronous: float
    nonsynchronous: float
    freedom: tuple[float, float]  # as of a chi-square: of noise in locked lines, and in the others
    bands: np.ndarray  # "bands 4": power and number of values, locked and not, noise being 1
    slope: np.ndarray  # of the noise summed over all lines
    picked: np.ndarray  # of that of the lines the spectrum was read from
    information: np.ndarray


def _error(error: np.ndarray, block: PeriodBlock, spectrum: Spectrum, own_origin: bool) -> _Errors:
    lines = SpectralLines.of(block)
    alive = lines.hertz > 0 if own_origin else lines.hertz >= 0
    twice, s = lines.multiplicity * alive, spectrum.variance(lines.hertz, lines.step_s)
    power = np.abs(to_lines(filled(error, block))) ** 2
    variance, freedom = [], []
    for at in (lines.synchronous, ~lines.synchronous):
        weight, level = twice[at], s[at]
        alone = 2.0 * float(weight @ level**2)
        # Noise times what is not noise; of all lines at once, as each alone is mostly chance.
        cross = 4.0 * float((weight * level) @ (power[at] - level))
        variance.append(alone + max(cross, 0.0))
        freedom.append(max(2.0 * float(weight @ level) ** 2 / max(alone, _TINY), 1.0))
    ratio = (lines.hertz / spectrum.corner_hz) ** 2
    low = spectrum.red_variance(lines.hertz, lines.step_s)
    moves = np.stack([np.full(s.shape, spectrum.white), low, 2.0 * low * ratio / (1.0 + ratio)])
    pick = noise_lines(lines)
    relative = np.where(pick[None, :], moves / np.maximum(s, _TINY)[None, :], 0.0)
    picked = moves @ (twice * pick)
    return _Errors(
        synchronous=variance[0],
        nonsynchronous=variance[1],
        freedom=(freedom[0], freedom[1]),
        bands=_bands(lines, twice, power / np.maximum(s, _TINY), block.periods),
        slope=moves @ twice,
        picked=picked,
        information=relative @ relative.T,
    )


def _bands(lines: SpectralLines, twice: np.ndarray, power: np.ndarray, periods: int) -> np.ndarray:
    """Of the first few harmonics, and the lines among them."""
    rows = []
    for harmonics in _FIRST:
        weight = twice * (np.arange(power.size) <= (harmonics + 0.5) * periods)
        on, off = weight * lines.synchronous, weight * ~lines.synchronous
        rows.append([on @ power, on.sum(), off @ power, off.sum()])
    return np.array(rows)


def _slow(errors: list[_Errors]) -> list[float]:
    """Chances of noise alone in the first harmonics of all runs, by the lines among them.

    Most model error is slow, and is lost in the noise of all lines together.
    """
    total = np.sum([e.bands for e in errors], axis=0)
    ratio = (total[:, 0] / total[:, 1]) / np.maximum(total[:, 2] / total[:, 3], _TINY)
    return [float(p) for p in stats.f.sf(ratio, total[:, 1], total[:, 3])]


def _chance(value: float, expected: float, variance: float) -> float:
    """How often noise alone gives `value`, with a chi-square of that mean and variance."""
    if value <= 0 or expected <= 0 or variance <= 0:
        return 1.0
    freedom = 2.0 * expected**2 / variance
    return float(stats.chi2.sf(freedom * value / expected, freedom))


def _freedom(parts: list[float], freedom: list[float]) -> float:
    """Degrees of freedom of a sum of parts that have theirs."""
    variance = sum(x**2 / f for x, f in zip(parts, freedom, strict=True))
    return max(sum(parts) ** 2 / max(variance, _TINY), 1.0)


def _part(parts: list[Sums], errors: list[_Errors], information: np.ndarray, known: bool) -> Gap:
    free = sum(p.free for p in parts)
    noise = sum(p.free * p.noise for p in parts)
    a = sum(float(p.count @ p.mean**2) for p in parts)
    b = sum(float(p.spread.sum()) for p in parts)
    nonsynchronous = sum(p.readings - p.phases for p in parts)
    each = [p.synchronous_noise for p in parts]
    expected = sum(each)
    var_a, var_b = sum(e.synchronous for e in errors), sum(e.nonsynchronous for e in errors)
    slope, picked = sum(e.slope for e in errors), sum(e.picked for e in errors)
    share = expected / b if b > 0 and nonsynchronous > 0 else 0.0
    if nonsynchronous > 0:
        synchronous, structural = (a - expected) / free, (a + b - noise) / free
    else:
        synchronous = structural = (a + b - noise) / free
    inverse = np.linalg.inv(information)
    own = _MEDIAN_COST * float(slope @ inverse @ slope) if known else 0.0
    # The floor is read off the same lines as `s2`: what the two share drops out.
    common = 2.0 * float(picked @ inverse @ slope) if known else 0.0
    scale = 1.0 + share
    var_not = max(scale**2 * var_b + own - scale * common, 0.02 * var_b)
    var_all = var_a + max(var_b + own - common, 0.02 * var_b)
    fields = {
        "total": float(np.sqrt((a + b) / free)),
        "synchronous": synchronous,
        "nonsynchronous": structural - synchronous,
        "structural2": structural,
        "noise_floor": float(np.sqrt(noise / free)) if known else None,
        "synchronous_stderr": float(
            np.sqrt(var_a + (share**2 * var_b if nonsynchronous > 0 else own))
        )
        / free,
        "nonsynchronous_stderr": float(np.sqrt(var_not)) / free if nonsynchronous > 0 else 0.0,
        "structural2_stderr": float(np.sqrt(var_all)) / free,
        "floor2_stderr": float(np.sqrt(max(own, 0.0))) / free,
    }
    if not known:
        p = _chance(a + b, noise, 2.0 * noise**2 / free)
        sure = (a + b) > _BEYOND_DOUBT[0] * noise and p < _BEYOND_DOUBT[1]
        return Gap(**fields, p_value=p, significant=sure, note=_NOTHING_REPEATS)
    if nonsynchronous <= 0:
        p = _chance(a, noise, 2.0 * noise**2 / free + own)
        return Gap(**fields, p_value=p, significant=p < LEVEL, note=_ONE_PERIOD)
    top = _freedom(each, [e.freedom[0] for e in errors])
    bottom = _freedom(each, [e.freedom[1] for e in errors])
    p_synchronous = float(stats.f.sf(a / max(expected, _TINY), top, bottom))
    p_nonsynchronous = _chance(scale * b, scale * b - (structural - synchronous) * free, var_not)
    # One kind of error or the other; what repeats, in all harmonics or in the first.
    p = min(
        1.0, 2.0 * p_nonsynchronous, 2.0 * (1 + len(_FIRST)) * min(p_synchronous, *_slow(errors))
    )
    return Gap(**fields, p_value=p, significant=p < LEVEL)


def measure_gap(
    errors: list[np.ndarray],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    *,
    own_origin: bool = False,
    fitted: int = 0,
) -> Gap:
    """The gap that `errors` ("periods phases" a run, model less data) leave above the noise.

    `own_origin`: the runs have a zero each, so their means are no error. `fitted`: number of
    parameters that were fitted to what repeats in these same data; 0 for data held out.
    """
    parts = sums(errors, blocks, spectrum, own_origin=own_origin, fitted=fitted)
    variances = [_error(e, b, spectrum, own_origin) for e, b in zip(errors, blocks, strict=True)]
    # A value of the spectrum that its lines do not see (no slow part) has a wide prior. Where none
    # of these runs could measure it, it was measured elsewhere: on as many lines, say.
    elsewhere = all(b.periods == 1 for b in blocks) * sum(b.size for b in blocks) / 2.0
    prior = np.diag([elsewhere + 1e-6, 0.1, 0.25])
    information = np.sum([v.information for v in variances], axis=0) + prior
    known = spectrum.measured
    runs = [_part([p], [v], information, known) for p, v in zip(parts, variances, strict=True)]
    whole = _part(parts, variances, information, known)
    return dataclasses.replace(whole, runs=tuple(runs))


def split_gap(
    total_given: float | None, total_refit: float, noise_floor: float | None
) -> dict[str, float | None]:
    """The parts of the gap of a model that was brought, by what refitting it takes away.

    All are rms values, and `total^2 = parametric^2 + structural^2 + noise_floor^2` exactly, a floor
    of `None` counting as 0. `total_given`: of the model as brought, `None` where there was none. A
    refit that came out worse takes nothing away: what it lost is in `structural`. A total below the
    floor, which chance alone brings about, is all noise.
    """
    given = total_refit if total_given is None else total_given
    refit = min(total_refit, given)
    floor = None if noise_floor is None else min(noise_floor, refit)
    return {
        "total": given,
        "noise_floor": floor,
        "parametric": float(np.sqrt(given**2 - refit**2)),
        "structural": float(np.sqrt(refit**2 - (floor or 0.0) ** 2)),
    }


@dataclasses.dataclass(frozen=True)
class Trend:
    """What of one run moves on with its periods.

    `s2`, `s2_left`: variance about the mean period, and about a line through the periods at each
    phase. `trend2`: mean square of that line, less noise (signed). `drift`, `drift_stderr`: of the
    run's mean, response unit/s. `p_value`: of no trend, over all harmonics at once.
    """

    s2: float
    s2_left: float
    trend2: float
    drift: float
    drift_stderr: float
    p_value: float


def session_trend(errors: list[np.ndarray], blocks: list[PeriodBlock]) -> list[Trend | None]:
    """Regression on the period index, run by run; `None` with fewer than three periods.

    Each harmonic of the periods has a mean, a slope and `P - 2` degrees of freedom left, so its
    slope is tested by F(2, 2(P - 2)), whatever the noise's colour. The smallest of all p-values
    counts, adjusted for their number by Simes' rule.
    """
    return [_trend(filled(e, b), b) for e, b in zip(errors, blocks, strict=True)]


def _trend(error: np.ndarray, block: PeriodBlock) -> Trend | None:
    count, phases = error.shape
    if count < 3:
        return None
    line = np.fft.rfft(error, axis=1) / np.sqrt(phases)
    k = np.arange(line.shape[1])
    twice = np.where((k == 0) | (2 * k == phases), 1.0, 2.0)
    index = np.arange(count) - (count - 1) / 2.0
    about = line - line.mean(axis=0)[None, :]
    width = float(index @ index)
    slope = index @ about / width
    rest = about - index[:, None] * slope[None, :]
    left = (np.abs(rest) ** 2).sum(axis=0) / (count - 2)
    trend = width * np.abs(slope) ** 2
    ratio = trend / np.maximum(left, _TINY)
    p = np.sort(stats.f.sf(ratio, twice, twice * (count - 2)))
    simes = float(np.min(p * p.size / np.arange(1, p.size + 1)))
    seconds = phases * block.step_s * np.sqrt(phases)
    return Trend(
        float(twice @ (np.abs(about) ** 2).sum(axis=0)) / (phases * (count - 1)),
        float(twice @ left) / phases,
        float(twice @ (trend - left)) / (phases * count),
        float(slope[0].real / seconds),
        float(np.sqrt(left[0] / width) / seconds),
        min(simes, 1.0),
    )
