"""Whether a response follows its drive at all, or chance alone would look as it does."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from fitting.identification.data_checks._fault import Fault
from rapi_jax import Recording, Run

from ._thresholds import THRESHOLDS


def find_unrelated(recording: Recording) -> list[Fault]:
    """A fault where no run has a response that follows its drive beyond chance.

    Of a wrong column one recording in 100 passes all the same (`THRESHOLDS.follows_level`, with
    Bonferroni's correction over runs and harmonics). A run that neither repeats twice nor can be
    cut into parts says nothing; where none says anything, nothing is found.
    """
    tested = {run.name: p for run in recording.runs if (p := following_p(run)) is not None}
    if not tested or min(tested.values()) * len(tested) < THRESHOLDS.follows_level:
        return []
    least = min(1.0, min(tested.values()) * len(tested))
    run = next(run for run in recording.runs if run.name in tested)
    names = "run" if len(tested) == 1 else f"each of {len(tested)} runs, such as"
    return [
        Fault(
            "unrelated columns",
            run.name,
            f"{names} {run.name!r}: the response does not follow the drive: no part of it repeats "
            f"with the drive, or moves with it, by more than chance (p = {least:.2g}). Most likely "
            "another column is the response or the drive: look at the preview, and name the "
            "columns by `rapi import --drive ... --response ...`. Or the reading holds nothing but "
            "noise: check its wiring, its range and that the drive reaches the device.",
            ((0, run.drive.size - 1),),
        )
    ]


def following_p(run: Run) -> float | None:
    """The probability that chance alone makes the response of a run follow its drive so well.

    `None` where it cannot be told: of one period, of few samples, of a response that rests.
    """
    if not run.valid.all():
        at = np.arange(run.drive.size)
        response = np.interp(at, at[run.valid], run.response[run.valid]) if run.valid.any() else at
    else:
        response = run.response
    if not run.span > 0 or not run.drive.u_pp > 0:
        return None
    if run.drive.repeats and run.drive.periods > 1:
        return _synchronous_p(run, response)
    return None if run.drive.repeats else _moving_p(run.drive.value, response)


def _synchronous_p(run: Run, response: Float[np.ndarray, " time"]) -> float | None:
    """Of the harmonics of the drive's rate beside the frequencies between them.

    For noise without a line both powers are those of one spectrum, and their ratio has an F
    distribution with 2 and 2 m degrees of freedom, m of them beside; slow noise and drift that are
    not white are compared with themselves. The smallest p counts, times the number of harmonics. A
    response most of which repeats follows, however few periods there are to compare.
    """
    drive, periods = run.drive, run.drive.periods
    inside = np.flatnonzero((drive.period >= 0) & (drive.period < periods))
    bins = min(THRESHOLDS.follows_bins, int(inside.size / periods))
    if bins < 4:
        return None
    place = (np.arange(inside.size) * (bins * drive.rate * drive.step_s)).astype(int)
    place = np.minimum(place, bins * periods - 1)
    count = np.bincount(place, minlength=bins * periods)
    total = np.bincount(place, response[inside], minlength=bins * periods)
    filled = np.flatnonzero(count)
    value = np.interp(np.arange(count.size), filled, total[filled] / count[filled])
    order = min(periods - 1, THRESHOLDS.follows_trend)
    x = np.linspace(-1.0, 1.0, value.size)
    value = value - np.polynomial.Chebyshev.fit(x, value, order)(x)
    power = np.abs(np.fft.rfft(value)) ** 2
    if power[periods::periods].sum() > THRESHOLDS.follows_share * power[1:].sum():
        return 0.0  # of two periods hardly anything is beside
    near = max(1, min(periods // 2, THRESHOLDS.follows_beside))
    lowest = 1 if order < 2 else 2  # what a trend takes with it
    found = []
    for harmonic in range(1, min(THRESHOLDS.follows_harmonics, bins // 2 - 1) + 1):
        at = harmonic * periods
        beside = [k for j in range(1, near + 1) for k in (at - j, at + j)]
        beside = [k for k in beside if lowest <= k < power.size and k % periods]
        rest = float(power[beside].sum())
        if beside:
            ratio = float(power[at]) / max(rest, 1e-300)
            found.append((1.0 + ratio) ** -len(beside))  # of F with 2 and 2 m degrees of freedom
    return min(1.0, min(found) * len(found)) if found else None


def _moving_p(
    drive: Float[np.ndarray, " time"], response: Float[np.ndarray, " time"]
) -> float | None:
    """Of a drive that does not repeat: of its slopes in parts of the run, by Student's t.

    A response that a cubic in the drive describes well, such as a folded one, follows it, whatever
    the slopes are.
    """
    from scipy.special import stdtr

    if drive.size < 8 * THRESHOLDS.follows_parts:
        return None
    slopes = [
        slope
        for u, y in zip(
            np.array_split(drive, THRESHOLDS.follows_parts),
            np.array_split(response, THRESHOLDS.follows_parts),
            strict=True,
        )
        if (slope := _slope(u, y)) is not None
    ]
    if len(slopes) < 3 or _cubic_share(drive, response) > THRESHOLDS.follows_explained:
        return None if len(slopes) < 3 else 0.0
    error = float(np.std(slopes, ddof=1)) / np.sqrt(len(slopes))
    t = abs(float(np.mean(slopes))) / max(error, 1e-300)
    return float(2.0 * stdtr(len(slopes) - 1, -t))


def _slope(u: Sequence[float] | np.ndarray, y: np.ndarray) -> float | None:
    """The correlation of two parts; `None` where one of them rests."""
    u, y = np.asarray(u) - np.mean(u), y - y.mean()
    size = float(np.linalg.norm(u) * np.linalg.norm(y))
    return float(u @ y) / size if size > 0 else None


def _cubic_share(drive: np.ndarray, response: np.ndarray) -> float:
    """The share of the response's variance that a cubic in the drive describes."""
    scaled = (drive - drive.mean()) / np.ptp(drive)
    columns = np.stack([scaled**power for power in range(4)], axis=1)
    left = response - columns @ np.linalg.lstsq(columns, response, rcond=None)[0]
    return 1.0 - float(np.var(left) / np.var(response))
