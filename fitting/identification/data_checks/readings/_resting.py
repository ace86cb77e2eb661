"""Readings that rest while the drive moves: dead, clipped or frozen; drives that rest."""

import numpy as np

from fitting.identification.data_checks._fault import Fault, format_intervals
from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Run
from rapi_jax.internal import turning_samples

from ._held import find_hold, held_fault
from ._levels import find_resolution


def check_motion(run: Run) -> Fault | None:
    """A reading that rests while the drive moves, or a drive that should repeat and rests."""
    whole = ((0, run.drive.size - 1),)
    if run.drive.u_pp == 0:
        text = (
            f"run {run.name!r}: the drive rests at {run.drive.value[0]:g}, though it is said to be "
            f"a {run.drive.waveform}. Check the generator and the column, or say "
            '`waveform = "other"`.'
        )
        return Fault("no drive", run.name, text, whole) if run.drive.repeats else None
    if run.valid.any() and run.span == 0:
        text = (
            f"run {run.name!r}: the reading rests at {float(np.nanmax(run.response)):g} while the "
            "drive moves. Check the sensor, its cable and the column, and record again."
        )
        return Fault("no reading", run.name, text, whole)
    return None


def check_clipping(run: Run) -> Fault | None:
    """Stretches at the largest or smallest reading that begin while the drive still moves on.

    A reading may rest where the drive rests, and a hysteretic one after the drive has turned. One
    that is held between updates rests from the next update on.
    """
    y, u = run.response, run.drive.value
    if not run.valid.any() or run.span == 0 or run.drive.u_pp == 0:
        return None
    limits = THRESHOLDS
    resolution = find_resolution(y[run.valid])
    shortest = limits.clipped_samples_digitised if resolution > 0 else limits.clipped_samples
    # that the reading should have moved meanwhile
    least = max(limits.clipped_steps * resolution, limits.clipped_move * run.span)
    hold, turns = find_hold(y[run.valid]), turning_samples(u, limits.branch_swing)
    levels, kept = [], []
    for level in (float(np.nanmax(y)), float(np.nanmin(y))):
        there = []
        for first, b in _intervals(y == level):
            a = min(first + max(hold - 1, 0), b)
            if _rests_since_turn(y, turns, first, hold, least):
                continue
            way = np.sign(u[a] - u[max(a - 3, 0)])  # 0 where the record begins so: not known
            onward = float((way * (u[a : b + 1] - u[a])).max()) / run.drive.u_pp * run.span
            if b - a + 1 >= shortest and onward > least:
                there.append((a, b))
        if there:
            levels.append(f"{level:g}")
            kept += there
    if not kept:
        return None
    longest = max(b - a + 1 for a, b in kept)
    return Fault(
        "clipped",
        run.name,
        f"run {run.name!r}: the reading stays at {' and at '.join(levels)} for up to {longest} "
        f"samples (samples {format_intervals(sorted(kept))}) while the drive moves on, as a "
        "clipped reading does. Widen the input range and record again.",
        tuple(sorted(kept)),
    )


def check_frozen(run: Run) -> Fault | None:
    """Equal readings in a row, not at the ends of their range, while the drive moves on.

    Or moves at all, after a turn as well, where the reading has noise: then nothing rests. A
    reading that is held between updates throughout is said to be that.
    """
    y, u = run.response, run.drive.value
    if not run.valid.any() or run.span == 0 or run.drive.u_pp == 0:
        return None
    limits = THRESHOLDS
    resolution = find_resolution(y[run.valid])
    shortest = limits.clipped_samples_digitised if resolution > 0 else limits.clipped_samples
    least = max(limits.clipped_steps * resolution, limits.clipped_move * run.span)
    ends: tuple[float, ...] = (float(np.nanmax(y)), float(np.nanmin(y)))
    hold, turns = find_hold(y[run.valid]), turning_samples(u, limits.branch_swing)
    fast = float(np.median(np.abs(np.diff(y[run.valid], 3)))) if run.valid.sum() > 3 else 0.0
    noisy = resolution == 0.0 and fast > limits.reading_noise * run.span
    equal = [(a, last + 1) for a, last in _intervals(np.diff(y) == 0.0)]
    short = sum(b - a for a, b in equal if b - a + 1 < shortest)
    in_steps = resolution > 0.0 or short > limits.equal_neighbours * y.size  # resampled perhaps
    noisy = noisy and not in_steps
    flat = [
        (a, b)
        for a, b in equal
        if b - a + 1 >= shortest
        and float(np.abs(u[a : b + 1] - u[a]).max()) / run.drive.u_pp * run.span > least
    ]
    resting = {(a, b) for a, b in flat if _rests_since_turn(y, turns, a, hold, least)}
    if noisy and _after_most_turns(resting, turns):
        noisy = False  # a play that rests after each turn, read with steps that were averaged
    if noisy and check_clipping(run) is None:
        ends = ()  # it hung there
    found = []
    for a, b in flat:
        way = np.sign(u[a] - u[max(a - 3, 0)])
        onward = float((way * (u[a : b + 1] - u[a])).max()) / run.drive.u_pp * run.span
        if in_steps and _rests_beside(y, a, b, least):
            continue  # a flat part of the loop, digitised: it moves no more before and after
        if not noisy and ((a, b) in resting or onward <= least):
            continue
        if y[a] not in ends:
            found.append((a, b))
    if not found:
        return None
    if hold:
        return held_fault(run, hold)
    text = (
        f"run {run.name!r}: the reading does not change (samples {format_intervals(found)}) while "
        "the drive moves on: the readout hung there. Leave that part out (readings that are not "
        "finite are, with `--nan mask`), or record again."
    )
    return Fault("frozen reading", run.name, text, tuple(found))


def _rests_since_turn(y: np.ndarray, turns: np.ndarray, at: int, hold: int, least: float) -> bool:
    """Whether the reading has moved by less than `least` since the drive last turned, as in a play.

    `turns`: the samples at which it turns; one may come as late as within a held reading.
    """
    last = turns[turns <= at + hold]
    last = last[(last > 0) & (last < y.size - 1)]  # a record's ends are no turns
    if not last.size:
        return False
    since = y[min(last[-1], at) : at + 1]
    return bool(np.nanmax(since) - np.nanmin(since) < least) if np.isfinite(since).any() else False


def _after_most_turns(resting: set[tuple[int, int]], turns: np.ndarray) -> bool:
    """Whether a reading that rests does so after two turns of the drive or more, and after most.

    A readout hangs wherever it happens to.
    """
    inner = turns[1:-1]
    turned = {int(inner[inner <= a][-1]) for a, _ in resting if (inner <= a).any()}
    return len(turned) >= max(2.0, THRESHOLDS.rest_turns * inner.size)


def _rests_beside(y: np.ndarray, a: int, b: int, least: float) -> bool:
    """Whether the reading moves by less than `least` in as many samples before or after, too."""
    beside = (y[max(2 * a - b, 0) : a + 1], y[b : 2 * b - a + 1])
    return any(float(np.nanmax(part) - np.nanmin(part)) < least for part in beside)


def _intervals(mask: np.ndarray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.r_[0, mask.astype(int), 0]))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
