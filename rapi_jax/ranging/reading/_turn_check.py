"""Whether a record turns as often as its excitation rate says."""

import numpy as np

from rapi_jax._errors import DataError

from ._thresholds import THRESHOLDS


def seen_turns(irregular: np.ndarray, rate_hz: float, excitation_hz: float) -> np.ndarray | None:
    """Times of irregular stretches, s: turns, and whatever breaks the fringes off.

    `irregular` at `rate_hz` values a second. `None` where noise makes all fringes irregular.
    """
    noise = float(np.quantile(irregular, 0.98))
    if noise > THRESHOLDS.irregular:
        return None
    at = np.flatnonzero(irregular > THRESHOLDS.irregular)
    if not at.size:
        return np.zeros(0)
    apart = THRESHOLDS.turn_place / excitation_hz * rate_hz
    groups = np.split(at, np.flatnonzero(np.diff(at) > apart) + 1)
    return np.array([(group[0] + group[-1] + 1) / 2 / rate_hz for group in groups])


def check_turns(
    seen: np.ndarray, expected: np.ndarray, length_s: float, excitation_hz: float, name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Which of the expected turns are seen, and where, s; both as arrays, in order.

    Raises `DataError` where two and 40 % of the expected turns are not seen, or where two and 70 %
    as many more are seen elsewhere: then the excitation rate is another one.
    """
    near = THRESHOLDS.turn_place / excitation_hz
    inside = np.flatnonzero((expected > near) & (expected < length_s - near))
    if not inside.size:
        return inside, np.zeros(0)
    apart = np.abs(seen[None, :] - expected[inside, None]) if seen.size else np.full((1, 1), np.inf)
    found = apart.min(axis=1) < near if seen.size else np.zeros(inside.size, dtype=bool)
    missing = int((~found).sum())
    elsewhere = 0
    if seen.size:
        off = np.abs(seen[:, None] - expected[None, :]).min(axis=1)
        elsewhere = int((off > 2 * near).sum())
    if missing >= max(2, 0.4 * inside.size) or elsewhere >= max(2, 0.7 * inside.size):
        hint = ""
        if seen.size > 2:
            hint = f" They come as in a scan of about {1 / np.median(seen[2:] - seen[:-2]):.3g} Hz."
        raise DataError(
            f"{name}: the laser does not turn as at {excitation_hz:g} Hz: of {inside.size} turns "
            f"{missing} are not seen, and {elsewhere} are elsewhere.{hint} Is `excitation_hz` "
            "right?"
        )
    return inside[found], seen[np.argmin(apart, axis=1)[found]]


def fit_period(
    expected: np.ndarray, seen: np.ndarray, side: np.ndarray, excitation_hz: float
) -> tuple[float, np.ndarray]:
    """Period of turns that were seen, s, and how far each side's turns lie behind at time 0, s."""
    number = np.floor(expected * excitation_hz)
    design = np.stack([number, side == 0, side == 1], axis=1).astype(float)
    solution = np.linalg.lstsq(design, seen, rcond=None)[0]
    return float(solution[0]), solution[1:]
