"""Clocks as files have them, made even: rounded times, gaps, uneven sampling, two clocks."""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from rapi_jax._errors import DataError
from rapi_jax.sampling._clock import check_clock

from ._thresholds import THRESHOLDS

Samples = Float[np.ndarray, " samples"]
Grid = Float[np.ndarray, " grid"]
Stretch = tuple[int, int]  # first sample, and one past the last


def even_clock(time: Samples, label: str) -> tuple[Samples, list[Stretch], list[str]]:
    """Times (s) that are even in each stretch, the stretches between gaps, and what was done.

    Where sampling is uneven throughout, the times come back as they are, for `resample`; the one
    stretch is then marked by times that `check_clock` refuses.
    """
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size:
        raise DataError(
            f"{label}: the time of {bad.size} sample(s) is not a number, the first at sample "
            f"{bad[0]}. A clock is never guessed: correct it, or give --sample-rate."
        )
    step = np.diff(time)
    if time.size < 3:
        raise DataError(f"{label}: {time.size} sample(s), but a run needs at least 3.")
    back = np.flatnonzero(step < 0)
    if back.size:
        i = int(back[0])
        raise DataError(
            f"{label}: time goes back at sample {i + 1} ({time[i]:g} s, then {time[i + 1]:g} s). "
            "Several records stand below each other: give each as a file of its own."
        )
    if time[-1] <= time[0]:
        raise DataError(
            f"{label}: the time never increases. Choose another --time column, or give "
            "--sample-rate."
        )
    mean = float(time[-1] - time[0]) / (time.size - 1)
    line = time[0] + mean * np.arange(time.size)
    quantum = float(step[step > 0].min())
    kinds = np.unique(np.round(step / quantum, 3))
    rounded = kinds.size <= 3 and kinds[-1] - kinds[0] <= 1.0 + 1e-2
    if rounded and np.abs(time - line).max() <= 1.01 * max(quantum * (kinds.size > 1), 0.0) + 1e-9:
        note = (
            f"times are printed in steps of {quantum:.3g} s, so an even clock of {mean:.6g} s "
            "was put in their place"
        )
        return line, [(0, time.size)], [note] if kinds.size > 1 else []
    if (digits := _printed_digits(time)) is not None:
        line, off = _fit_line(time)
        coarse = 10.0 ** (np.floor(np.log10(np.abs(time).max())) - digits + 1)
        if off <= 1.01 * coarse and off < THRESHOLDS.off_clock * (line[1] - line[0]):
            return line, [(0, time.size)], [
                f"times are printed in {digits} digits, so an even clock of "
                f"{line[1] - line[0]:.6g} s was put in their place"
            ]  # fmt: skip
    usual = float(np.median(step))
    gaps = np.flatnonzero(step > THRESHOLDS.gap * usual) if usual > 0 else np.arange(step.size)
    if gaps.size > max(THRESHOLDS.few_gaps * step.size, 1):
        return time, [(0, time.size)], []
    edges = [0, *(int(i) + 1 for i in gaps), time.size]
    stretches = list(zip(edges[:-1], edges[1:], strict=True))
    notes = [
        f"gap after sample {i}: {step[i]:.4g} s without samples at {time[i]:.6g} s; what is before "
        "and after it are apart"
        for i in gaps[:5]
    ]
    notes += [f"and {gaps.size - 5} more gaps"] if gaps.size > 5 else []
    time = time.copy()
    for a, b in stretches:
        if b - a < 3:
            continue
        even = np.linspace(time[a], time[b - 1], b - a)
        if np.abs(time[a:b] - even).max() <= THRESHOLDS.uneven_step * usual:
            time[a:b] = even
    return time, stretches, notes


def _printed_digits(time: Samples) -> int | None:
    """In how many significant digits all times are printed; `None` for more than nine.

    Past a power of ten the last of them is worth ten times as much.
    """
    size = np.abs(time[time != 0])
    for digits in range(3, 10):
        last = size / 10.0 ** (np.floor(np.log10(size)) - digits + 1)
        if np.abs(last - np.round(last)).max() < 1e-4:
            return digits
    return None


def _fit_line(time: Samples) -> tuple[Samples, float]:
    """The even clock nearest to times, and how far off the farthest of them is, s."""
    number = np.arange(time.size) - (time.size - 1) / 2.0
    line = time.mean() + number * float(number @ (time - time.mean())) / float(number @ number)
    return line, float(np.abs(time - line).max())


def is_even(time: Samples) -> str | None:
    """`None` where the clock of a run may be so; else why not, in the words of its check."""
    try:
        check_clock(time - time[0])
    except DataError as error:
        return str(error).split(". ")[0]
    return None


