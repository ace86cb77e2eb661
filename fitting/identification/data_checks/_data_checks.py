"""Faults of a recording: clipping, a wrong period, dead channels, jumps of the reading."""

import dataclasses

import numpy as np

from rapi_jax import DataError, Recording, Run
from rapi_jax.internal import usable, white_noise_rms

from ._drive_character import describe_drive, describe_rate, period_mismatch, rate_error
from ._first_period import first_period_miss
from ._reversals import find_reversals
from ._step_detection import detect_steps
from ._thresholds import THRESHOLDS

_HOP = (
    "a mode hop, fringes miscounted, or samples lost there. Leave that part out, or shift bias or "
    "current."
)
_JUMP = (
    "the sensor or its range switched, a contact slipped, or samples were lost there. Leave that "
    "part out, or record again."
)


@dataclasses.dataclass(frozen=True)
class Fault:
    """Something wrong in one run: `samples` are the first and last (inclusive) of each stretch.

    `left_out`: those were left out of the fit, and say nothing against it.
    """

    kind: str
    run: str
    message: str
    samples: tuple[tuple[int, int], ...] = ()
    left_out: bool = False


def check_usable(recording: Recording) -> None:
    """Raise `DataError` where a run holds no sample that a fit may look at."""
    for run in recording.runs:
        end, lag = float(run.drive.time[-1]), recording.response_lag_s
        if not 0.0 <= lag < end / 2:
            raise DataError(
                f"run {run.name!r}: `response_lag_s` = {lag:g} s must be short beside the run of "
                f"{end:g} s. Give the latency of the reading, in s."
            )
        if usable(run, lag).any():
            continue
        if not run.valid.any():
            raise DataError(
                f"run {run.name!r} has no valid reading. Record it again, or leave this run out."
            )
        raise DataError(
            f"run {run.name!r} holds no complete period of {run.drive.rate:g} Hz ({end:g} s "
            "recorded). Check `excitation_hz` (in Hz), or record at least one whole period."
        )


def find_faults(recording: Recording) -> list[Fault]:
    """Clipped or dead readings, dead drives and wrong periods, which show before any fit."""
    found = []
    for run in recording.runs:
        checks = (_check_motion, _check_levels, _check_clipping, _check_frozen)
        faults = [check(run) for check in checks]
        period = _check_period(run)
        faults += [period, _check_start(run) if period is None else None, _check_reversals(run)]
        found += [fault for fault in faults if fault is not None]
    return found or _find_switched(recording)


def _intervals(mask: np.ndarray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.r_[0, mask.astype(int), 0]))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def format_intervals(stretches: list[tuple[int, int]]) -> str:
    shown = ", ".join(f"{a}-{b}" if b > a else f"{a}" for a, b in stretches[:3])
    return shown + (f" and {len(stretches) - 3} more" if len(stretches) > 3 else "")


def _resolution(reading: np.ndarray) -> float:
    """The usual step between the values of a digitised reading; 0 where values hardly repeat."""
    values = np.unique(reading)
    if not 1 < values.size < THRESHOLDS.distinct_values * reading.size:
        return 0.0
    return float(np.median(np.diff(values)))


def _check_motion(run: Run) -> Fault | None:
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


def _check_levels(run: Run) -> Fault | None:
    """A reading of so few levels that a play moves it by less than one."""
    values = run.response[run.valid]
    levels = _levels(values)
    if not 1 < levels <= THRESHOLDS.reading_levels < values.size:
        return None
    text = (
        f"run {run.name!r}: the reading takes {levels} levels and nothing between, which hides "
        "hysteresis. Choose a smaller input range or a finer converter, and record again."
    )
    return Fault("coarse reading", run.name, text, ((0, run.drive.size - 1),))


def _find_switched(recording: Recording) -> list[Fault]:
    """Drives that are at one of two levels, where no other run says what lies between."""
    if any(_levels(run.drive.value) != 2 or run.drive.size < 4 for run in recording.runs):
        return []
    run = recording.runs[0]
    text = (
        f"run {run.name!r}: the drive, as that of all runs, switches between two levels, and no "
        "reading says what the device does between these levels. Record triangles or sines."
    )
    return [Fault("switched drive", run.name, text, ((0, run.drive.size - 1),))]


