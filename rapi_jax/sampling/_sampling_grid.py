"""One run's drive as a model sees it: turning points exact, history before the first sample."""

from typing import NamedTuple

import numpy as np

from rapi_jax.recording._drive import Drive

from ._reconstruction import nodes_between_samples, periodic_nodes_between_samples
from ._thresholds import THRESHOLDS

# Steps behind a turning point where nodes are added.
_REFINEMENT_STEPS = np.geomspace(1.0 / 64.0, 6.0, 24)


class Row(NamedTuple):
    """A run on two clocks: nodes for the operator, and the run itself.

    The nodes are one period of a drive that repeats exactly, from its minimum, where Eq. 13 is the
    periodic state; or all of a run that does not. `place` says which node each sample of the run
    is. Turning points between samples are nodes and samples too, with `sample` -1.
    """

    node_time: np.ndarray  # s in the session
    node_u: np.ndarray
    time: np.ndarray  # s in the session
    place: np.ndarray
    sample: np.ndarray  # index in the run; -1 in the lead-in and at turning points between samples
    lead: int  # samples of `time` before the run
    node_lead: int  # the same of the nodes
    period_s: float  # of the lead-in; 0 where there is none


def row_of(drive: Drive, lag_s: float, *, lead: bool) -> Row:
    """`drive`, answered `lag_s` later; with `lead` one period comes before what repeats."""
    count = drive.whole_period
    if count:
        return _tiled(drive, count, lag_s, lead)
    return _plain(drive.delayed(lag_s), lead)


def _tiled(drive: Drive, count: int, lag_s: float, lead: bool) -> Row:
    step, period = drive.step_s, count * drive.step_s
    value = drive.value[:count]
    at, height = periodic_nodes_between_samples(value, finer=lead)
    at = at * step
    if lead:  # a lag moves the drive's extreme to between samples
        at, height = _refine_behind_turns(value, step, at, height)
    phase, number = np.arange(count) * step, np.arange(count)
    u = _seen(value, step, at, height, lag_s) if lag_s else value
    if at.size:
        phase = np.concatenate([phase, np.mod(at + lag_s, period)])
        number = np.concatenate([number, np.full(at.size, -1)])
        u = np.concatenate([u, height])
    near = THRESHOLDS.near_sample * step
    first = phase[np.argmin(u)]
    phase = np.mod(phase - first + near, period) - near
    order = np.argsort(phase, kind="stable")  # of a few ascending pieces
    phase, number, u = phase[order], number[order], u[order]
    node_lead = u.size if lead else 0
    begin = -period if lead else 0.0
    whole = int(np.ceil((drive.time[-1] - begin) / period)) + 2
    turns = np.arange(-2, whole + 1)
    time = (first + turns[:, None] * period + phase[None, :]).ravel()
    # Ascending, but that rounding may not tell two that stand together; hence no search.
    kept = np.flatnonzero((time >= begin - near) & (time <= drive.time[-1] + near))
    time, place = time[kept], kept % phase.size
    nearest = np.round(time / step).astype(int)
    is_sample = (number[place] >= 0) & (nearest >= 0) & (nearest < drive.size)
    node_phase = np.concatenate([phase - period, phase]) if lead else phase
    return Row(
        drive.start_s + first + node_phase,
        np.tile(u, 2) if lead else u,
        drive.start_s + time,
        place + node_lead,
        np.where(is_sample, nearest, -1),
        int((time < -near).sum()),
        node_lead,
        period if lead else 0.0,
    )


def _seen(
    value: np.ndarray, step: float, at: np.ndarray, height: np.ndarray, lag_s: float
) -> np.ndarray:
    """The drive of `lag_s` ago at each sample; lines between samples and corners are exact."""
    count = value.size
    known = np.concatenate([np.arange(count) * step, at])
    order = np.argsort(known)
    levels = np.concatenate([value, height])[order]
    return np.interp(np.arange(count) * step - lag_s, known[order], levels, period=count * step)


def _refine_behind_turns(
    value: np.ndarray, step: float, at: np.ndarray, height: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes between the samples behind each turning point, besides those at `at`."""
    count, period = value.size, value.size * step
    known = np.concatenate([np.arange(count) * step, at])
    order = np.argsort(known)
    known, levels = known[order], np.concatenate([value, height])[order]
    rise = np.diff(levels, prepend=levels[-1:])
    turns = known[np.flatnonzero(rise * np.roll(rise, -1) < 0)]
    if not 0 < turns.size <= THRESHOLDS.most_turns:
        return at, height
    fine = np.unique(np.mod((turns[:, None] + step * _REFINEMENT_STEPS[None, :]).ravel(), period))
    far = np.abs(_around(fine[:, None] - known[None, :], period))
    fine = fine[(far.min(axis=1) > 1e-3 * step) & (fine < period - 1e-3 * step)]
    more = np.interp(fine, known, levels, period=period)
    return np.concatenate([at, fine]), np.concatenate([height, more])


def _around(difference: np.ndarray, period: float) -> np.ndarray:
    return np.mod(difference + period / 2, period) - period / 2


def _plain(drive: Drive, lead: bool) -> Row:
    before = drive.lead_in()  # from the minimum, where Eq. 13 is the periodic state
    length = round(1.0 / (drive.rate * drive.step_s)) if drive.repeats and lead else 0
    length = length if length <= drive.size else 0
    value = np.concatenate([before, drive.value[:length], drive.value])
    index = np.arange(-before.size - length, drive.size)
    at, height = nodes_between_samples(value, drive.samples_a_period, finer=lead)
    time = np.concatenate([index, at + index[0]]) * drive.step_s
    order = np.argsort(time, kind="stable")
    sample = np.concatenate([np.maximum(index, -1), np.full(at.size, -1)])[order]
    time, value = time[order], np.concatenate([value, height])[order]
    start = int(np.searchsorted(time, -(length + THRESHOLDS.near_sample) * drive.step_s))
    return Row(
        drive.start_s + time,
        value,
        drive.start_s + time[start:],
        np.arange(start, time.size),
        sample[start:],
        int(np.flatnonzero(sample[start:] == 0)[0]) if length else 0,
        start,
        length * drive.step_s,
    )