def resample(time: Samples, columns: list[Samples]) -> tuple[Grid, list[Grid], float, int]:
    """Even samples of columns that were not: at the longest step that is usual.

    Of samples at one time the first is kept.
    Denser stretches are averaged over a step, against aliasing; others are interpolated
    linearly. Returns the step, s, too, and how many samples at most became one.
    """
    keep = np.r_[True, np.diff(time) > 0]
    time, columns = time[keep], [column[keep] for column in columns]
    few = min(THRESHOLDS.rate_window, time.size - 1)
    step = (time[few:] - time[:-few]) / few  # over some samples, so that jitter is no rate
    long = float(np.quantile(step, 0.95))
    grid = time[0] + long * np.arange(int((time[-1] - time[0]) / long + 1e-9) + 1)
    short = float(np.quantile(step, 0.05))
    dense = short < long / THRESHOLDS.gap
    take = (lambda c: average_at(grid, long, time, c)) if dense else (
        lambda c: np.interp(grid, time, c)
    )  # fmt: skip
    return grid, [take(column) for column in columns], long, round(long / short) if dense else 1


def in_holes(grid: Grid, time: Samples, step: float) -> Bool[np.ndarray, " grid"]:
    """Which times of an even `grid` of `step` (s) lie where the clock `time` has no samples.

    The samples on both sides are more than `THRESHOLDS.hole` steps apart there.
    """
    after = np.clip(np.searchsorted(time, grid - 1e-9 * step), 1, time.size - 1)
    near = np.minimum(np.abs(grid - time[after]), np.abs(grid - time[after - 1]))
    return (time[after] - time[after - 1] > THRESHOLDS.hole * step) & (near > 0.5 * step)


def average_at(grid: Grid, width: float, time: Samples, value: Samples) -> Grid:
    """The mean of a piecewise linear signal over `width` (s) about each time of `grid`."""
    area = np.r_[0.0, np.cumsum(np.diff(time) * (value[1:] + value[:-1]) / 2.0)]

    def integral(at: Grid) -> Grid:
        at = np.clip(at, time[0], time[-1])
        i = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2)
        part = at - time[i]
        slope = (value[i + 1] - value[i]) / (time[i + 1] - time[i])
        return area[i] + part * (value[i] + slope * part / 2.0)

    low = np.maximum(grid - width / 2.0, time[0])
    high = np.minimum(grid + width / 2.0, time[-1])
    return (integral(high) - integral(low)) / (high - low)


def join_clocks(one: tuple[Any, Any], other: tuple[Any, Any]) -> tuple[Grid, Grid, Grid, str]:
    """Two signals, each (time, value), at the slower of their clocks, where both were recorded."""
    steps = [float(np.median(np.diff(time))) for time, _ in (one, other)]
    slow = max(steps)
    grid = (one, other)[int(np.argmax(steps))][0]
    grid = grid[_common(one[0], other[0], grid, slow)]
    values = []
    for (time, value), step in zip((one, other), steps, strict=True):
        finer = step < slow / THRESHOLDS.gap
        values.append(
            average_at(grid, slow, time, value) if finer else np.interp(grid, time, value)
        )
    if max(steps) < 1.001 * min(steps):
        return (
            grid,
            values[0],
            values[1],
            (
                "drive and response were sampled at other times: both are taken at those of one of "
                "them, the other interpolated"
            ),
        )
    said = (
        f"drive and response have clocks of their own (steps of {steps[0]:.4g} and {steps[1]:.4g} "
        f"s): both are taken every {slow:.4g} s, the finer one averaged"
    )
    return grid, values[0], values[1], said


def follow_clock(one: tuple[Any, Any], time: Samples) -> tuple[Any, Grid, str]:
    """Which of the times `time` the signal `one` (time, value) was recorded at, and it at those."""
    steps = [float(np.median(np.diff(clock))) for clock in (one[0], time)]
    kept = _common(one[0], time, time, steps[1])
    if steps[0] < steps[1] / THRESHOLDS.gap:
        value = average_at(time[kept], steps[1], *one)
    else:
        value = np.interp(time[kept], *one)
    said = (
        f"drive and fringes have clocks of their own (steps of {steps[0]:.4g} and {steps[1]:.4g} s)"
        ": the drive is taken at the times of the fringes"
    )
    return kept, value, said


def _common(one: Any, other: Any, grid: Samples, step: float) -> Any:
    """Which times of `grid` lie within both clocks. Raises `DataError` where hardly any does."""
    begin, end = max(one[0], other[0]), min(one[-1], other[-1])
    kept = (grid >= begin - 1e-9 * step) & (grid <= end + 1e-9 * step)
    if kept.sum() < 3:
        raise DataError(
            f"drive and response have no time in common ({one[0]:.6g} to {one[-1]:.6g} s, "
            f"and {other[0]:.6g} to {other[-1]:.6g} s). Check their clocks."
        )
    return kept
