"""The picture of a ranging result."""

from typing import Any

import numpy as np

from ._style import DOWN, MODEL, UP, Picture, unit_text


def ranging(found: Any) -> Picture:
    """Distances of scans over time with their errors, the track, and the scans' nonlinearity.

    `found`: a `Ranging`. Error bars and bands are standard errors. A velocity that changes little
    is drawn less its mean, which the title says.

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
        _draw_velocity(axes[1], track)
    top.set_title("distance of each scan, with its standard error", fontsize=10, loc="left")
    top.set_ylabel(f"distance less {1e3 * middle:.3f} mm ({unit})")
    handles, labels = top.get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, fontsize=8, ncols=3, loc="outside upper right")
    bottom.set_title("how crooked each scan was", fontsize=10, loc="left")
    bottom.set_ylabel("rms nonlinearity (MHz)")
    bottom.set_ylim(0.0, 1.1 * max(1e3 * float(np.nanmax(table.bend_ghz)), 1e-9))
    bottom.set_xlabel("session time (s)")
    return figure


def _draw_velocity(axis: Any, track: Any) -> None:
    mean = float(np.mean(track.velocity))
    error = float(np.max(track.velocity_stderr))
    spread = error + float(np.max(np.abs(track.velocity - mean)))
    name, less = "velocity of the track", 0.0
    if abs(mean) > 20.0 * spread:  # digits on the axis would not tell its values apart
        unit, factor = _fine_unit(np.array([mean]))
        digits = int(np.clip(np.ceil(-np.log10(max(factor * spread, 1e-9))), 0, 9))
        less = round(mean * factor, digits) / factor
        name += f", less {less * factor:.{digits}f} {unit}/s"
    unit, factor = _fine_unit(np.append(track.velocity - less, error))
    value = factor * (track.velocity - less)
    _band(axis, track.time_s, value, factor * track.velocity_stderr)
    axis.set_title(name, fontsize=10, loc="left")
    axis.set_ylabel(f"velocity ({unit}/s)")


def _fine_unit(metres: np.ndarray) -> tuple[str, float]:
    """The unit of lengths in which the largest reads best, and the factor from m."""
    most = float(np.max(np.abs(metres), initial=0.0))
    unit, factor = ("mm", 1e3) if most >= 1e-3 else ("um", 1e6) if most >= 1e-7 else ("nm", 1e9)
    return unit_text(unit), factor


def _band(axis: Any, time: np.ndarray, value: np.ndarray, stderr: np.ndarray) -> None:
    axis.fill_between(time, value - stderr, value + stderr, color=MODEL, alpha=0.2, lw=0)
    axis.plot(time, value, "-", lw=1, color=MODEL, label="track")
