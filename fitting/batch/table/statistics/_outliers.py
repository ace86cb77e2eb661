"""Recordings whose parameters differ from those of the others.

Each recording is predicted from the reference set without it. Two statistics are tested: every
parameter by itself (Student's t), and all of them together (Hotelling's T-squared, as Mahalanobis
distance with the covariance of the estimate plus the scatter between recordings). The smaller of
their p-values, doubled, is corrected for the number of recordings by Holm's method: in tables
without outliers whose scatter is normal, one is reported in at most 5 %.

The reference set starts from the half closest to the medians and grows until the test excludes no
member and includes all others (Billor, Hadi and Velleman 2000, *Comput. Stat. Data Anal.*
34:279-298), so that outliers do not hide one another while they are fewer than half.
"""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float
from scipy import special

from fitting._multiple_tests import adjust_holm
from fitting.batch.table._thresholds import THRESHOLDS

from ._reference import Prediction, Reference

MAD = 1.4826022185056018  # standard deviations of a normal distribution in its MAD
_LEAST = float(np.finfo(float).eps)  # of a median, which is 0 where most recordings are equal


@dataclasses.dataclass(frozen=True)
class Comparison:
    """Each recording compared with the others.

    - `p`: corrected for the number of recordings and parameters; `raw`: for parameters alone.
    - `z`: each parameter's distance from the others in standard deviations, its standard error
      included; `given`: the same, given the recording's other parameters (of recordings that stand
      out; else, and where there are too few to tell, NaN).
    - `together`: whether all parameters were also tested together.
    - `scatter`: standard deviation between recordings, beyond standard errors.
    """

    p: Float[np.ndarray, " recordings"]
    raw: Float[np.ndarray, " recordings"]
    z: Float[np.ndarray, "recordings parameters"]
    given: Float[np.ndarray, "recordings parameters"]
    together: bool
    centre: Float[np.ndarray, " parameters"]
    scatter: Float[np.ndarray, " parameters"]

    @property
    def outlying(self) -> Bool[np.ndarray, " recordings"]:
        """Which recordings stand out."""
        return self.p < THRESHOLDS.significance


def compare_recordings(
    values: Float[np.ndarray, "recordings parameters"],
    covariance: Float[np.ndarray, "recordings parameters parameters"],
) -> Comparison | None:
    """Compare each recording with the others.

    **Arguments:**

    - `values`: finite; each parameter varies. `covariance`: of each recording's estimate.

    **Returns:** the comparison; None where there are fewer than `fewest_compared` recordings.
    """
    n, count = values.shape
    if n < THRESHOLDS.fewest_compared or not count:
        return None
    middle, unit = robust_scale(values)
    x = (values - middle) / unit
    c = covariance / (unit[:, None] * unit)
    member = _start(x, c)
    together = n - 1 >= THRESHOLDS.recordings_per_parameter * count
    reference = Reference.of(x, c, member)
    for _ in range(THRESHOLDS.growth_steps):
        predicted = reference.predict(x, c)
        p = _p_values(predicted, member, together)
        new = (p >= THRESHOLDS.significance / n).astype(float)
        if 2 * new.sum() <= n or (new == member).all():
            break
        member = new
        reference = Reference.of(x, c, member)
    raw, p = p, adjust_holm(p)
    given = np.full(x.shape, np.nan)
    if together:
        for i in np.flatnonzero((p < THRESHOLDS.significance) & (member == 0)):
            given[i] = reference.given_others(x[i], c[i])
    return Comparison(
        p=p,
        raw=raw,
        z=predicted.error / np.sqrt(predicted.variance),
        given=given,
        together=together,
        centre=middle + unit * reference.mean,
        scatter=unit * reference.scatter(),
    )


def robust_scale(
    values: Float[np.ndarray, "recordings parameters"],
) -> tuple[Float[np.ndarray, " parameters"], Float[np.ndarray, " parameters"]]:
    """Median, and the standard deviation by the median absolute deviation.

    Where more than half of the values are equal, the standard deviation itself.
    """
    middle = np.median(values, axis=0)
    spread = MAD * np.median(np.abs(values - middle), axis=0)
    return middle, np.where(spread > 0, spread, np.std(values, axis=0))


def _start(x: np.ndarray, c: np.ndarray) -> np.ndarray:
    """A robust reference set: grown from the half closest to the medians, parameter by parameter.

    Squared distances are scaled so that their median is that of chi-square, for a part of the
    recordings scatters less than all.
    """
    n, count = x.shape
    variance = np.diagonal(c, axis1=1, axis2=2)
    more = np.maximum(variance - np.median(variance, axis=0), 0.0)
    farthest = np.max(x**2 / (1.0 + more), axis=1)
    member = (farthest <= np.sort(farthest)[n // 2]).astype(float)
    cut = THRESHOLDS.growth
    together = n // 2 >= THRESHOLDS.recordings_per_parameter * count
    for _ in range(THRESHOLDS.growth_steps):
        predicted = Reference.of(x, c, member).predict(x, c)
        single, square = _f_statistics(predicted)
        free = predicted.size - 1.0
        single *= special.fdtri(1.0, free, 0.5)[:, None] / np.maximum(
            np.median(single, axis=0), _LEAST
        )
        near = np.all(special.fdtrc(1.0, free[:, None], single) >= cut / count, axis=1)
        if together:
            ratio = np.maximum(predicted.size - count, 1.0)
            square *= special.fdtri(count, ratio, 0.5) / max(float(np.median(square)), _LEAST)
            near &= special.fdtrc(count, ratio, square) >= cut
        new = near.astype(float)
        if 2 * new.sum() <= n or (new == member).all():
            break
        member = new
    return member


def _f_statistics(predicted: Prediction) -> tuple[np.ndarray, np.ndarray]:
    """Of each parameter by itself, and of all together; each has Fisher's distribution."""
    size, count = predicted.size, predicted.error.shape[1]
    ratio = np.maximum(size - count, 1.0)
    together = predicted.square * ratio / (np.maximum(size - 1.0, 1.0) * count)
    return predicted.error**2 / predicted.variance, together


def _p_values(predicted: Prediction, member: np.ndarray, together: bool) -> np.ndarray:
    """One p-value per recording, not yet corrected for their number.

    The reference set has lost its ends where recordings other than the one in question are not in
    it: its covariance is enlarged by what a normal distribution without them lacks (Croux and
    Haesbroeck 1999, *J. Multivar. Anal.* 71:161-190).
    """
    size, count = predicted.size, predicted.error.shape[1]
    single, square = _f_statistics(predicted)
    lost = np.maximum(np.sum(member == 0) - (member == 0), 0.0) / len(member)
    single /= _trimmed(1, lost / count)[:, None]
    p = special.fdtrc(1.0, (size - 1.0)[:, None], single).min(axis=1)
    p = np.minimum(1.0, count * p)
    if not together:
        return p
    square /= _trimmed(count, lost)
    whole = special.fdtrc(count, np.maximum(size - count, 1.0), square)
    return np.minimum(1.0, 2.0 * np.minimum(p, whole))


def _trimmed(count: int, lost: np.ndarray) -> np.ndarray:
    """By what the variance of a normal distribution exceeds that without its farthest part."""
    kept = 1.0 - lost
    ends = special.chdtri(count, np.maximum(lost, 1e-300))
    return kept / special.chdtr(count + 2, ends)
