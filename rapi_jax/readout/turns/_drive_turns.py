"""When a drive turns, from its samples."""

import numpy as np

from rapi_jax.recording._drive import Drive
from rapi_jax.sampling import _phase


def _corner(time: np.ndarray, value: np.ndarray, at: int) -> float:
    """The turn near sample `at`: two lines met, or one parabola, whichever fits better."""
    reach = 4
    part = np.arange(max(0, at - reach), min(value.size, at + reach + 1))
    t, v = time[part] - time[at], value[part]
    width = float(t[-1] - t[0])
    parabola = np.polyfit(t, v, 2)
    best = float(np.sum((np.polyval(parabola, t) - v) ** 2))
    when = -parabola[1] / (2 * parabola[0]) if parabola[0] else 0.0
    centre = int(np.flatnonzero(part == at)[0])
    for shift in (0, 1):  # the extreme sample may lie on either line
        left, right = slice(0, centre + shift), slice(centre + shift, part.size)
        if t[left].size < 2 or t[right].size < 2:
            continue
        one, two = np.polyfit(t[left], v[left], 1), np.polyfit(t[right], v[right], 1)
        if one[0] * two[0] >= 0:
            continue
        error = np.sum((np.polyval(one, t[left]) - v[left]) ** 2)
        error = float(error + np.sum((np.polyval(two, t[right]) - v[right]) ** 2))
        if error < best:
            best, when = error, (two[1] - one[1]) / (one[0] - two[0])
    return float(time[at] + np.clip(when, -width / 2, width / 2))


def drive_turns(drive: Drive, start_s: float, stop_s: float) -> list[tuple[float, bool]]:
    """Turns of `drive` between two times (s after its start): when, and whether it rises after.

    A drive that repeats is taken to go on for ever in both directions.
    """
    time, value = drive.time, drive.value
    tolerance = 0.02
    if not drive.repeats:
        turns = _phase.turning_samples(value, tolerance)[1:-1].tolist()
        after = [bool(value[min(i + 4, value.size - 1)] > value[i]) for i in turns]
        when = [_corner(time, value, i) for i in turns]
        return [(t, up) for t, up in zip(when, after, strict=True) if start_s <= t <= stop_s]
    period = 1.0 / drive.rate
    one = round(period / drive.step_s)
    if one > value.size or one < 8:
        one = value.size
    # Three periods in a row: the middle one has a neighbour on each side.
    tiled = np.tile(value[:one], 3)
    clock = (np.arange(3 * one) - one) * (period / one)
    found = []
    for i in _phase.turning_samples(tiled, tolerance)[1:-1].tolist():
        when = _corner(clock, tiled, i)
        if -1e-9 * period <= when < period * (1 - 1e-9):
            found.append((when, bool(tiled[i + 4] > tiled[i])))
    first = int(np.floor(start_s / period)) - 1
    last = int(np.ceil(stop_s / period)) + 1
    every = [(t + k * period, up) for k in range(first, last + 1) for t, up in found]
    return sorted((t, up) for t, up in every if start_s <= t <= stop_s)


def rising_at(drive: Drive, time_s: float) -> bool:
    """Whether the drive rises at a time, by the turn before it, or by its samples' trend."""
    period = 1.0 / drive.rate if drive.repeats else float(drive.time[-1])
    before = drive_turns(drive, time_s - period, time_s)
    if before:
        return before[-1][1]
    after = drive_turns(drive, time_s, time_s + period)
    if after:
        return not after[0][1]
    return bool(drive.value[-1] > drive.value[0])
