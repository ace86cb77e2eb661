"""Pictures: the only module that imports matplotlib. Functions return figures and show nothing."""

import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ._metrics import linearity
from ._recording import Recording

_MEASURED, _MODEL = "#9aa5b1", "#d1495b"
_UP, _DOWN = "#00798c", "#edae49"


def _grid(count: int, height: float = 3.0) -> tuple[Figure, list[Any]]:
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = Figure(figsize=(5.2 * columns, height * rows + 0.4), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for spare in axes[count:]:
        spare.set_visible(False)
    return figure, list(axes[:count])


def _title(run: Any) -> str:
    rate = run.drive.excitation_hz
    return run.name if rate is None else f"{run.name}, {rate:g} Hz"


def _chosen(recording: Recording, most: int = 12) -> list[int]:
    return list(range(min(len(recording.runs), most)))


def png(figure: Figure) -> bytes:
    """A figure as the bytes of a PNG file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120)
    return buffer.getvalue()


def overview(recording: Recording) -> Figure:
    """Drive and response of each run over time, and its loop: what was imported."""
    rows = _chosen(recording, 6)
    figure = Figure(figsize=(9.6, 2.6 * len(rows) + 0.4), layout="constrained")
    axes = figure.subplots(len(rows), 2, squeeze=False, width_ratios=(2.0, 1.0))
    for (left, right), row in zip(axes, rows, strict=True):
        run = recording.runs[row]
        thin = slice(None, None, max(1, run.drive.size // 8000))
        time, drive, response = run.drive.time[thin], run.drive.value[thin], run.response[thin]
        left.plot(time, drive, lw=0.8, color=_MEASURED)
        left.set_ylabel(f"drive ({recording.drive_unit})", color="black", fontsize=8)
        other = left.twinx()
        other.plot(time, response, lw=0.8, color=_MODEL)
        other.set_ylabel(f"response ({recording.response_unit})", color=_MODEL, fontsize=8)
        left.set_title(_title(run), fontsize=10)
        right.plot(drive, response, lw=0.8, color=_UP)
    axes[-1, 0].set_xlabel("time (s)")
    axes[-1, 1].set_xlabel(f"drive ({recording.drive_unit})")
    return figure


def loops(recording: Recording, predicted: Sequence[np.ndarray] | None = None) -> Figure:
    """Response against drive for each run: measured and, where given, modelled (Fig. 6)."""
    rows = _chosen(recording)
    figure, axes = _grid(len(rows))
    for axis, row in zip(axes, rows, strict=True):
        run = recording.runs[row]
        thin = slice(None, None, max(1, run.drive.size // 4000))
        axis.plot(
            run.drive.value[thin], run.response[thin], ".", ms=2, color=_MEASURED, label="measured"
        )
        if predicted is not None:
            axis.plot(
                run.drive.value[thin], predicted[row][thin], "-", lw=1, color=_MODEL, label="model"
            )
        axis.set_title(_title(run), fontsize=10)
        axis.set_xlabel(f"drive ({recording.drive_unit})")
        axis.set_ylabel(f"response ({recording.response_unit})")
    axes[0].legend(frameon=False, markerscale=4)
    return figure


def residuals(
    recording: Recording, predicted: Sequence[np.ndarray], used: Sequence[np.ndarray]
) -> Figure:
    """Measured less modelled against scan phase, up and down branches apart."""
    rows = _chosen(recording)
    figure, axes = _grid(len(rows), 2.6)
    for axis, row in zip(axes, rows, strict=True):
        run = recording.runs[row]
        error = run.response - predicted[row]
        for branch, colour, name in ((run.drive.up, _UP, "up"), (~run.drive.up, _DOWN, "down")):
            part = branch & used[row]
            axis.plot(run.drive.phase[part], error[part], ".", ms=2, color=colour, label=name)
        axis.axhline(0.0, lw=0.8, color="black")
        axis.set_title(_title(run), fontsize=10)
        axis.set_xlabel("scan phase since the drive's minimum")
        axis.set_ylabel(f"residual ({recording.response_unit})")
    axes[0].legend(frameon=False, markerscale=4)
    return figure


def convergence(traces: Sequence[tuple[str, Sequence[tuple[int, float]], bool]]) -> Figure:
    """Cost against solver steps of each start: (name, (step, cost) pairs, ended best)."""
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    axis = figure.subplots()
    for i, (name, trace, best) in enumerate(traces):
        steps, costs = zip(*trace, strict=True)
        costs = np.maximum(costs, 1e-300)
        axis.plot(steps, costs, "o-" if best else "x--", ms=4, color=f"C{i % 10}", label=name)
    axis.set_yscale("log")
    axis.set_xlabel("solver steps")
    axis.set_ylabel("cost (half the weighted sum of squares)")
    axis.set_title("starts: solid ended in the best end, dashed elsewhere", fontsize=10)
    axis.legend(frameon=False, fontsize=8)
    return figure


def predictions(recording: Recording, predicted: Sequence[np.ndarray]) -> Figure:
    """Response and prediction over time, with the difference below, for each run."""
    rows = _chosen(recording, 6)
    figure = Figure(figsize=(8.0, 3.6 * len(rows) + 0.4), layout="constrained")
    pairs = figure.subplots(2 * len(rows), 1, squeeze=False).ravel()
    for i, row in enumerate(rows):
        run, top, bottom = recording.runs[row], pairs[2 * i], pairs[2 * i + 1]
        thin = slice(None, None, max(1, run.drive.size // 8000))
        top.plot(run.drive.time[thin], run.response[thin], color=_MEASURED, lw=2, label="measured")
        top.plot(run.drive.time[thin], predicted[row][thin], color=_MODEL, lw=1, label="predicted")
        top.set_title(_title(run), fontsize=10)
        top.set_ylabel(recording.response_unit)
        bottom.plot(run.drive.time[thin], (run.response - predicted[row])[thin], lw=0.8, color=_UP)
        bottom.set_ylabel(f"difference ({recording.response_unit})", fontsize=8)
        bottom.set_xlabel("time (s)")
    pairs[0].legend(frameon=False)
    return figure


def compensation(made: Sequence[Any], unit: str, drive_unit: str) -> Figure:
    """Each target and the drive for it over one period, and the drive less a straight one."""
    figure = Figure(figsize=(8.0, 7.5), layout="constrained")
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    for i, one in enumerate(made):
        drive, label = one.drive, f"{one.drive.rate:g} Hz"
        phase = drive.time * drive.rate
        top.plot(phase, one.target.value, color=f"C{i}", lw=1, label=label)
        middle.plot(phase, drive.value, color=f"C{i}", lw=1)
        straight = drive.value.min() + drive.u_pp * one.target.value / one.target.span
        bottom.plot(phase, drive.value - straight, color=f"C{i}", lw=1)
    top.set_ylabel(f"scan asked for ({unit})")
    top.legend(frameon=False, ncols=4, fontsize=8)
    middle.set_ylabel(f"drive ({drive_unit})")
    bottom.set_ylabel(f"drive less a straight one ({drive_unit})", fontsize=8)
    bottom.axhline(0.0, lw=0.8, color="black")
    bottom.set_xlabel("scan phase since the drive's minimum")
    return figure


def scans(before: Recording, after: Recording) -> Figure:
    """Scans with and without compensation, and what a straight line leaves of each (Fig. 9)."""
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True)
    for column, (recording, name) in enumerate(
        ((before, "without compensation"), (after, "with compensation"))
    ):
        top, bottom = axes[:, column]
        for i, run in enumerate(recording.runs):
            phase = run.drive.time * run.drive.rate
            label = f"{run.drive.rate:g} Hz"
            about = run.response - np.nanmean(run.response)  # fringes give no common origin
            top.plot(phase, about, lw=1, color=f"C{i}", label=label)
            scan = linearity(run)
            for branch, begin in ((scan.up, scan.turning[0]), (scan.down, scan.turning[1])):
                at = np.mod(begin + branch.time * run.drive.rate, 1.0)
                order = np.argsort(at)
                bottom.plot(at[order], 1e3 * branch.residual[order], lw=1, color=f"C{i}")
        top.set_title(name, fontsize=10)
        bottom.set_xlabel("scan phase since the drive's minimum")
        bottom.axhline(0.0, lw=0.8, color="black")
    axes[0, 0].set_ylabel(f"optical frequency about its mean ({before.response_unit})")
    axes[1, 0].set_ylabel("nonlinearity (MHz)")
    axes[0, 0].legend(frameon=False, fontsize=8)
    return figure


def learning(courses: Sequence[tuple[str, Any]]) -> Figure:
    """Nonlinearity (rms) against iteration, both branches, for each (name, `Learned`)."""
    figure = Figure(figsize=(6.8, 4.2), layout="constrained")
    axis = figure.subplots()
    for i, (name, course) in enumerate(courses):
        rms = 1e3 * np.asarray(course.rms_ghz)
        for column, (branch, style) in enumerate((("up", "o-"), ("down", "s--"))):
            axis.plot(rms[:, column], style, ms=4, color=f"C{i}", label=f"{name}, {branch}")
    axis.set_yscale("log")
    axis.set_xlabel("iteration")
    axis.set_ylabel("rms nonlinearity (MHz)")
    axis.legend(frameon=False, fontsize=8)
    return figure


def word_lengths(errors: Sequence[Any]) -> Figure:
    """Largest errors of drive and scan against word length, for each `WordLengthError`."""
    bits = np.array([e.bits for e in errors])
    figure = Figure(figsize=(6.8, 4.2), layout="constrained")
    axis = figure.subplots()
    axis.plot(bits, [e.response for e in errors], "o-", ms=4, color=_UP, label="scan (GHz)")
    axis.plot(bits, [e.drive for e in errors], "s--", ms=4, color=_DOWN, label="drive (V)")
    half = errors[0].response * 2.0 ** (bits[0] - bits)
    axis.plot(bits, half, ":", color=_MEASURED, label="half as much a bit")
    axis.set_yscale("log")
    axis.set_xticks(bits[::2])
    axis.set_xlabel("word length (bits)")
    axis.set_ylabel("largest error")
    axis.legend(frameon=False, fontsize=8)
    return figure


def ranging(found: Any) -> Figure:
    """Distances of scans over time with their errors, the track, and the scans' nonlinearity.

    `found`: a `Ranging`. Error bars and bands are standard errors.
    """
    track, table = found.target.track, found.table
    figure = Figure(figsize=(9.0, 7.6 if track is not None else 5.4), layout="constrained")
    axes = figure.subplots(3 if track is not None else 2, 1, sharex=True)
    top, bottom = axes[0], axes[-1]
    good = np.flatnonzero(np.isfinite(found.distance))
    middle = round(float(np.mean(found.distance[good])), 6) if good.size else 0.0
    unit, factor = _fine_unit(found.distance[good] - middle)
    thin = max(1, table.size // 4000)
    for rising, colour, name in ((True, _UP, "up-scans"), (False, _DOWN, "down-scans")):
        part = good[table.rising[good] == rising][::thin]
        off, error = factor * (found.distance[part] - middle), factor * found.stderr[part]
        top.errorbar(
            table.time_s[part], off, error, fmt="o", ms=3, lw=0.8, color=colour, label=name
        )
        part = np.flatnonzero(table.rising == rising)[::thin]
        bottom.plot(table.time_s[part], 1e3 * table.bend_ghz[part], "o", ms=3, color=colour)
    if track is not None:
        value, error = track.distance - middle, track.distance_stderr
        _band(top, track.time_s, factor * value, factor * error)
        per, factor = _fine_unit(track.velocity)
        _band(axes[1], track.time_s, factor * track.velocity, factor * track.velocity_stderr)
        axes[1].set_ylabel(f"velocity ({per}/s)")
    top.set_ylabel(f"distance less {1e3 * middle:.3f} mm ({unit})")
    top.legend(frameon=False, fontsize=8, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    bottom.set_ylabel("rms nonlinearity (MHz)")
    bottom.set_ylim(bottom=0.0)
    bottom.set_xlabel("session time (s)")
    return figure


def population(found: Any, change: Any = None) -> Figure:
    """Each parameter of a `Population` over time at the mean temperature, with its 95 % bands.

    The inner band is of the expectation, the outer one of recordings without errors of their own.
    Where time is no covariate, recordings stand in their order. `change`: of a new recording.
    """
    recordings, warm = found.recordings, "temperature" in found.covariates.names
    timed = "time" in found.covariates.names
    place = np.array([one.days if timed else i for i, one in enumerate(recordings)], dtype=float)
    mean = found.covariates.means[found.covariates.names.index("temperature")] if warm else 0.0
    off = np.array([one.temperature_c - mean if warm else 0.0 for one in recordings])
    outlier = np.array([one.outlier for one in recordings])
    new = place.max() + 0.04 * np.ptp(place)
    if change is not None and timed and change.days is not None:
        new = change.days
    ends = (min(place.min(), new), max(place.max(), new)) if change else (place.min(), place.max())
    grid = np.linspace(*ends, 200)
    curve = [found.expectation(days=float(day) if timed else None) for day in grid]
    figure, axes = _grid(len(found.parameters), 2.4)
    for j, (axis, parameter) in enumerate(zip(axes, found.parameters, strict=True)):
        slope = parameter.temperature.value if warm else 0.0
        value = np.array([one.values[j] for one in recordings]) - slope * off
        error = np.array([one.stderr[j] for one in recordings])
        middle, *bands = (
            np.array([getattr(one, name)[j] for one in curve])
            for name in ("values", "spread", "stderr")
        )
        for band, alpha in zip(bands, (0.15, 0.3), strict=True):
            low, high = middle - 1.96 * band, middle + 1.96 * band
            axis.fill_between(grid, low, high, color=_MODEL, alpha=alpha, lw=0)
        axis.plot(grid, middle, "-", lw=1, color=_MODEL, label="population")
        for part, colour, name in ((~outlier, _UP, "recordings"), (outlier, "black", "outliers")):
            if part.any():
                style = "o" if colour == _UP else "x"
                axis.errorbar(
                    place[part], value[part], error[part], fmt=style, ms=3, lw=0.8, color=colour,
                    label=name,
                )  # fmt: skip
        if change is not None:
            one = change.parameters[j]
            measured = one.measured - (one.expected - one.expected_at_mean)
            colour = _DOWN if change.changed and one.name in change.set else "black"
            axis.errorbar([new], [measured], [one.stderr], fmt="D", ms=5, color=colour, label="new")
        axis.set_title(parameter.name, fontsize=10)
        axis.set_ylabel("" if parameter.unit == "1" else parameter.unit)
        axis.set_xlabel("days since the first" if timed else "recording")
    axes[0].legend(frameon=False, fontsize=7)
    return figure


def _fine_unit(metres: np.ndarray) -> tuple[str, float]:
    """The unit of lengths in which the largest reads best, and the factor from m."""
    most = float(np.max(np.abs(metres), initial=0.0))
    return ("mm", 1e3) if most >= 1e-3 else ("um", 1e6)


def _band(axis: Any, time: np.ndarray, value: np.ndarray, stderr: np.ndarray) -> None:
    axis.fill_between(time, value - stderr, value + stderr, color=_MODEL, alpha=0.2, lw=0)
    axis.plot(time, value, "-", lw=1, color=_MODEL, label="track")
