"""The picture of a population of fits."""

from typing import Any

import numpy as np

from ..display._typeset import MINUS
from ._style import DOWN, MODEL, UP, Picture, grid, unit_text

DRIFT_P = 0.05  # of all parameters together, as in the table of the summary
MONTH_DAYS = 30


def population(found: Any, change: Any = None) -> Picture:
    """Each parameter of a `Population` over time at the mean temperature, with its 95 % bands.

    The inner band is of the expectation, the outer one of recordings without errors of their own.
    Where time is no covariate, recordings stand in their order. `change`: of a new recording.

    >>> from fitting import fit_population
    >>> from rapi_jax import plot
    >>> picture = plot.population(fit_population(results))  # doctest: +SKIP
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
    days = np.linspace(*ends, 200)
    curve = [found.expectation(days=float(day) if timed else None) for day in days]
    figure, axes = grid(len(found.parameters), 2.4)
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
            axis.fill_between(days, low, high, color=MODEL, alpha=alpha, lw=0)
        axis.plot(days, middle, "-", lw=1, color=MODEL, label="population")
        for part, colour, name in ((~outlier, UP, "recordings"), (outlier, "black", "outliers")):
            if part.any():
                style = "o" if colour == UP else "x"
                axis.errorbar(
                    place[part], value[part], error[part], fmt=style, ms=3, lw=0.8, color=colour,
                    label=name,
                )  # fmt: skip
        if change is not None:
            one = change.parameters[j]
            measured = one.measured - (one.expected - one.expected_at_mean)
            colour = DOWN if change.changed and one.name in change.set else "black"
            axis.errorbar([new], [measured], [one.stderr], fmt="D", ms=5, color=colour, label="new")
        axis.set_title(_words(parameter), fontsize=10)
        unit = "" if parameter.unit == "1" else f" ({unit_text(parameter.unit)})"
        axis.set_ylabel(f"{parameter.name}{unit}")
        axis.set_xlabel("days since the first" if timed else "recording")
    axes[0].legend(framealpha=0.85, fontsize=7)
    return figure


def _words(parameter: Any) -> str:
    """What a panel shows: the drift of its parameter, where it is known from zero."""
    drift = parameter.time
    if drift is None:
        return parameter.name
    if parameter.smooth:
        return f"{parameter.name} changes, not along a line"
    if not drift.p_holm < DRIFT_P:
        return f"{parameter.name}: no drift seen"
    month, unit = MONTH_DAYS * drift.value, unit_text(parameter.unit.removesuffix("1"))
    if abs(parameter.mean.value) > 3.0 * parameter.mean.stderr:
        month, unit = 100.0 * month / abs(parameter.mean.value), "%"
    change = f"{month:+.2g}".replace("-", MINUS)
    return f"{parameter.name} drifts by {change} {unit} in {MONTH_DAYS} days"
