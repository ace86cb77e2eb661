"""What all pictures share: colours, axes, densities, bytes of a file."""

import io
from collections.abc import Iterable
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from ..display._readable_unit import common_unit, readable_unit, significant
from ..display._readable_unit import quantity as plain_quantity
from ..display._typeset import typeset
from ..display._typeset import unit_text as unit_text
from ..recording._recording import Recording

# Each has a contrast of at least 3 (WCAG 2.1, 1.4.11) with white, and with the ground of a dark
# page, whose style turns pictures over; those of one picture are told apart with protanopia and
# deuteranopia. The first, second and fourth of `PALETTE` are of Okabe and Ito.
MEASURED, MODEL = "#8a949e", "#80103c"
UP, DOWN = "#0080b8", "#c46210"
PALETTE = ("#0072b2", "#d55e00", "#1e196e", "#009e73", "#852100", "#8d78f5")
GROUPS = 240  # of readings, along a curve
COLOURS = 128  # of a PNG's palette
NARROW = 4.8  # inches
_LONG = 36  # letters of a legend's entry, of which two do not fit side by side
_MARGIN = 0.05  # inches
SHOWN_DPI = 96  # in a notebook
WINDOW = 24  # readings at least of a median and its band: the fewest that tell 2.5 %


class Picture(Figure):
    """A figure that a notebook shows, with or without `matplotlib.pyplot`.

    >>> import numpy as np
    >>> from rapi_jax import plot
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> truth = [np.asarray(predict(paper_device(), drive)) for drive in drives]
    >>> noise = np.random.default_rng(0).standard_normal(100)  # GHz
    >>> recording = Recording.of(drives, [y + 0.02 * noise for y in truth])
    >>> isinstance(plot.overview(recording), plot.Picture)
    True
    """

    def _repr_png_(self) -> bytes:
        return png(self, dpi=SHOWN_DPI)


def png(figure: Figure, *, dpi: int = 120) -> bytes:
    """A figure as the bytes of a PNG file, with `dpi` dots an inch and a palette of 128 colours.

    The palette makes a file a third as large. A figure that is transparent keeps all its colours.

    >>> from rapi_jax import plot
    >>> picture = plot.convergence([("guess 1", [(0, 9.0), (1, 1.2), (2, 1.0)], True)])
    >>> plot.png(picture)[1:4]
    b'PNG'
    """
    from PIL import Image

    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    with Image.open(buffer) as picture:
        if picture.convert("RGBA").getchannel("A").getextrema() != (255, 255):
            return buffer.getvalue()
        small = picture.convert("RGB").quantize(
            COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
        )  # rare colours stay what they are
    out = io.BytesIO()
    small.save(out, format="png", optimize=True)
    return out.getvalue()


def narrowed(figure: Figure) -> Figure:
    """The figure itself, made narrow: its axes stand one below another, 4.8 inches wide.

    For a page on a small screen, where letters of a wide figure would be too small.

    >>> from rapi_jax import plot
    >>> picture = plot.Picture(figsize=(9.0, 3.0), layout="constrained")
    >>> left, right = picture.subplots(1, 2)
    >>> plot.narrowed(picture).get_size_inches().tolist()
    [4.8, 6.0]
    """
    cells: dict[tuple[int, ...], list[Any]] = {}
    for axis in figure.axes:
        spec = axis.get_subplotspec()
        if spec is not None and axis.get_visible():  # a colour bar has none
            cells.setdefault(spec.get_geometry(), []).append(axis)
    rows = max((geometry[0] for geometry in cells), default=1)
    height = float(figure.get_size_inches()[1]) / rows
    places = figure.add_gridspec(max(len(cells), 1), 1)
    for row, axes in enumerate(cells.values()):
        for axis in axes:
            axis.set_subplotspec(places[row])
    figure.set_size_inches(NARROW, height * max(len(cells), 1))
    if len(cells) == 1 and figure.axes[0].get_aspect() != "auto":  # a matrix, less high now
        trim_height(figure)
    return figure


def trim_height(figure: Figure) -> None:
    """Give a figure the height that what is drawn in it takes at its width."""
    for _ in range(2):  # gaps between axes are parts of the height
        figure.draw_without_rendering()
        width, height = figure.get_size_inches()
        figure.set_size_inches(width, min(height, figure.get_tightbbox().height + 2 * _MARGIN))


