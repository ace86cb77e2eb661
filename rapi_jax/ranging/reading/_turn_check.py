"""Whether a record turns as often as its excitation rate says."""

import numpy as np

from rapi_jax._errors import DataError

from ._thresholds import THRESHOLDS


def seen_turns(irregular: np.ndarray, rate_hz: float, excitation_hz: float) -> np.ndarray:
    """Times of stretches that are irregular beyond noise, s: turns, and broken fringes.

    `irregular` at `rate_hz` values a second. Not every turn is among them: one at an extremum of
    the fringes, or a rounded one, does not show. Empty where noise makes all fringes irregular.
    """
    least = max(THRESHOLDS.irregular, 3 * float(np.quantile(irregular, 0.98)))
    at = np.flatnonzero(irregular > least)
    if not at.size:
        return np.zeros(0)
    apart = THRESHOLDS.turn_place / excitation_hz * rate_hz
    groups = np.split(at, np.flatnonzero(np.diff(at) > apart) + 1)
    return np.array([(group[0] + group[-1] + 1) / 2 / rate_hz for group in groups])


def check_turns(
    seen: np.ndarray, expected: np.ndarray, excitation_hz: float, name: str
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Which of the expected turns are seen, where, s, and what is doubtful.

    Raises `DataError` where two and 40 % of the turns that are seen are elsewhere than expected, or
    they come evenly and less than half as often: then the excitation rate is another one.
    """
    if not seen.size:
        return np.zeros(0, dtype=int), seen, []
    off = np.abs(seen[:, None] - expected[None, :])
    near = off.min(axis=1) < THRESHOLDS.turn_place / excitation_hz
    which, doubts = off.argmin(axis=1)[near], []
    elsewhere = int((~near).sum())
    ratio, hint = 1.0, ""
    if seen.size >= 4:
        steps = np.diff(seen)
        even = np.ptp(steps) < 4 * THRESHOLDS.turn_place / excitation_hz
        rate = 0.5 / float(np.median(steps))
        ratio = rate / excitation_hz if even else 1.0
        hint = f" They come as in a scan of about {rate:.3g} Hz."
    if elsewhere >= max(2, 0.4 * seen.size) or ratio < 0.42:
        raise DataError(
            f"{name}: the laser does not turn as at {excitation_hz:g} Hz: of {seen.size} turns "
            f"seen, {elsewhere} are not where they should be.{hint} Is `excitation_hz` right?"
        )
    if ratio < 0.6:
        doubts.append(
            f"{name}: the laser is seen to turn half as often as it should. Either turns of one "
            f"direction do not show, which happens; or it scans at {rate:.3g} Hz, and directions "
            "and velocities are wrong. Is `excitation_hz` right?"
        )
    return which, seen[near], doubts


def fit_period(
    expected: np.ndarray, seen: np.ndarray, side: np.ndarray, excitation_hz: float
) -> float:
    """Period of turns that were seen, s; each side (minima, maxima) at a phase of its own."""
    number = np.floor(expected * excitation_hz)
    design = np.stack([number, side == 0, side == 1], axis=1).astype(float)
    return float(np.linalg.lstsq(design, seen, rcond=None)[0][0])
