"""Pictures of a fit: residuals over phase and over frequency, starts, correlation."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from ..recording._recording import Recording
from ._style import (
    DOWN,
    MEASURED,
    PALETTE,
    UP,
    draw_spread,
    grid,
    in_unit,
    name_lines,
    one_axis,
    one_unit,
    shown_runs,
    title,
    trim_height,
)

SPECTRAL_SEGMENT = 4096  # samples, of Welch's average
STEPS_A_DECADE = 24


def residuals(
    recording: Recording,
    predicted: Sequence[np.ndarray],
    used: Sequence[np.ndarray],
    *,
    run: int | None = None,
    ax: Any = None,
) -> Any:
    """Measured less modelled over the scan phase, up and down branches apart.

    Many readings are drawn as their median and the band that holds 95 % of them. `run`: that run
    alone; `ax`: axes to draw it (the first, unless one is given) into.

    >>> import numpy as np
    >>> from rapi_jax import plot
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> truth = [np.asarray(predict(paper_device(), drive)) for drive in drives]
    >>> noise = np.random.default_rng(0).standard_normal(100)  # GHz
    >>> recording = Recording.of(drives, [y + 0.02 * noise for y in truth])
    >>> used = [np.ones(100, bool)] * 2
    >>> picture = plot.residuals(recording, truth, used)
    >>> picture.axes[0].get_xlabel(), picture.axes[0].get_ylabel()
    ("scan phase since the drive's minimum", 'residual (MHz)')
    """
    rows = shown_runs(recording) if run is None and ax is None else [run or 0]
    figure, axes = grid(len(rows), 2.6) if ax is None else (ax.figure, [ax])
    errors = {row: recording.runs[row].response - predicted[row] for row in rows}
    sizes = {row: _rms(error[used[row]]) for row, error in errors.items()}
    scale = one_unit(sizes.values(), recording.response_unit)
    for axis, row in zip(axes, rows, strict=True):
        one, error, factor = recording.runs[row], errors[row], scale[1]
        for branch, colour, name in ((one.drive.up, UP, "up"), (~one.drive.up, DOWN, "down")):
            part = branch & used[row]
            draw_spread(axis, one.drive.phase[part], factor * error[part], colour, name)
        axis.axhline(0.0, lw=0.8, color="black")
        name = title(one, recording)
        left = f"{in_unit(sizes[row], scale)} rms left"
        left += " in all periods" if one.drive.periods > 1 else ""
        axis.set_title(f"{name}: {left}", fontsize=10)
        axis.set_xlabel("scan phase since the drive's minimum")
        axis.set_ylabel(f"residual ({scale[0]})")
    name_lines(figure, axes[0], ax is None)
    return figure


def spectrum(
    recording: Recording,
    predicted: Sequence[np.ndarray],
    used: Sequence[np.ndarray],
    *,
    ax: Any = None,
) -> Any:
    """Amplitude spectral density of what each run leaves, by Welch's method.

    Power is averaged in 24 steps a decade. White noise is level, slow noise falls with frequency,
    and a resonance or a pickup is a line.

    >>> import numpy as np
    >>> from rapi_jax import plot
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> truth = [np.asarray(predict(paper_device(), drive)) for drive in drives]
    >>> noise = np.random.default_rng(0).standard_normal(100)  # GHz
    >>> recording = Recording.of(drives, [y + 0.02 * noise for y in truth])
    >>> used = [np.ones(100, bool)] * 2
    >>> picture = plot.spectrum(recording, truth, used)
    >>> picture.axes[0].get_xlabel(), picture.axes[0].get_ylabel()
    ('frequency (Hz)', 'residual (MHz/√Hz)')
    """
    from scipy.signal import welch

    figure, axis = one_axis(ax, (6.4, 4.6))
    rows = shown_runs(recording, len(PALETTE))
    errors = [(recording.runs[row].response - predicted[row])[used[row]] for row in rows]
    unit, factor = one_unit(map(_rms, errors), recording.response_unit)  # as its residuals
    for i, (row, error) in enumerate(zip(rows, errors, strict=True)):
        one = recording.runs[row]
        if error.size < 16:
            continue
        hertz, power = welch(
            error, 1.0 / one.drive.step_s, nperseg=min(error.size, SPECTRAL_SEGMENT)
        )
        at, mean = _average_in_steps(hertz[1:], power[1:])
        axis.loglog(
            at, factor * np.sqrt(mean), lw=1.2, color=PALETTE[i], label=title(one, recording)
        )
    axis.set_xlabel("frequency (Hz)")
    axis.set_ylabel(f"residual ({unit}/√Hz)")
    axis.set_title("what the model leaves, over frequency", fontsize=10)
    name_lines(figure, axis, ax is None)
    return figure


def _rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(error**2))) if error.size else 0.0


def _average_in_steps(
    hertz: Float[np.ndarray, " lines"], power: Float[np.ndarray, " lines"]
) -> tuple[np.ndarray, np.ndarray]:
    """Mean power in steps of equal ratio of frequency, so that noise does not fill the picture."""
    step = np.floor(STEPS_A_DECADE * np.log10(hertz / hertz[0]) + 1e-9).astype(int)
    count = np.bincount(step)
    full = count > 0
    at = np.bincount(step, hertz)[full] / count[full]
    return at, np.bincount(step, power)[full] / count[full]


def correlation(
    names: Sequence[str], matrix: Float[np.ndarray, "names names"], *, ax: Any = None
) -> Any:
    """Correlation of the parameters' errors: those near 1 or -1 are fixed only together.

    >>> import numpy as np
    >>> from rapi_jax import plot
    >>> picture = plot.correlation(["alpha", "zeta"], np.array([[1.0, -0.8], [-0.8, 1.0]]))
    >>> [label.get_text() for label in picture.axes[0].get_xticklabels()]
    ['alpha', 'zeta']
    """
    side = 2.2 + 0.34 * len(names)  # inches
    figure, axis = one_axis(ax, (side, side + 0.6))
    if ax is None:
        figure.set_layout_engine("compressed")  # a bar as wide as the matrix
    picture = axis.imshow(matrix, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    axis.set_xticks(range(len(names)), names, rotation=90, fontsize=8)
    axis.set_yticks(range(len(names)), names, fontsize=8)
    axis.set_xlabel("parameter")
    bar = figure.colorbar(
        picture, ax=axis, label="correlation", location="bottom", fraction=0.05, pad=0.03,
        aspect=30, ticks=[-1, 0, 1],
    )  # fmt: skip
    bar.ax.tick_params(labelsize=8)
    axis.set_title("correlation of the parameters' errors", fontsize=10)
    if ax is None:
        trim_height(figure)
    return figure


def convergence(
    traces: Sequence[tuple[str, Sequence[tuple[int, float]], bool]], *, ax: Any = None
) -> Any:
    """Cost against solver steps of each start: (name, (step, cost) pairs, agrees).

    `agrees`: it ended with nearly the response of the lowest cost.

    >>> from rapi_jax import plot
    >>> picture = plot.convergence([("guess 1", [(0, 9.0), (1, 1.2), (2, 1.0)], True)])
    >>> picture.axes[0].get_xlabel(), picture.axes[0].get_ylabel()
    ('solver steps', 'cost (half the weighted sum of squares)')
    """
    from matplotlib.ticker import MaxNLocator

    figure, axis = one_axis(ax, (6.4, 4.2))
    reached = sum(agrees for _, _, agrees in traces)
    if all(len(trace) == 1 for _, trace, _ in traces):
        lowest = min(trace[0][1] for _, trace, _ in traces)
        axis.set_axis_off()
        axis.text(
            0.5, 0.5,
            "no step of the solver improved any start:\n"
            f"{reached} of {len(traces)} ended with nearly the response of the lowest cost, "
            f"{lowest:.3g}",
            ha="center", va="center", transform=axis.transAxes,
        )  # fmt: skip
        axis.set_title("the starts of the fit", fontsize=10)
        return figure
    names = {
        True: f"ended with nearly the response of the lowest cost ({reached} of {len(traces)})",
        False: f"ended in another optimum ({len(traces) - reached})",
    }
    for _, trace, agrees in sorted(traces, key=lambda one: one[2]):
        steps, costs = zip(*trace, strict=True)
        axis.plot(
            steps, np.maximum(costs, 1e-300), "o-" if agrees else "x--", ms=4, lw=1.2,
            color=UP if agrees else MEASURED, label=names.pop(agrees, None),
        )  # fmt: skip
    axis.set_yscale("log")
    low, high = axis.get_ylim()
    if high < 10.0 * low:  # starts that begin at the optimum
        axis.set_ylim(low / 3.0, 3.0 * high)
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    axis.set_xlabel("solver steps")
    axis.set_ylabel("cost (half the weighted sum of squares)")
    axis.set_title("the starts of the fit", fontsize=10)
    name_lines(figure, axis, ax is None)
    return figure
