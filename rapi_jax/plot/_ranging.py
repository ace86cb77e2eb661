"""The picture of a ranging result."""

from typing import Any

import numpy as np

from ._style import DOWN, MODEL, UP, Picture


def ranging(found: Any) -> Picture:
    """Distances of scans over time with their errors, the track, and the scans' nonlinearity.

    `found`: a `Ranging`. Error bars and bands are standard errors.

    >>> import numpy as np
    >>> from rapi_jax import plot
    >>> from rapi_jax.ranging import FringeRecord, FringeRecords, range_records
    >>> light, rate, path = 299792458.0, 1e6, 7.34  # m/s, Hz, m
    >>> time = np.arange(30000) / rate
    >>> phase = np.mod(time * 50.0, 1.0)
    >>> hertz = 75e9 * np.where(phase < 0.5, 2 * phase, 2 - 2 * phase)
    >>> fringe = lambda metres: np.cos(2 * np.pi * (hertz + 3.84e14) * metres / light)
    >>> record = FringeRecord(fringe(2 * 0.7), fringe(path), rising_at_start=True)
    >>> records = FringeRecords((record,), rate, 50.0, path)
    >>> found = range_records(records)
    >>> picture = plot.ranging(found)
    >>> len(picture.axes)
    2
    """
    track, table = found.target.track, found.table
    figure = Picture(figsize=(9.0, 7.6 if track is not None else 5.4), layout="constrained")
    axes = figure.subplots(3 if track is not None else 2, 1, sharex=True)
    top, bottom = axes[0], axes[-1]
    good = np.flatnonzero(np.isfinite(found.distance))
    middle = round(float(np.mean(found.distance[good])), 6) if good.size else 0.0
    unit, factor = _fine_unit(found.distance[good] - middle)
    thin = max(1, table.size // 4000)
    for rising, colour, name in ((True, UP, "up-scans"), (False, DOWN, "down-scans")):
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


def _fine_unit(metres: np.ndarray) -> tuple[str, float]:
    """The unit of lengths in which the largest reads best, and the factor from m."""
    most = float(np.max(np.abs(metres), initial=0.0))
    return ("mm", 1e3) if most >= 1e-3 else ("um", 1e6) if most >= 1e-7 else ("nm", 1e9)


def _band(axis: Any, time: np.ndarray, value: np.ndarray, stderr: np.ndarray) -> None:
    axis.fill_between(time, value - stderr, value + stderr, color=MODEL, alpha=0.2, lw=0)
    axis.plot(time, value, "-", lw=1, color=MODEL, label="track")
