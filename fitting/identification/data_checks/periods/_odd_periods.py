"""Periods that differ from the others of their run: a device that had not settled, or a jump."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from fitting.identification.data_checks._first_period import first_period_miss
from fitting.identification.data_checks.drives._drive_reading import quieter_response
from rapi_jax import Run

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class OddPeriod:
    """How far one period of a run lies from the others, in the response's unit.

    `period`: its number, from 0. `rms`, `most`: over the period, of its smooth part less its mean;
    `shift`: of its mean. `p`: of noise doing as much.
    """

    run: str
    period: int
    rms: float
    most: float
    shift: float
    p: float


def find_unsettled(runs: Sequence[Run]) -> list[OddPeriod]:
    """The runs whose first period the noise among the later ones does not explain.

    Each run of three periods or more is tested; the rate of false alarms over all of them together
    is `THRESHOLDS.unsettled_level` (Bonferroni).
    """
    return _unexplained([one for run in runs for one in compare_periods(run)[:1]])


def find_late_starts(runs: Sequence[Run]) -> frozenset[str]:
    """The runs whose first period is no part of their noise: it is unlike those after it.

    By the noise among the later periods, or by where the response ends the first one.
    """
    found = {one.run for one in find_unsettled(runs)}
    missed = (run.name for run in runs if run.drive.periods > 1 and first_period_miss(run))
    return frozenset((*found, *missed))


def find_odd_periods(runs: Sequence[Run]) -> list[OddPeriod]:
    """The later periods that the noise among the others of their run does not explain.

    Of each run the likeliest; the rate of false alarms is that of `find_unsettled`.
    """
    tested = [one for run in runs for one in compare_periods(run)[1:]]
    found: dict[str, OddPeriod] = {}
    for one in sorted(_unexplained(tested), key=lambda one: one.p):
        found.setdefault(one.run, one)
    return [found[run.name] for run in runs if run.name in found]


def _unexplained(tested: Sequence[OddPeriod]) -> list[OddPeriod]:
    return [one for one in tested if one.p * len(tested) < THRESHOLDS.unsettled_level]


def compare_periods(run: Run) -> list[OddPeriod]:
    """Each period of a run beside its others; none where they cannot be compared.

    The lowest terms of each period's cosine transform (DCT-II, without its mean) are independent
    for white noise and for a random walk alike. Each term of one period is compared with those of
    the others by Student's t, and the p-values are combined by Fisher's method. Of four periods or
    more a linear trend goes out first: a rate that is slightly off, or a gain that drifts, is no
    settling. A tone that slips slowly through the scan (a few hundredths of a cycle each period) is
    no noise in this sense, and is told more often than that.
    """
    every = _cosine_terms(run)
    if every is None:
        return []
    return [_compare_period(run, every, k) for k in range(len(every))]


def _compare_period(run: Run, every: Float[np.ndarray, "periods terms"], k: int) -> OddPeriod:
    from scipy.special import chdtrc, stdtr

    mean, terms = every[:, 0], every[:, 1:]
    one, others = terms[k], np.delete(terms, k, axis=0)
    number = np.delete(np.arange(float(len(terms))) - k, k)  # this period is number 0
    powers = np.stack([number**n for n in range(1 + (len(others) > 2))], axis=1)
    here = np.eye(powers.shape[1])[0]
    fitted = np.linalg.lstsq(powers, others, rcond=None)[0]
    free = len(others) - powers.shape[1]
    variance = np.sum((others - powers @ fitted) ** 2, axis=0) / free
    wider = 1.0 + float(here @ np.linalg.inv(powers.T @ powers) @ here)
    t = (one - fitted[0]) / np.sqrt(np.maximum(variance, _known_variance(run)) * wider)
    p = np.maximum(2.0 * stdtr(free, -np.abs(t)), 1e-300)
    apart = one - others.mean(axis=0)
    return OddPeriod(
        run.name,
        k,
        float(np.sqrt(np.sum(apart**2) / _samples(run))),
        float(np.abs(_smooth(apart, _samples(run))).max()),
        float(mean[k] - np.delete(mean, k).mean()) / np.sqrt(_samples(run)),
        float(chdtrc(2.0 * p.size, -2.0 * np.log(p).sum())),
    )


def _samples(run: Run) -> int:
    return int(round(1.0 / (run.drive.rate * run.drive.step_s)))


def _cosine_terms(run: Run) -> Float[np.ndarray, "periods terms"] | None:
    """The terms 0 to `unsettled_terms` of each whole period, orthonormal over its samples."""
    from scipy.fft import dct

    drive = run.drive
    if not drive.repeats or drive.periods < 3 or not run.span > 0:
        return None
    samples = _samples(run)
    terms = min(THRESHOLDS.unsettled_terms, samples // 4)
    if not terms:
        return None
    begin = int(np.flatnonzero(drive.period == 0)[0])
    at = np.arange(drive.periods)[:, None] + np.arange(samples) / samples
    place = begin + at / (drive.rate * drive.step_s)
    value = np.interp(place, np.flatnonzero(run.valid), quieter_response(run)[run.valid])
    missing = np.interp(place, np.arange(drive.size), run.valid) < 1.0
    if missing.mean(axis=1).max() > THRESHOLDS.missing_readings or missing.all(axis=0).any():
        return None
    others = np.nanmean(np.where(missing, np.nan, value), axis=0)
    value = np.where(missing, others, value)
    return np.asarray(dct(value, norm="ortho", axis=1))[:, : terms + 1]


def _smooth(terms: Float[np.ndarray, " terms"], samples: int) -> Float[np.ndarray, " samples"]:
    from scipy.fft import idct

    return np.asarray(idct(np.r_[0.0, terms, np.zeros(samples - 1 - terms.size)], norm="ortho"))


def _known_variance(run: Run) -> float:
    """What the variance of a term is at least: of readings that are rounded and interpolated.

    Rounding to steps of q is noise of q^2 / 12. Between samples a corner of the response is cut off
    by up to a quarter of its change of slope, 4 span / n a sample of n in a period: two corners
    then add (span / n)^2 (2 / n) each to a term.
    """
    steps = np.diff(np.unique(run.response[run.valid]))
    steps = steps[steps > 1e-9 * run.span]
    rounding = float(steps.min()) if steps.size else 0.0
    samples = _samples(run)
    slip = abs(1.0 / (run.drive.rate * run.drive.step_s) - samples) * run.drive.periods
    corner = (run.span / samples) ** 2 * 4.0 / samples if slip > 1e-3 else 0.0
    return rounding**2 / 12.0 + corner + (THRESHOLDS.unsettled_least * run.span) ** 2
