"""Faults of a recording that a fit cannot see: clipping, a wrong period, hops. Found, listed, weighed."""

import dataclasses

import numpy as np
from scipy import ndimage

from rapi_jax import Recording, Run
from rapi_jax._sampled import usable


@dataclasses.dataclass(frozen=True)
class Fault:
    """Something wrong in one run: `samples` are the first and last (inclusive) of each stretch."""

    kind: str
    run: str
    message: str
    samples: tuple[tuple[int, int], ...] = ()


def faults(recording: Recording) -> list[Fault]:
    """Clipped readings and wrong periods, which show before any fit."""
    found = []
    for run in recording.runs:
        for check in (_clipped, _period):
            fault = check(run)
            if fault is not None:
                found.append(fault)
    return found


def _stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.r_[0, mask.astype(int), 0]))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _listed(stretches: list[tuple[int, int]]) -> str:
    shown = ", ".join(f"{a}-{b}" for a, b in stretches[:3])
    return shown + (f" and {len(stretches) - 3} more" if len(stretches) > 3 else "")


def _clipped(run: Run) -> Fault | None:
    """Stretches at the largest or smallest reading, longer than the signal stays on any other value."""
    y = run.response
    if run.span == 0 or not run.valid.any():
        return None
    moving = run.drive.u_pp > 0
    held = np.diff(run.drive.value, prepend=run.drive.value[0]) == 0  # the drive stands still there
    for level in (np.nanmax(y), np.nanmin(y)):
        at = _stretches((y == level) & ~held) if moving else []
        longest = max((b - a + 1 for a, b in at), default=0)
        same = np.flatnonzero(np.diff(y[np.isfinite(y)]) != 0)
        usual = float(np.quantile(np.diff(same), 0.99)) if same.size > 2 else 1.0
        share = sum(b - a + 1 for a, b in at) / y.size
        if longest >= max(6.0, 5.0 * usual) and share > 0.004:
            keep = [s for s in at if s[1] - s[0] + 1 >= max(3.0, longest / 4)]
            return Fault(
                "clipped",
                run.name,
                f"run {run.name!r}: the reading stays at {level:g} for up to {longest} samples "
                f"({_listed(keep)}), as a clipped reading does. Widen the input range and record again.",
                tuple(keep),
            )
    return None


def _period(run: Run) -> Fault | None:
    """A drive said to repeat that does not, at the rate given."""
    drive = run.drive
    if not drive.repeats or drive.u_pp == 0:
        return None
    period = 1.0 / drive.rate
    if drive.time[-1] < 1.2 * period:
        half = drive.time <= drive.time[-1]
        turns = _swings(drive.value[half])
        cycles = drive.time[-1] / period
        if drive.waveform != "multisine" and turns > 2 * cycles + 2.5:
            return _wrong(run, turns / 2 / drive.time[-1])
        return None
    later = np.interp(drive.time + period, drive.time, drive.value)
    inside = drive.time <= drive.time[-1] - period
    miss = float(np.sqrt(np.mean((later - drive.value)[inside] ** 2))) / drive.u_pp
    if miss < 0.05:
        return None
    return _wrong(run, _swings(drive.value) / 2 / drive.time[-1])


def _swings(value: np.ndarray) -> int:
    """Number of crossings of the middle, with a tenth of the span as dead band."""
    place = (value - value.min()) / np.ptp(value)
    state = np.where(place > 0.6, 1, np.where(place < 0.4, -1, 0))
    state = state[state != 0]
    return int(np.count_nonzero(np.diff(state)))


def _wrong(run: Run, seen: float) -> Fault:
    return Fault(
        "wrong period",
        run.name,
        f"run {run.name!r}: the drive does not repeat at {run.drive.rate:g} Hz; it swings at about "
        f'{seen:.3g} Hz. Correct `excitation_hz`, or say `waveform = "other"`.',
    )


def hops(recording: Recording, errors: list[np.ndarray], smallest: float = 0.002) -> list[Fault]:
    """Steps in a run's residual, larger than its noise and than `smallest` of the span: mode hops."""
    found = []
    for run, error in zip(recording.runs, errors, strict=True):
        use = usable(run, recording.response_lag_s)
        e = np.where(use, error, np.nan)[use]
        width = max(4, e.size // 400)
        if e.size < 8 * width or run.span == 0:
            continue
        before = ndimage.median_filter(e, 2 * width + 1, mode="nearest")
        step = before[2 * width :] - before[: -2 * width]
        jump = np.abs(np.diff(e, prepend=e[0]))[width:-width]
        noise = 1.4826 * float(np.median(np.abs(np.diff(e)))) / np.sqrt(2.0)
        slow = float(np.median(np.abs(step)))
        size = max(10.0 * noise, 8.0 * slow, smallest * run.span)
        at = np.flatnonzero((np.abs(step) > size) & (jump > 0.6 * size)) + width
        if at.size:
            where = np.flatnonzero(use)[at]
            grouped = _stretches(np.isin(np.arange(e.size), at))
            places = tuple((int(where[0]), int(where[-1])) for _ in range(1))
            found.append(
                Fault(
                    "mode hop",
                    run.name,
                    f"run {run.name!r}: the response jumps by about "
                    f"{float(np.abs(step[at - width]).max()):.3g} {recording.response_unit} at sample "
                    f"{int(where[0])} ({len(grouped)} place(s)), which no hysteresis does: a mode hop, or "
                    "fringes miscounted. Leave that part out, or shift bias or current.",
                    places,
                )
            )
    return found
