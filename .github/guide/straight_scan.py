"""Draw the picture of the README: one scan of the simulated laser before and after compensation.

Run `python .github/guide/straight_scan.py` in the root of the repository; it takes a minute.
"""

from pathlib import Path

import numpy as np

from fitting import identify
from hardware import SimulatedBench
from rapi_jax import Identified, Run, compensate, linear_scan, linearity
from rapi_jax.examples import paper_drives
from rapi_jax.plot import Picture, svg

RATE, SPAN = 20.0, 75.0  # Hz, GHz
BEFORE, AFTER = "#d55e00", "#0072b2"
POINTS = 400  # of a curve
HERE = Path(__file__).parent


def main() -> None:
    """Measure, identify, compensate, measure again, and draw."""
    bench = SimulatedBench.like_paper(seed=0)
    training = bench.measure(paper_drives())
    result = identify(training)
    (target,) = linear_scan(RATE, span=SPAN)
    made = compensate(result.ecdl, target, identified=Identified.of(training))
    before = next(run for run in training.runs if run.drive.rate == RATE)
    after = bench.measure(made.drive).runs[0]
    figure = Picture(figsize=(8.0, 4.6), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True)
    _draw(axes[:, 0], before, BEFORE, "triangle as the drive", 1.0, "GHz")
    _draw(axes[:, 1], after, AFTER, "drive made by rapi", 1e3, "MHz")
    axes[0, 0].set_ylabel("optical frequency\nabout its mean (GHz)")
    (HERE / "straight_scan.svg").write_bytes(svg(figure))


def _draw(axes: np.ndarray, run: Run, colour: str, name: str, factor: float, unit: str) -> None:
    scan = linearity(run)
    top, bottom = axes
    phase = np.mod(run.drive.time * run.drive.rate, 1.0)
    order = np.argsort(phase)
    thin = slice(None, None, max(1, phase.size // POINTS))
    about = run.response - np.nanmean(run.response)
    top.plot(phase[order][thin], about[order][thin], color=colour)
    top.set_title(name, fontsize=11)
    for branch, begin in ((scan.up, scan.turning[0]), (scan.down, scan.turning[1])):
        at = np.mod(begin + branch.time * run.drive.rate, 1.0)
        along = np.argsort(at)
        step = max(1, at.size // POINTS)
        bottom.plot(at[along][::step], factor * branch.residual[along][::step], color=colour, lw=1)
    bottom.axhline(0.0, lw=0.8, color="black")
    up, down = (factor * rms for rms in scan.rms_ghz)
    bottom.set_title(f"{up:.2g} {unit} rms up, {down:.2g} {unit} down", fontsize=10)
    bottom.set_ylabel(f"off a straight line ({unit})")
    bottom.set_xlabel("part of the period")


if __name__ == "__main__":
    main()
