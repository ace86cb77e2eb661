"""Whether a record turns as often as its excitation rate says."""

import numpy as np

from rapi_jax._errors import DataError

from ._thresholds import THRESHOLDS


def seen_turns(
    irregular: np.ndarray, rate_hz: float, excitation_hz: float, *, sure: bool
) -> np.ndarray | None:
    """Times of irregular stretches, s: turns, and whatever breaks the fringes off.

    `irregular` at `rate_hz` values a second; `sure`: those that are no noise alone. `None` where
    noise makes all fringes irregular.
    """
    noise = float(np.quantile(irregular, 0.98))
    least = max(THRESHOLDS.irregular[int(sure)], 3 * noise)
    if least > 0.6:
        return None
    at = np.flatnonzero(irregular > least)
    if not at.size:
        return np.zeros(0)
    apart = THRESHOLDS.turn_place / excitation_hz * rate_hz
    groups = np.split(at, np.flatnonzero(np.diff(at) > apart) + 1)
    return np.array([(group[0] + group[-1] + 1) / 2 / rate_hz for group in groups])


def check_turns(
    seen: np.ndarray,
    sure: np.ndarray,
    expected: np.ndarray,
    side: np.ndarray,
    length_s: float,
    excitation_hz: float,
    name: str,
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Which of the expected turns are seen, where, s, and what is doubtful.

    A turn at an extremum of the fringes does not show, and then no turn of its side (minima or
    maxima) does. Raises `DataError` where two and 40 % of the turns of either side are not seen,
    or where two and 70 % as many more are seen elsewhere: then the excitation rate is another one.
    """
    near = THRESHOLDS.turn_place / excitation_hz
    inside = np.flatnonzero((expected > near) & (expected < length_s - near))
    if not inside.size:
        return inside, np.zeros(0), []
    apart = np.abs(seen[None, :] - expected[inside, None]) if seen.size else np.full((1, 1), np.inf)
    found = apart.min(axis=1) < near if seen.size else np.zeros(inside.size, dtype=bool)
    missing = int((~found).sum())
    elsewhere = 0
    if sure.size:
        off = np.abs(sure[:, None] - expected[None, :]).min(axis=1)
        elsewhere = int((off > 2 * near).sum())
    share = [found[side[inside] == one].mean() for one in np.unique(side[inside])]
    few = missing >= 2 and max(share) < 0.6
    if few or elsewhere >= max(2, 0.7 * inside.size):
        hint = ""
        if sure.size > 2:
            hint = f" They come as in a scan of about {1 / np.median(sure[2:] - sure[:-2]):.3g} Hz."
        raise DataError(
            f"{name}: the laser does not turn as at {excitation_hz:g} Hz: of {inside.size} turns "
            f"{missing} are not seen, and {elsewhere} are elsewhere.{hint} Is `excitation_hz` "
            "right?"
        )
    doubts = []
    if missing >= 2 and min(share) < 0.4:
        doubts.append(
            f"{name}: the laser is not seen to turn in one of its directions, which may be chance; "
            f"or it scans at {excitation_hz / 2:g} Hz, and directions and velocities are wrong. Is "
            "`excitation_hz` right?"
        )
    return inside[found], seen[np.argmin(apart, axis=1)[found]], doubts


def fit_period(
    expected: np.ndarray, seen: np.ndarray, side: np.ndarray, excitation_hz: float
) -> tuple[float, np.ndarray]:
    """Period of turns that were seen, s, and how far each side's turns lie behind at time 0, s."""
    number = np.floor(expected * excitation_hz)
    design = np.stack([number, side == 0, side == 1], axis=1).astype(float)
    solution = np.linalg.lstsq(design, seen, rcond=None)[0]
    return float(solution[0]), solution[1:]
