"""Pictures of recordings, alone and beside a model."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..recording._recording import Recording
from ._style import (
    GROUPS,
    MEASURED,
    MODEL,
    UP,
    Picture,
    draw_spread,
    fine_unit,
    grid,
    in_unit,
    name_lines,
    one_unit,
    shown_runs,
    title,
    unit_text,
)

MOST_RUNS = 6  # that are drawn over time
MOST_POINTS = 600  # of a loop: more lie over each other
MANY = "measured, with 95 % band"


def overview(recording: Recording) -> Picture:
    """Drive and response of each run over time, and its loop: what was imported.

    >>> import numpy as np
    >>> from rapi_jax import plot
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> truth = [np.asarray(predict(paper_device(), drive)) for drive in drives]
    >>> noise = np.random.default_rng(0).standard_normal(100)  # GHz
    >>> recording = Recording.of(drives, [y + 0.02 * noise for y in truth])
    >>> picture = plot.overview(recording)
    >>> len(picture.axes)
    6
    """
    rows, every = shown_runs(recording, MOST_RUNS), len(recording.runs)
    figure = Picture(figsize=(9.6, 2.6 * len(rows) + 0.4), layout="constrained")
    axes = figure.subplots(len(rows), 2, squeeze=False, width_ratios=(2.0, 1.0))
    drive_label = f"drive ({unit_text(recording.drive_unit)})"
    response_label = f"response ({unit_text(recording.response_unit)})"
    longest = max(float(np.ptp(recording.runs[row].drive.time)) for row in rows)
    time_unit, factor = fine_unit(longest, "s")
    for (left, right), row in zip(axes, rows, strict=True):
        run = recording.runs[row]
        thin = slice(None, None, max(1, run.drive.size // 8000))
        time, drive, response = run.drive.time[thin], run.drive.value[thin], run.response[thin]
        left.plot(factor * time, drive, lw=0.8, color=MEASURED)
        _name_axis(left, drive_label, MEASURED)
        other = left.twinx()
        other.plot(factor * time, response, lw=0.8, color=MODEL)
        _name_axis(other, response_label, MODEL)
        left.set_title(title(run, recording), fontsize=10)
        right.plot(drive, response, lw=0.8, color=UP)
        right.set_ylabel(response_label, fontsize=8)
    axes[-1, 0].set_xlabel(f"time ({time_unit})")
    axes[-1, 1].set_xlabel(drive_label)
    if every > len(rows):
        figure.suptitle(f"the first {len(rows)} of {every} runs", fontsize=10)
    return figure


def _name_axis(axis: Any, label: str, colour: str) -> None:
    """Name an axis in the colour of its line."""
    axis.set_ylabel(label, color=colour, fontsize=8)
    axis.tick_params(axis="y", labelcolor=colour)


def loops(
    recording: Recording,
    predicted: Sequence[np.ndarray] | None = None,
    *,
    run: int | None = None,
    ax: Any = None,
) -> Any:
    """Hysteresis loops: response less its least-squares line in the drive (after Fig. 6).

    The last period of each run. Many readings are drawn as their median and the band that holds
    95 % of them, branch by branch; of a drive with loops inside loops, every so many, which the
    legend says.
    `predicted`: the model's response to each run, drawn beside the measured one. `run`: that run
    alone; `ax`: axes to draw it (the first, unless one is given) into.

    >>> import numpy as np
    >>> from rapi_jax import plot
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> truth = [np.asarray(predict(paper_device(), drive)) for drive in drives]
    >>> noise = np.random.default_rng(0).standard_normal(100)  # GHz
    >>> recording = Recording.of(drives, [y + 0.02 * noise for y in truth])
    >>> picture = plot.loops(recording, truth)
    >>> picture.axes[0].get_xlabel(), picture.axes[0].get_ylabel()
    ('drive (V)', 'response less a straight line (GHz)')
    """
    rows = shown_runs(recording) if run is None and ax is None else [run or 0]
    figure, axes = grid(len(rows)) if ax is None else (ax.figure, [ax])
    shown = [
        _take_loop(recording.runs[row], None if predicted is None else predicted[row])
        for row in rows
    ]
    unit = recording.response_unit
    width = one_unit([float(np.ptp(one.left)) for one in shown], unit)
    off = one_unit([one.off for one in shown], unit)
    for axis, one in zip(axes, shown, strict=True):
        _draw_loop(axis, recording, one, width, off)
    name_lines(figure, axes[0], ax is None)
    return figure


@dataclasses.dataclass(frozen=True)
class _Loop:
    """The last period of a run: `left`, the response, and `bent`, the model's, less a line.

    `off`: the rms of what the model leaves of it, 0 without a model.
    """

    run: Any
    drive: np.ndarray
    up: np.ndarray
    left: np.ndarray
    bent: np.ndarray | None
    off: float
    whole: bool


def _take_loop(run: Any, model: np.ndarray | None) -> _Loop:
    drive = run.drive
    keep = run.valid & ((drive.period == drive.periods - 1) | (drive.periods == 0))
    if not keep.any():
        keep = run.valid
    u, y = drive.value[keep], run.response[keep]
    line = np.polyfit(u, y, 1) if drive.u_pp > 0 else np.array([0.0, y.mean()])
    straight = np.polyval(line, u)
    bent = None if model is None else model[keep] - straight
    off = 0.0 if model is None else float(np.sqrt(np.mean((model[keep] - y) ** 2)))
    whole = bool(keep.sum() == run.valid.sum())
    return _Loop(run, u, drive.up[keep], y - straight, bent, off, whole)


def _draw_loop(
    axis: Any,
    recording: Recording,
    one: _Loop,
    width: tuple[str, float],
    off: tuple[str, float],
) -> None:
    """`width`, `off`: the units of loops and of what the model leaves, and the factors to them."""
    shown, factor = width
    u, left = one.drive, factor * one.left
    if one.run.drive.waveform in ("triangle", "sine") and u.size > 8 * GROUPS:
        for branch, label in ((one.up, MANY), (~one.up, None)):
            draw_spread(axis, u[branch], left[branch], MEASURED, label)
    else:
        every = max(1, u.size // MOST_POINTS)
        label = "measured" if every == 1 else f"measured, one of {every} readings"
        axis.plot(u[::every], left[::every], ".", ms=3, color=MEASURED, label=label)
    name = title(one.run, recording)
    if one.bent is not None:
        thin = slice(None, None, max(1, u.size // 4000))
        axis.plot(u[thin], factor * one.bent[thin], "-", lw=1.2, color=MODEL, label="model")
        name += f"\nthe model is off by {in_unit(one.off, off)} rms"
        name += "" if one.whole else " in the last period"
    axis.set_title(name, fontsize=10)
    axis.set_xlabel(f"drive ({unit_text(recording.drive_unit)})")
    axis.set_ylabel(f"response less a straight line ({shown})", fontsize=9)


def predictions(recording: Recording, predicted: Sequence[np.ndarray]) -> Picture:
    """Response and prediction over time, with the difference below, for each run.

    Many differences are drawn as their median and the band that holds 95 % of them. Of a run
    without any reading the prediction alone is drawn.

    >>> import numpy as np
    >>> from rapi_jax import plot
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> truth = [np.asarray(predict(paper_device(), drive)) for drive in drives]
    >>> noise = np.random.default_rng(0).standard_normal(100)  # GHz
    >>> recording = Recording.of(drives, [y + 0.02 * noise for y in truth])
    >>> picture = plot.predictions(recording, truth)
    >>> len(picture.axes)
    4
    """
    rows, unit = shown_runs(recording, MOST_RUNS), recording.response_unit
    count = sum(2 if recording.runs[row].valid.any() else 1 for row in rows)
    figure = Picture(figsize=(8.0, 1.8 * max(count, 2) + 0.4), layout="constrained")
    panels = list(figure.subplots(count, 1, squeeze=False).ravel())
    first = panels[0]
    scale = one_unit([_rms_off(recording.runs[row], predicted[row]) for row in rows], unit)
    for row in rows:
        run, top = recording.runs[row], panels.pop(0)
        thin = slice(None, None, max(1, run.drive.size // 8000))
        measured = run.valid.any()
        if measured:
            top.plot(
                run.drive.time[thin], run.response[thin], color=MEASURED, lw=2, label="measured"
            )
        top.plot(run.drive.time[thin], predicted[row][thin], color=MODEL, lw=1, label="predicted")
        top.set_title(title(run, recording), fontsize=10)
        top.set_ylabel(f"response ({unit_text(recording.response_unit)})")
        if not measured:
            top.set_xlabel("time (s)")
            continue
        bottom = panels.pop(0)
        error = run.response - predicted[row]
        draw_spread(bottom, run.drive.time, scale[1] * error, UP)
        bottom.axhline(0.0, lw=0.8, color="black")
        off = in_unit(_rms_off(run, predicted[row]), scale)
        top.set_title(f"{title(run, recording)}: the prediction is off by {off} rms", fontsize=10)
        bottom.set_ylabel(f"difference ({scale[0]})")
        bottom.set_xlabel("time (s)")
    low, high = first.get_ylim()
    first.set_ylim(low, high + 0.3 * (high - low))  # room for the legend
    first.legend(frameon=False, fontsize=8, ncols=2, loc="upper right")
    return figure


def _rms_off(run: Any, predicted: np.ndarray) -> float:
    """Of the difference, 0 of a run without any reading."""
    error = (run.response - predicted)[run.valid]
    return float(np.sqrt(np.mean(error**2))) if error.size else 0.0
