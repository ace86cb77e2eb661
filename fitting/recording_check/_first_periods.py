"""First periods that differ from the later ones: devices that had not settled."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from rapi_jax import Run

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class FirstPeriod:
    """How far the first period of a run lies from the later ones, in the response's unit.

    `rms`, `most`: over the period, of its smooth part less its mean. `p`: of noise doing as much.
    """

    run: str
    rms: float
    most: float
    p: float


def find_unsettled(runs: Sequence[Run]) -> list[FirstPeriod]:
    """The runs whose first period the noise among the later ones does not explain.

    Each run of three periods or more is tested; the rate of false alarms over all of them together
    is `THRESHOLDS.unsettled_level` (Bonferroni).
    """
    tested = [one for one in map(compare_first_period, runs) if one is not None]
    return [one for one in tested if one.p * len(tested) < THRESHOLDS.unsettled_level]


def compare_first_period(run: Run) -> FirstPeriod | None:
    """The first period of a run beside its later ones; `None` where they cannot be compared.

    The lowest terms of each period's cosine transform (DCT-II, without its mean) are independent
    for white noise and for a random walk alike. Each term of the first period is compared with
    those of the later ones by Student's t, and the p-values are combined by Fisher's method. Of
    four periods or more a linear trend goes out first: a rate that is slightly off, or a gain that
    drifts, is no settling. A tone that slips slowly through the scan (a few hundredths of a cycle
    each period) is no noise in this sense, and is told more often than that.
    """
    terms = _cosine_terms(run)
    if terms is None:
        return None
    first, later = terms[0], terms[1:]
    number = np.arange(1.0, len(later) + 1.0)
    powers = np.stack([number**k for k in range(1 + (len(later) > 2))], axis=1)
    at_first = np.eye(powers.shape[1])[0]  # the first period is number 0
    fitted = np.linalg.lstsq(powers, later, rcond=None)[0]
    free = len(later) - powers.shape[1]
    variance = np.sum((later - powers @ fitted) ** 2, axis=0) / free
    wider = 1.0 + float(at_first @ np.linalg.inv(powers.T @ powers) @ at_first)
    from scipy.special import chdtrc, stdtr

    t = (first - fitted[0]) / np.sqrt(np.maximum(variance, _known_variance(run)) * wider)
    p = np.maximum(2.0 * stdtr(free, -np.abs(t)), 1e-300)
    apart = first - later.mean(axis=0)
    return FirstPeriod(
        run.name,
        float(np.sqrt(np.sum(apart**2) / _samples(run))),
        float(np.abs(_smooth(apart, _samples(run))).max()),
        float(chdtrc(2.0 * p.size, -2.0 * np.log(p).sum())),
    )


def _samples(run: Run) -> int:
    return int(round(1.0 / (run.drive.rate * run.drive.step_s)))


def _cosine_terms(run: Run) -> Float[np.ndarray, "periods terms"] | None:
    """The terms 1 to `unsettled_terms` of each whole period, orthonormal over its samples."""
    from scipy.fft import dct

    drive = run.drive
    if not drive.repeats or drive.periods < 3 or not run.span > 0 or not run.valid.all():
        return None
    samples = _samples(run)
    terms = min(THRESHOLDS.unsettled_terms, samples // 4)
    if not terms:
        return None
    begin = int(np.flatnonzero(drive.period == 0)[0])
    at = np.arange(drive.periods)[:, None] + np.arange(samples) / samples
    place = begin + at / (drive.rate * drive.step_s)
    value = np.interp(place, np.arange(drive.size), run.response)
    return np.asarray(dct(value, norm="ortho", axis=1))[:, 1 : terms + 1]


def _smooth(terms: Float[np.ndarray, " terms"], samples: int) -> Float[np.ndarray, " samples"]:
    from scipy.fft import idct

    return np.asarray(idct(np.r_[0.0, terms, np.zeros(samples - 1 - terms.size)], norm="ortho"))


def _known_variance(run: Run) -> float:
    """What the variance of a term is at least: of readings that are rounded and interpolated.

    Rounding to steps of q is noise of q^2 / 12. Between samples a corner of the response is cut off
    by up to a quarter of its change of slope, 4 span / n a sample of n in a period: two corners
    then add (span / n)^2 (2 / n) each to a term.
    """
    steps = np.diff(np.unique(run.response))
    steps = steps[steps > 1e-9 * run.span]
    rounding = float(steps.min()) if steps.size else 0.0
    samples = _samples(run)
    slip = abs(1.0 / (run.drive.rate * run.drive.step_s) - samples) * run.drive.periods
    corner = (run.span / samples) ** 2 * 4.0 / samples if slip > 1e-3 else 0.0
    return rounding**2 / 12.0 + corner + (THRESHOLDS.unsettled_least * run.span) ** 2