def svg(figure: Figure) -> bytes:
    """A figure as the bytes of an SVG file, the same for the same figure.

    >>> from rapi_jax import plot
    >>> picture = plot.convergence([("guess 1", [(0, 9.0), (1, 1.2), (2, 1.0)], True)])
    >>> plot.svg(picture)[:5]
    b'<?xml'
    """
    import matplotlib as mpl

    buffer = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "rapi"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def grid(count: int, height: float = 3.0) -> tuple[Picture, list[Any]]:
    """A figure with `count` axes in two columns."""
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = Picture(figsize=(5.2 * columns, height * rows + 0.4), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for spare in axes[count:]:
        spare.set_visible(False)
    return figure, list(axes[:count])


def one_axis(ax: Any, size: tuple[float, float] = (6.4, 3.8)) -> tuple[Any, Any]:
    """The axes `ax` and their figure, or those of a new figure where `ax` is `None`."""
    if ax is not None:
        return ax.figure, ax
    figure = Picture(figsize=size, layout="constrained")
    return figure, figure.subplots()


def name_lines(figure: Any, axis: Any, own: bool) -> None:
    """A legend of the lines of `axis`: outside all axes of a figure that is its `own`.

    In axes that were given it is framed, so that it can be read on what is drawn.
    """
    if not own:
        axis.legend(framealpha=0.85, fontsize=8, markerscale=3)
        return
    handles, labels = axis.get_legend_handles_labels()
    columns = 2 if max(map(len, labels), default=0) < _LONG else 1
    figure.legend(
        handles, labels, frameon=False, fontsize=8, markerscale=3, ncols=columns,
        loc="outside lower center",
    )  # fmt: skip


def title(run: Any, recording: Recording | None = None) -> str:
    """A run's name, its rate and, where the runs of `recording` differ in it, its swing."""
    rate = run.drive.excitation_hz
    name = run.name if rate is None else f"{run.name}, {rate_text(rate)}"
    if recording is None:
        return name
    swings = [one.drive.u_pp for one in recording.runs]
    differ = max(swings) > 1.05 * min(swings)
    swing = f"{significant(run.drive.u_pp, 3)} {unit_text(recording.drive_unit)}"
    return f"{name}, {swing}" if differ else name


def rate_text(hertz: float) -> str:
    """A scan rate: 20 Hz, 201.77 kHz."""
    unit, factor = readable_unit("Hz", (hertz,))
    return f"{factor * hertz:.6g} {unit}" if hertz >= 1.0 else f"{hertz:.6g} Hz"


def shown_runs(recording: Recording, most: int = 12) -> list[int]:
    """The runs that a picture has room for."""
    return list(range(min(len(recording.runs), most)))


def quantity(value: float, unit: str) -> str:
    """A size with three digits in the unit in which it reads best, as people write it: 4.2 μm."""
    return typeset(plain_quantity(value, unit))


def fine_unit(largest: float, unit: str) -> tuple[str, float]:
    """The unit in which `largest`, given in `unit`, reads best, as written; a factor."""
    name, factor = readable_unit(unit, (largest,))
    return unit_text(name), factor


def one_unit(sizes: Iterable[float], unit: str) -> tuple[str, float]:
    """One unit for all of a picture's `sizes`, given in `unit`, and the factor to it."""
    name, factor = common_unit(unit, sizes)
    return unit_text(name), factor


def in_unit(value: float, scale: tuple[str, float]) -> str:
    """A size with three digits, 2.00 as well as 2.01, in a unit of `one_unit`."""
    unit, factor = scale
    text = f"{factor * value:#.3g}".rstrip(".")
    return f"{typeset(text) if float(text) else 0} {unit}"


def draw_spread(
    axis: Any,
    x: Float[np.ndarray, " samples"],
    y: Float[np.ndarray, " samples"],
    colour: str,
    label: str | None = None,
) -> None:
    """Readings over `x`: as median and 95 % band, or, where they are few, as points.

    Neighbouring medians share readings where there are too few for windows side by side.
    """
    good = np.isfinite(y)
    order = np.argsort(x[good])
    x, y = x[good][order], y[good][order]
    if x.size < 8 * WINDOW:
        axis.plot(x, y, ".", ms=2, color=colour, label=label)
        return
    window = max(WINDOW, x.size // GROUPS)
    begin = np.linspace(0, x.size - window, min(GROUPS, x.size // 6)).astype(int)
    part = begin[:, None] + np.arange(window)
    at = np.median(x[part], axis=1)  # a reading from across the period moves a mean
    low, middle, high = np.percentile(y[part], (2.5, 50.0, 97.5), axis=1, method="median_unbiased")
    axis.fill_between(at, low, high, color=colour, alpha=0.25, lw=0)
    axis.plot(at, middle, lw=1.2, color=colour, label=label)
