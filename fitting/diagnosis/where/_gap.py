r"""How large the gap is: synchronous and non-synchronous, above the irreducible noise.

With `P` periods, `rbar` their mean and `s2` the variance about it, the mean square of an error is
`(<rbar^2> - <s2>/P) + s2`: what repeats with the scan, and all else. Of `s2`, the irreducible part
is read off the noise spectrum. So `total^2 = synchronous + nonsynchronous + noise_floor^2`,
exactly.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy import stats

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.noise import EXPONENTIAL_MEDIAN

from ._sum_variances import (
    SumVariances,
    chi_square_p_value,
    first_harmonics_p_values,
    satterthwaite_freedom,
    sum_variances,
)
from ._sums_of_squares import RunSums, sum_squares
from ._thresholds import THRESHOLDS

# Variance of the median of exponential numbers, over that of their mean, both as estimates of it.
_MEDIAN_VARIANCE = 1.0 / EXPONENTIAL_MEDIAN**2
_TINY = 1e-300
_NOTHING_REPEATS = (
    "Nothing repeats, so noise cannot be told from error: the noise taken off is that of the "
    "fastest lines, and the gap is a lower bound if noise is white."
)
_ONE_PERIOD = "One period: noise is taken as in the other runs, and all above it counts as locked."


@dataclasses.dataclass(frozen=True, eq=False)
class Gap:
    """The gap of one run, or of all (`runs` holds the parts).

    `total` and `noise_floor` are rms values, the others mean squares and may be negative: what is
    left of noise has either sign. `structural2`: synchronous and non-synchronous together.
    `*_stderr`: one standard error, from the spectrum; `floor2_stderr` of `noise_floor` squared. All
    sums count a degree of freedom less for each parameter fitted. `noise_floor` is `None` where no
    run has two periods: `synchronous` is then only a lower bound of the gap (`note` says so).
    """

    total: float
    synchronous: float
    nonsynchronous: float
    structural2: float
    noise_floor: float | None
    synchronous_stderr: float
    nonsynchronous_stderr: float
    structural2_stderr: float
    floor2_stderr: float
    p_value: float
    significant: bool
    note: str = ""
    runs: tuple["Gap", ...] = ()


def _estimate_gap(
    parts: list[RunSums],
    variances: list[SumVariances],
    information: Float[np.ndarray, "processes processes"],
    measured: bool,
) -> Gap:
    """The gap of these runs together; `information`: about the spectrum, of all runs."""
    free = sum(p.freedom for p in parts)
    noise = sum(p.freedom * p.noise for p in parts)
    of_mean = sum(float(p.count @ p.mean**2) for p in parts)
    about_mean = sum(float(p.scatter.sum()) for p in parts)
    nonsynchronous = sum(p.readings - p.phases for p in parts)
    noise_of_mean = [p.synchronous_noise for p in parts]
    expected = sum(noise_of_mean)
    var_of_mean, var_about_mean = (
        sum(v.synchronous for v in variances),
        sum(v.nonsynchronous for v in variances),
    )
    slope, picked = sum(v.slope for v in variances), sum(v.picked for v in variances)
    share = expected / about_mean if about_mean > 0 and nonsynchronous > 0 else 0.0
    if nonsynchronous > 0:
        synchronous, structural = (of_mean - expected) / free, (of_mean + about_mean - noise) / free
    else:
        synchronous = structural = (of_mean + about_mean - noise) / free
    inverse = np.linalg.inv(information)
    floor_variance = _MEDIAN_VARIANCE * float(slope @ inverse @ slope) if measured else 0.0
    # The floor is read off the same lines as `s2`: what the two share drops out.
    common = 2.0 * float(picked @ inverse @ slope) if measured else 0.0
    scale, least = 1.0 + share, THRESHOLDS.least_variance_share
    level = THRESHOLDS.false_alarm_level
    var_nonsynchronous = max(
        scale**2 * var_about_mean + floor_variance - scale * common, least * var_about_mean
    )
    var_structural = var_of_mean + max(
        var_about_mean + floor_variance - common, least * var_about_mean
    )
    fields = {
        "total": float(np.sqrt((of_mean + about_mean) / free)),
        "synchronous": synchronous,
        "nonsynchronous": structural - synchronous,
        "structural2": structural,
        "noise_floor": float(np.sqrt(noise / free)) if measured else None,
        "synchronous_stderr": float(
            np.sqrt(
                var_of_mean + (share**2 * var_about_mean if nonsynchronous > 0 else floor_variance)
            )
        )
        / free,
        "nonsynchronous_stderr": float(np.sqrt(var_nonsynchronous)) / free
        if nonsynchronous > 0
        else 0.0,
        "structural2_stderr": float(np.sqrt(var_structural)) / free,
        "floor2_stderr": float(np.sqrt(max(floor_variance, 0.0))) / free,
    }
    if not measured:
        p = chi_square_p_value(of_mean + about_mean, noise, 2.0 * noise**2 / free)
        large = (of_mean + about_mean) > THRESHOLDS.unrepeated_variance_ratio * noise
        sure = large and p < THRESHOLDS.unrepeated_level
        return Gap(**fields, p_value=p, significant=sure, note=_NOTHING_REPEATS)
    if nonsynchronous <= 0:
        p = chi_square_p_value(of_mean, noise, 2.0 * noise**2 / free + floor_variance)
        return Gap(**fields, p_value=p, significant=p < level, note=_ONE_PERIOD)
    freedom_on = satterthwaite_freedom(noise_of_mean, [v.freedom[0] for v in variances])
    freedom_off = satterthwaite_freedom(noise_of_mean, [v.freedom[1] for v in variances])
    p_synchronous = float(stats.f.sf(of_mean / max(expected, _TINY), freedom_on, freedom_off))
    scaled = scale * about_mean
    p_nonsynchronous = chi_square_p_value(
        scaled, scaled - (structural - synchronous) * free, var_nonsynchronous
    )
    # One kind of error or the other; what repeats, in all harmonics or in the first.
    tests = (p_synchronous, *first_harmonics_p_values(variances))
    p = min(1.0, 2.0 * p_nonsynchronous, 2.0 * len(tests) * min(tests))
    return Gap(**fields, p_value=p, significant=p < level)


def measure_gap(
    errors: list[Float[np.ndarray, "_ _"]],
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
    parts = sum_squares(errors, blocks, spectrum, own_origin=own_origin, fitted=fitted)
    variances = [
        sum_variances(e, b, spectrum, own_origin) for e, b in zip(errors, blocks, strict=True)
    ]
    # A process that the lines hardly see has a wide prior. Where none
    # of these runs could measure it, it was measured elsewhere: on as many lines, say.
    elsewhere = all(b.periods == 1 for b in blocks) * sum(b.size for b in blocks) / 2.0
    slope = np.sum([v.slope for v in variances], axis=0)
    prior = elsewhere * slope / slope.sum() + THRESHOLDS.process_information
    information = np.sum([v.information for v in variances], axis=0) + np.diag(prior)
    known = spectrum.measured
    runs = [
        _estimate_gap([p], [v], information, known) for p, v in zip(parts, variances, strict=True)
    ]
    whole = _estimate_gap(parts, variances, information, known)
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
