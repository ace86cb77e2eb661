"""Cycles of a drive: where each begins, its rate, its swing; and what its waveform is."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.recording._drive import Waveform
from rapi_jax.sampling._phase import turning_samples

Samples = Float[np.ndarray, " samples"]
_SHORT = 1.4  # samples that a record of one period may end early: `Drive.period` allows 1.5


@dataclasses.dataclass(frozen=True)
class Cycle:
    """From one turn to the next of its kind: samples `first` to `last`, rate (Hz), both levels."""

    first: int
    last: int
    rate: float
    low: float
    high: float

    @property
    def swing(self) -> float:
        """Peak to peak."""
        return self.high - self.low


def find_cycles(drive: Samples, step_s: float) -> list[Cycle]:
    """The complete cycles of a drive, between its minima or its maxima, whichever are more."""
    return max(find_both_cycles(drive, step_s), key=count_samples)


def find_both_cycles(drive: Samples, step_s: float) -> tuple[list[Cycle], list[Cycle]]:
    """The complete cycles of a drive between its minima, and those between its maxima."""
    if not np.ptp(drive) > 0:
        return [], []
    turns = turning_samples(drive, THRESHOLDS.turn)
    low, high = (_cycles(drive, _of_kind(drive, turns, sign), step_s) for sign in (1.0, -1.0))
    return low, high


def count_samples(cycles: list[Cycle]) -> int:
    """Over how many samples cycles last."""
    return sum(cycle.last - cycle.first for cycle in cycles)


def closed_cycle(drive: Samples, step_s: float) -> Cycle | None:
    """A record that is one period from anywhere: it ends where it began, past both its extremes."""
    low, high = float(drive.min()), float(drive.max())
    least = THRESHOLDS.repeats * (high - low)
    near = max(drive.size // 50, 2)
    if drive.size < 40 or abs(drive[-1] - drive[0]) > least:
        return None
    if not low + least < drive[0] < high - least:
        return None  # it begins at a turn: that is a cycle by its turns
    turns = turning_samples(drive, THRESHOLDS.turn)
    if sum(0 < turn < drive.size - 1 for turn in turns) != 2:
        return None
    slope = (drive[-1] - drive[-1 - near]) / near
    short = float(np.clip((drive[0] - drive[-1]) / slope, -2.0, _SHORT)) if slope else 0.0
    return Cycle(0, drive.size - 1, 1.0 / ((drive.size - 1 + short) * step_s), low, high)


def round_one_rate(rate: float, digits: int, cycle: Cycle, step_s: float) -> float:
    """The rate of a cycle alone in few digits, where its samples hold a whole period then, too."""
    plain = float(f"{rate:.{digits}g}")
    return plain if plain * (cycle.last - cycle.first + _SHORT) * step_s >= 1.0 else rate


def _of_kind(drive: Samples, turns: np.ndarray, sign: float) -> list[int]:
    """The minima (`sign` 1) or maxima among the turns; ends of the record where they are one."""
    level = sign * drive[turns]
    kept = []
    for k, turn in enumerate(turns):
        beside = [level[j] for j in (k - 1, k + 1) if 0 <= j < turns.size]
        if not all(level[k] < other for other in beside):
            continue
        if k in (0, turns.size - 1) and turns.size > 2:
            inner = [level[j] for j in range(max(k - 2, 0), min(k + 3, turns.size)) if j != k]
            if (
                level[k] > min(inner) + THRESHOLDS.turn * (max(inner) - min(inner))
                and turns.size > 3
            ):
                continue
        kept.append(int(turn))
    return kept


def _cycles(drive: Samples, minima: list[int], step_s: float) -> list[Cycle]:
    found = []
    for a, b in zip(minima[:-1], minima[1:], strict=True):
        part = drive[a : b + 1]
        found.append(Cycle(a, b, 1.0 / ((b - a) * step_s), float(part.min()), float(part.max())))
    return found


def refine_rate(drive: Samples, cycles: list[Cycle], step_s: float) -> tuple[float, list[Cycle]]:
    """The rate (Hz) of cycles that are alike, from where the drive passes its middle.

    Cycles at either end that come early or late, as where the rate changes, are left out.
    """
    middle = (np.median([c.low for c in cycles]) + np.median([c.high for c in cycles])) / 2.0
    passed = []
    for cycle in cycles:
        at = _crossing(drive[cycle.first : cycle.last + 1], float(middle), cycle.swing)
        passed.append((cycle.first + (np.nan if at is None else at)) * step_s)
    time = np.array(passed)
    number = np.arange(time.size, dtype=float)
    if time.size > 2 and np.isfinite(time).all():
        usual = float(np.median(np.diff(time)))
        off = time - number * usual
        late = np.abs(off - np.median(off)) > THRESHOLDS.late_cycle * usual
        first, last = int(np.argmin(late)), time.size - int(np.argmin(late[::-1]))
        if not late.all():
            cycles, time, number = cycles[first:last], time[first:last], number[first:last]
    if time.size > 1 and np.isfinite(time).all():
        number, time = number - number.mean(), time - time.mean()
        rate = 1.0 / (float(number @ time) / float(number @ number))
    else:
        rate = _one_rate(drive, cycles, step_s)
    return rate, cycles


def round_rate(rate: float, periods: int) -> float:
    """The rate (Hz) in three digits, where they are what was meant."""
    plain = float(f"{rate:.3g}")
    off = abs(rate - plain) / rate
    near = off * periods < THRESHOLDS.rate_slip and off < THRESHOLDS.round_rate
    return plain if near else rate


def loses_a_period(rate: float, than: float, samples: int, step_s: float) -> bool:
    """Whether so many samples hold fewer whole periods of `rate` than of the rate `than`."""
    span = (samples - 1 + _SHORT) * step_s
    return int(rate * span) < int(than * span)


def _one_rate(drive: Samples, cycles: list[Cycle], step_s: float) -> float:
    """The rate of a cycle alone; where it is the whole record, that may end a sample short."""
    a, b = cycles[0].first, cycles[0].last
    if a > 0 or b < drive.size - 1 or b - a < 40:
        return float(np.median([cycle.rate for cycle in cycles]))
    near = max((b - a) // 50, 2)
    slope = (drive[b - near] - drive[b]) / near
    short = float((drive[b] - drive[a]) / slope) if slope else 0.0
    return 1.0 / ((b - a + float(np.clip(short, -2.0, _SHORT))) * step_s)


def _crossing(part: Samples, middle: float, swing: float) -> float | None:
    """Where a cycle first goes through `middle` (samples), by a line through its neighbours."""
    rising = part[0] < middle
    past = part >= middle if rising else part <= middle
    if not past.any() or past.all():
        return None
    i = int(np.argmax(past))
    near = np.abs(part - middle) < 0.2 * swing
    a, b = i, i
    while a > 0 and near[a - 1]:
        a -= 1
    while b < part.size - 1 and near[b + 1]:
        b += 1
    x, y = np.arange(a, b + 1.0), part[a : b + 1]
    if x.size < 3 or not np.ptp(y) > 0:
        low, high = part[i - 1], part[i]
        return i - 1 + float((middle - low) / (high - low)) if high != low else float(i)
    x0, y0 = x.mean(), y.mean()
    slope = float((x - x0) @ (y - y0)) / float((x - x0) @ (x - x0))
    return float(x0 + (middle - y0) / slope) if slope else float(i)


def name_waveform(drive: Samples, cycles: list[Cycle], rate: float, step_s: float) -> Waveform:
    """Which periodic waveform the cycles have; one that is none by name is a sum of harmonics."""
    a, b = cycles[0].first, cycles[-1].last
    part = drive[a : b + 1]
    phase = np.mod(np.arange(part.size) * step_s * rate, 1.0)
    low, high = (float(np.median([getattr(c, n) for c in cycles])) for n in ("low", "high"))
    u = (part - low) / (high - low)
    angle = 2.0 * np.pi * phase
    design = np.stack([np.ones(u.size), np.cos(angle), np.sin(angle)], axis=1)
    left = u - design @ np.linalg.lstsq(design, u, rcond=None)[0]
    bent = float(np.sqrt(np.mean(left**2)))
    if float(np.mean((u > 0.1) & (u < 0.9))) < 0.1:
        return "step"
    straight = []
    for rise in np.linspace(0.02, 0.98, 49):
        for shape in (np.where(phase < rise, phase / rise, (1 - phase) / (1 - rise)),):
            for one in (shape, 1.0 - shape):
                straight.append(float(np.sqrt(np.mean((u - one) ** 2))))
    if min(bent, *straight) >= THRESHOLDS.shape:
        return "multisine"
    return "sine" if bent < min(straight) else "triangle"
