"""Pictures of scans: drives that were made, scans before and after, learning, word lengths."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from .._metrics import linearity
from ..recording._recording import Recording
from ..recording._run import Run
from ._style import (
    DOWN,
    MEASURED,
    PALETTE,
    UP,
    Picture,
    draw_spread,
    in_unit,
    one_unit,
    rate_text,
    shown_runs,
    unit_text,
)


def compensation(made: Sequence[Any], unit: str, drive_unit: str) -> Picture:
    """Each target and the drive for it over one period, and the drive less a straight one.

    Of several drives also how far each is from the slowest.

    >>> from rapi_jax import DriveLimits, compensate, linear_scan, plot
    >>> from rapi_jax.examples import paper_device
    >>> (target,) = linear_scan(20.0, span=60.0, samples=512)
    >>> limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    >>> made = compensate(paper_device(), target, bias=3.0, limits=limits)
    >>> picture = plot.compensation([made], "GHz", "V")
    >>> len(picture.axes)
    3
    """
    several = len(made) > 1
    figure = Picture(figsize=(8.0, 9.6 if several else 7.5), layout="constrained")
    top, middle, bottom, *last = figure.subplots(4 if several else 3, 1, sharex=True)
    slowest = min((one.drive for one in made), key=lambda drive: drive.rate)
    for i, one in enumerate(made):
        drive, label = one.drive, rate_text(one.drive.rate)
        phase = drive.time * drive.rate
        top.plot(phase, one.target.value, color=PALETTE[i % len(PALETTE)], lw=1, label=label)
        middle.plot(phase, drive.value, color=PALETTE[i % len(PALETTE)], lw=1)
        straight = drive.value.min() + drive.u_pp * one.target.value / one.target.span
        bottom.plot(phase, drive.value - straight, color=PALETTE[i % len(PALETTE)], lw=1)
        for axis in last:
            apart = drive.value - np.interp(
                phase, slowest.time * slowest.rate, slowest.value, period=1.0
            )
            axis.plot(phase, apart, color=PALETTE[i % len(PALETTE)], lw=1)
    top.set_title("the scan that is asked for", fontsize=10)
    top.set_ylabel(f"scan ({unit_text(unit)})")
    top.legend(framealpha=0.85, fontsize=8)
    middle.set_title("the drive that the model needs for it", fontsize=10)
    middle.set_ylabel(f"drive ({unit_text(drive_unit)})")
    bottom.set_title("how far it is from a straight one of the same swing", fontsize=10)
    bottom.set_ylabel(f"difference ({unit_text(drive_unit)})")
    bottom.axhline(0.0, lw=0.8, color="black")
    for axis in last:
        axis.set_title(
            f"how far each drive is from that for {rate_text(slowest.rate)}", fontsize=10
        )
        axis.set_ylabel(f"difference ({unit_text(drive_unit)})")
    figure.axes[-1].set_xlabel("scan phase since the drive's minimum")
    return figure


def scans(
    before: Recording,
    after: Recording,
    *,
    names: tuple[str, str] = ("without compensation", "with compensation"),
) -> Picture:
    """Scans with and without compensation, and what a straight line leaves of each (Fig. 9).

    Below the scans each rate has a row of its own; where readings are many, a line is their median
    and the band holds 95 % of them. `names`: titles of the two columns.

    >>> import numpy as np
    >>> from rapi_jax import plot
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> truth = [np.asarray(predict(paper_device(), drive)) for drive in drives]
    >>> noise = np.random.default_rng(0).standard_normal(100)  # GHz
    >>> recording = Recording.of(drives, [y + 0.02 * noise for y in truth])
    >>> straight = Recording.of(drives, [18.0 * drive.value for drive in drives])
    >>> picture = plot.scans(recording, straight, names=("triangle", "compensated"))
    >>> len(picture.axes), picture.axes[0].get_title()
    (6, 'triangle')
    """
    count = max(len(shown_runs(one, 6)) for one in (before, after))
    sizes = (linearity(run).rms_ghz for one in (before, after) for run in one.runs[:count])
    scale = one_unit(itertools.chain.from_iterable(sizes), before.response_unit)
    heights = (2.0, *(1.0 for _ in range(count)))
    figure = Picture(figsize=(9.0, 2.8 + 1.5 * count), layout="constrained")
    axes = figure.subplots(1 + count, 2, sharex=True, squeeze=False, height_ratios=heights)
    for column, (recording, name) in enumerate(zip((before, after), names, strict=True)):
        top = axes[0, column]
        for spare in axes[1 + len(shown_runs(recording, 6)) :, column]:
            spare.set_visible(False)
        for i, run in enumerate(recording.runs[:count]):
            phase, colour = np.mod(run.drive.time * run.drive.rate, 1.0), PALETTE[i]
            order = np.argsort(phase)
            about = run.response - np.nanmean(run.response)  # fringes give no common origin
            top.plot(
                phase[order], about[order], lw=1, color=colour, label=rate_text(run.drive.rate)
            )
            _draw_nonlinearity(axes[1 + i, column], run, scale, colour)
        top.set_title(name, fontsize=11)
        axes[-1, column].set_xlabel("scan phase since the drive's minimum")
    axes[0, 0].set_ylabel(f"scan about its mean ({unit_text(before.response_unit)})")
    axes[0, 0].legend(framealpha=0.85, fontsize=8)
    return figure


def _draw_nonlinearity(axis: Any, run: Run, scale: tuple[str, float], colour: str) -> None:
    scan = linearity(run)
    fine, factor = scale
    for branch, begin in ((scan.up, scan.turning[0]), (scan.down, scan.turning[1])):
        at = np.mod(begin + branch.time * run.drive.rate, 1.0)
        draw_spread(axis, at, factor * branch.residual, colour)
    up, down = (in_unit(rms, scale) for rms in scan.rms_ghz)
    axis.set_title(f"{rate_text(run.drive.rate)}: {up} rms up, {down} down", fontsize=9)
    axis.set_ylabel(f"off a line ({fine})", fontsize=8)
    axis.axhline(0.0, lw=0.8, color="black")


def learning(courses: Sequence[tuple[str, Any]]) -> Picture:
    """Nonlinearity (rms) against iteration, both branches, for each (name, `Learned`).

    >>> from rapi_jax import DriveLimits, Run, learn, linear_scan, plot, triangle
    >>> (target,) = linear_scan(20.0, span=60.0, samples=512)
    >>> (start,) = triangle(20.0, amplitude=3.0, bias=3.0, samples=512)
    >>> limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    >>> bench = lambda drive: Run(drive, 20.0 * drive.value)
    >>> found = learn(bench, target, start, limits=limits, iterations=1)
    >>> picture = plot.learning([("20 Hz", found)])
    >>> len(picture.axes)
    1
    """
    figure = Picture(figsize=(6.8, 4.2), layout="constrained")
    axis = figure.subplots()
    for i, (name, course) in enumerate(courses):
        rms = 1e3 * np.asarray(course.rms_ghz)
        for column, (branch, style) in enumerate((("up", "o-"), ("down", "s--"))):
            axis.plot(
                rms[:, column],
                style,
                ms=4,
                color=PALETTE[i % len(PALETTE)],
                label=f"{name}, {branch}",
            )
    axis.set_yscale("log")
    axis.set_xlabel("iteration")
    axis.set_ylabel("rms nonlinearity (MHz)")
    axis.legend(framealpha=0.85, fontsize=8)
    return figure


def word_lengths(errors: Sequence[Any]) -> Picture:
    """Largest errors of drive and scan against word length, for each `WordLengthError`.

    >>> import numpy as np
    >>> from rapi_jax import StreamingCompensator, plot, word_length_errors
    >>> from rapi_jax.examples import paper_device
    >>> stream = StreamingCompensator.of(paper_device(), 10.0, within=(0.75, 5.25))
    >>> wanted = 50.0 + 10.0 * np.sin(np.linspace(0.0, 6.0, 50))  # GHz
    >>> picture = plot.word_lengths(word_length_errors(stream, wanted, bits=(16, 24)))
    >>> len(picture.axes)
    1
    """
    bits = np.array([e.bits for e in errors])
    figure = Picture(figsize=(6.8, 4.2), layout="constrained")
    axis = figure.subplots()
    axis.plot(bits, [e.response for e in errors], "o-", ms=4, color=UP, label="scan (GHz)")
    axis.plot(bits, [e.drive for e in errors], "s--", ms=4, color=DOWN, label="drive (V)")
    half = errors[0].response * 2.0 ** (bits[0] - bits)
    axis.plot(bits, half, ":", color=MEASURED, label="half as much a bit")
    axis.set_yscale("log")
    axis.set_xticks(bits[::2])
    axis.set_xlabel("word length (bits)")
    axis.set_ylabel("largest error")
    axis.legend(framealpha=0.85, fontsize=8)
    return figure