def _levels(values: np.ndarray) -> int:
    """How many values there are, to a millionth of their span."""
    span = float(np.ptp(values)) if values.size else 0.0
    return np.unique(np.round((values - values.min()) / span, 6)).size if span > 0 else 1


def _check_clipping(run: Run) -> Fault | None:
    """Stretches at the largest or smallest reading that begin while the drive still moves on.

    A reading may rest where the drive rests, and a hysteretic one after the drive has turned.
    """
    y, u = run.response, run.drive.value
    if not run.valid.any() or run.span == 0 or run.drive.u_pp == 0:
        return None
    limits = THRESHOLDS
    resolution = _resolution(y[run.valid])
    shortest = limits.clipped_samples_digitised if resolution > 0 else limits.clipped_samples
    # that the reading should have moved meanwhile
    least = max(limits.clipped_steps * resolution, limits.clipped_move * run.span)
    levels, kept = [], []
    for level in (float(np.nanmax(y)), float(np.nanmin(y))):
        there = []
        for a, b in _intervals(y == level):
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


def _check_frozen(run: Run) -> Fault | None:
    """Equal readings in a row, not at the ends of their range, while the drive moves on.

    Or moves at all, after a turn as well, where the reading has noise: then nothing rests.
    """
    y, u = run.response, run.drive.value
    if not run.valid.any() or run.span == 0 or run.drive.u_pp == 0:
        return None
    limits = THRESHOLDS
    resolution = _resolution(y[run.valid])
    shortest = limits.clipped_samples_digitised if resolution > 0 else limits.clipped_samples
    least = max(limits.clipped_steps * resolution, limits.clipped_move * run.span)
    ends: tuple[float, ...] = (float(np.nanmax(y)), float(np.nanmin(y)))
    fast = float(np.median(np.abs(np.diff(y[run.valid], 3)))) if run.valid.sum() > 3 else 0.0
    noisy = resolution == 0.0 and fast > limits.reading_noise * run.span
    if noisy and _check_clipping(run) is None:
        ends = ()  # it hung there
    found = []
    for a, last in _intervals(np.diff(y) == 0.0):
        b = last + 1
        way = np.sign(u[a] - u[max(a - 3, 0)])
        moved = np.abs(u[a : b + 1] - u[a]) if noisy else way * (u[a : b + 1] - u[a])
        onward = float(moved.max()) / run.drive.u_pp * run.span
        if resolution > 0 and _rests_beside(y, a, b, least):
            continue  # a flat part of the loop, digitised: it moves no more before and after
        if b - a + 1 >= shortest and onward > least and y[a] not in ends:
            found.append((a, b))
    if not found:
        return None
    text = (
        f"run {run.name!r}: the reading does not change (samples {format_intervals(found)}) while "
        "the drive moves on: the readout hung there. Leave that part out (readings that are not "
        "finite are, with `--nan mask`), or record again."
    )
    return Fault("frozen reading", run.name, text, tuple(found))


def _rests_beside(y: np.ndarray, a: int, b: int, least: float) -> bool:
    """Whether the reading moves by less than `least` in as many samples before and after, too."""
    beside = (y[max(2 * a - b, 0) : a + 1], y[b : 2 * b - a + 1])
    return all(float(np.nanmax(part) - np.nanmin(part)) < least for part in beside)


def _check_period(run: Run) -> Fault | None:
    """A drive said to repeat that does not, at the rate given."""
    drive = run.drive
    if not drive.repeats or drive.u_pp == 0:
        return None
    limits = THRESHOLDS
    period, step = 1.0 / drive.rate, drive.step_s
    if period < limits.period_samples * step:
        return _wrong_period(run)
    noise = white_noise_rms(drive.value) / drive.u_pp
    count = (drive.time[-1] + step) / period
    if count >= limits.several_periods:  # third differences of a fast drive are the drive itself
        noise = min(noise, period_mismatch(drive, period))
    whole = np.unique(np.geomspace(1, max(count - 0.2, 1), 8).astype(int))
    if count >= limits.several_periods:
        worst = max(period_mismatch(drive, k * period) for k in whole)
        if worst > limits.period_miss + 2.0 * noise:
            return _wrong_period(run)
        error = rate_error(drive)
        if abs(error) > limits.rate_error:
            return _wrong_period(run, describe_rate(drive, error))
    elif drive.time[-1] > period + 2.0 * step:
        if period_mismatch(drive, period) > limits.period_miss_short + 2.0 * noise:
            return _wrong_period(run)
    elif count >= limits.whole_period:
        slope = (drive.value[-1] - drive.value[-3]) / (2.0 * step)
        end = drive.value[-1] + slope * (period - drive.time[-1])
        apart = abs(end - drive.value[0]) / drive.u_pp
        least = limits.period_end_least + limits.period_end_noise * noise
        if least < apart < limits.period_end_most:
            return _wrong_period(run)
    for parts in range(2, limits.period_divisions + 1):
        if period / parts < limits.period_samples * step or count < limits.whole_period:
            break
        if period_mismatch(drive, period / parts) < limits.shorter_period_miss + 2.0 * noise:
            return _wrong_period(run)
    return None


