"""Pictures of recordings, alone and beside a model."""

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
    quantity,
    shown_runs,
    title,
)

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
    rows = shown_runs(recording, 6)
    figure = Picture(figsize=(9.6, 2.6 * len(rows) + 0.4), layout="constrained")
    axes = figure.subplots(len(rows), 2, squeeze=False, width_ratios=(2.0, 1.0))
    for (left, right), row in zip(axes, rows, strict=True):
        run = recording.runs[row]
        thin = slice(None, None, max(1, run.drive.size // 8000))
        time, drive, response = run.drive.time[thin], run.drive.value[thin], run.response[thin]
        left.plot(time, drive, lw=0.8, color=MEASURED)
        left.set_ylabel(f"drive ({recording.drive_unit})", color="black", fontsize=8)
        other = left.twinx()
        other.plot(time, response, lw=0.8, color=MODEL)
        other.set_ylabel(f"response ({recording.response_unit})", color=MODEL, fontsize=8)
        left.set_title(title(run, recording), fontsize=10)
        right.plot(drive, response, lw=0.8, color=UP)
        right.set_ylabel(f"response ({recording.response_unit})", fontsize=8)
    axes[-1, 0].set_xlabel("time (s)")
    axes[-1, 1].set_xlabel(f"drive ({recording.drive_unit})")
    return figure


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
    for axis, row in zip(axes, rows, strict=True):
        one = recording.runs[row]
        _draw_loop(axis, recording, one, None if predicted is None else predicted[row])
    axes[0].legend(frameon=False, markerscale=4, fontsize=8)
    return figure


def _draw_loop(axis: Any, recording: Recording, run: Any, model: np.ndarray | None) -> None:
    drive, unit = run.drive, recording.response_unit
    keep = run.valid & ((drive.period == drive.periods - 1) | (drive.periods == 0))
    if not keep.any():
        keep = run.valid
    u, y = drive.value[keep], run.response[keep]
    line = np.polyfit(u, y, 1) if drive.u_pp > 0 else np.array([0.0, y.mean()])
    straight = np.polyval(line, u)
    shown, factor = fine_unit(float(np.ptp(y - straight)), unit)
    left = factor * (y - straight)
    if drive.waveform in ("triangle", "sine") and u.size > 8 * GROUPS:
        for branch, label in ((drive.up[keep], MANY), (~drive.up[keep], None)):
            draw_spread(axis, u[branch], left[branch], MEASURED, label)
    else:
        every = max(1, u.size // MOST_POINTS)
        label = "measured" if every == 1 else f"measured, one of {every} readings"
        axis.plot(u[::every], left[::every], ".", ms=3, color=MEASURED, label=label)
    name = title(run, recording)
    if model is not None:
        thin = slice(None, None, max(1, u.size // 4000))
        bent = factor * (model[keep] - straight)
        axis.plot(u[thin], bent[thin], "-", lw=1.2, color=MODEL, label="model")
        error = model[keep] - y
        off = quantity(float(np.sqrt(np.mean(error**2))), unit)
        name += f"\nthe model is off by {off} rms"
        name += " in the last period" if keep.sum() < run.valid.sum() else ""
    axis.set_title(name, fontsize=10)
    axis.set_xlabel(f"drive ({recording.drive_unit})")
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
    rows = shown_runs(recording, 6)
    count = sum(2 if recording.runs[row].valid.any() else 1 for row in rows)
    figure = Picture(figsize=(8.0, 1.8 * max(count, 2) + 0.4), layout="constrained")
    panels = list(figure.subplots(count, 1, squeeze=False).ravel())
    first = panels[0]
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
        top.set_ylabel(f"response ({recording.response_unit})")
        if not measured:
            top.set_xlabel("time (s)")
            continue
        bottom = panels.pop(0)
        error = run.response - predicted[row]
        rms = float(np.sqrt(np.nanmean(error[run.valid] ** 2)))
        unit, factor = fine_unit(rms, recording.response_unit)
        draw_spread(bottom, run.drive.time, factor * error, UP)
        bottom.axhline(0.0, lw=0.8, color="black")
        off = quantity(rms, recording.response_unit)
        top.set_title(f"{title(run, recording)}: the prediction is off by {off} rms", fontsize=10)
        bottom.set_ylabel(f"difference ({unit})")
        bottom.set_xlabel("time (s)")
    low, high = first.get_ylim()
    first.set_ylim(low, high + 0.3 * (high - low))  # room for the legend
    first.legend(frameon=False, fontsize=8, ncols=2, loc="upper right")
    return figure