def _check_start(run: Run) -> Fault | None:
    """A first period that begins elsewhere than where it ends, of a drive with that period."""
    miss = first_period_miss(run)
    if miss == 0.0:
        return None
    only = "" if run.drive.periods > 1 else " Or the reading drifts, which one period cannot tell."
    text = (
        f"run {run.name!r}: the response ends its first period {abs(miss):.3g} "
        f"({100 * abs(miss) / run.span:.2g} % of its span) from where it began: the device came "
        "from rest or another drive, and the model takes each period for the settled one. Let the "
        "drive run for two periods before recording, or cut the first one off (`rapi import "
        f"--skip-periods 1`).{only}"
    )
    last = int(np.flatnonzero(run.drive.period == 0)[-1])
    return Fault("unsettled start", run.name, text, ((0, last),))


def _check_reversals(run: Run) -> Fault | None:
    """A response that turns back in mid-branch: folded, or that of a ferroelectric switching."""
    places = find_reversals(run)
    if not places:
        return None
    up = run.drive.up[places]
    near = [f"{np.median(run.drive.value[places][way]):.3g}" for way in (up, ~up) if way.any()]
    text = (
        f"run {run.name!r}: the response turns back in mid-branch, near a drive of "
        f"{' and '.join(near)} (samples {format_intervals([(i, i) for i in places])}), while the "
        "drive goes on. The reading is rectified or folded (a magnitude, fringes without their "
        "direction), or a piezo is driven through its coercive voltage (a butterfly loop). Correct "
        "the reading, or keep the drive on one side of there."
    )
    return Fault("response turns back", run.name, text, tuple((i, i) for i in places))


def _wrong_period(run: Run, why: str = "") -> Fault:
    kind, words = ("wrong period", why) if why else describe_drive(run.drive)
    return Fault(
        kind,
        run.name,
        f"run {run.name!r}: the drive does not have the period of {run.drive.rate:g} Hz; {words}",
        ((0, run.drive.size - 1),),
    )


def find_mode_hops(recording: Recording, errors: list[np.ndarray]) -> list[Fault]:
    """Steps in a run's residual that stand clear of noise and misfit: mode hops of a laser.

    `errors` are model less data, one array a run. In a reading that is no optical frequency such a
    step is a jump, of whatever cause.
    """
    found = []
    optical = recording.response_unit == "GHz"  # files in Hz or MHz are read as GHz
    kind, cause = ("mode hop", _HOP) if optical else ("jump", _JUMP)
    for run, error in zip(recording.runs, errors, strict=True):
        index = np.flatnonzero(usable(run, recording.response_lag_s))
        if not index.size or run.span == 0:
            continue
        reading = run.response[index]
        predicted = reading + error[index]
        least = max(
            THRESHOLDS.step_share * run.span, THRESHOLDS.step_resolution * _resolution(reading)
        )
        drive = run.drive.delayed(recording.response_lag_s).value[index]
        steps = detect_steps(error[index], predicted, drive, index, least)
        if steps:
            size = float(np.median([abs(height) for _, height in steps]))
            places = [(place, place) for place, _ in steps]
            found.append(
                Fault(
                    kind,
                    run.name,
                    f"run {run.name!r}: the response jumps by about {size:.3g} "
                    f"{recording.response_unit} at sample{'s' * (len(places) > 1)} "
                    f"{format_intervals(places)}, which no hysteresis does: {cause}",
                    tuple(places),
                )
            )
    return found
