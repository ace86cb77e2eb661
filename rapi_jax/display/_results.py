"""Models, certificates, compensations, readouts, rangings and budgets as summaries and tables."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._readable_unit import readable_unit
from ._summary import Summary, significant


def summarise_model(ecdl: Any, parameters: Sequence[Any]) -> Summary:
    """The operator, the effects and every parameter of an `ECDL`."""
    names = [type(effect).__name__ for effect in ecdl.effects]
    rows = []
    for one in parameters:
        value: Any = ecdl
        for step in one.path:
            value = value[step] if isinstance(step, int) else getattr(value, step)
        unit = one.unit.replace("{x}", "response").replace("{u}", "drive")
        for name, number in zip(one.names(), np.ravel(value), strict=True):
            rows.append((name, significant(float(number), 6), "" if unit == "1" else unit))
    operator = type(ecdl.operator).__name__
    effects = f" and {', '.join(names)}" if names else ", without effects"
    title = f"{operator} with {ecdl.operator.count} plays{effects}"
    return Summary(title, (), ("parameter", "value", "unit"), rows)


def summarise_certificate(found: Any, unit: str = "") -> Summary:
    """Whether the model can be inverted, with the smallest slope and where it is met.

    `unit`: of the drive, where it is known.
    """
    drive = f" {unit}" if unit else ""
    between = f"between {found.low:.4g} and {found.high:.4g}{drive} at {found.freq:g} Hz"
    word = "can" if found.invertible else "cannot"
    facts = [
        ("smallest slope", f"{found.slope_min:.4g} (response units per drive unit)"),
        ("met at a drive of", f"{found.slope_at:.4g}{drive}, on the way {found.slope_direction}"),
        ("swing in the thresholds", f"{significant(found.u_pp)}{drive}"),
    ]
    rows = [
        (f"{one.low:.4g} to {one.high:.4g}", one.direction, significant(one.slope))
        for one in found.failures
    ]
    heads = ("not monotone over (drive)", "on the way", "slope")
    title = f"The model {word} be inverted {between}"
    return Summary(title, facts, heads, rows, found.reasons)


def summarise_compensation(made: Any) -> Summary:
    """The drive that was made, and what was proved of the model."""
    about, unit = made.to_dict(), made.drive_unit
    facts = [
        ("drive", f"{about['drive_min']:.4g} to {about['drive_max']:.4g} {unit}"),
        ("steepest slope", f"{about['slew_max']:.4g} {unit}/s"),
        ("inverse", made.inverse),
        ("certificate", summarise_certificate(made.certificate, unit).title),
    ]
    title = (
        f"Drive for a scan of {made.target.span:.4g} {made.target.unit} at {made.drive.rate:g} Hz"
    )
    return Summary(title, facts, notes=made.notes)


def compensation_dataset(made: Any) -> Any:
    """Drive, scan asked for and the model's answer over one period's time (s)."""
    import xarray as xr

    response = {"units": made.target.unit}
    values = {
        "drive": ("time_s", made.drive.value, {"units": made.drive_unit}),
        "target": ("time_s", made.target.value, response),
    }
    if made.predicted is not None:
        values["predicted"] = ("time_s", made.predicted, response)
    return xr.Dataset(
        values,
        {"time_s": ("time_s", made.drive.time, {"units": "s"})},
        {"excitation_hz": made.drive.rate, "inverse": made.inverse},
    )


def summarise_readout(found: Any) -> Summary:
    """The frequency that was read from fringes: length, error, turns, peaks, faults."""
    error = float(np.nanmedian(found.stderr))
    unit, factor = readable_unit("GHz", (error,))
    delay = f"{1e9 * found.delay_s:.6g} ns"
    if np.isfinite(found.delay_stderr_s):
        delay += f" ± {1e9 * found.delay_stderr_s:.2g} ns"
    facts = [
        ("span", f"{np.ptp(found.frequency):.4g} GHz"),
        ("standard error of a value", f"{factor * error:.2g} {unit} (median)"),
        ("turns of the laser", str(len(found.turns))),
        ("cavity peaks", str(found.peaks.size)),
        ("delay of the interferometer", delay),
    ]
    title = f"Optical frequency at {found.time.size} times, read from fringes"
    return Summary(title, facts, notes=found.faults)


def readout_dataset(found: Any) -> Any:
    """Frequency and its standard error (GHz) over time (s)."""
    import xarray as xr

    unit = {"units": "GHz"}
    values = {"frequency": ("time_s", found.frequency, unit)}
    values["stderr"] = ("time_s", found.stderr, unit)
    return xr.Dataset(values, {"time_s": ("time_s", found.time, {"units": "s"})})


def summarise_ranging(found: Any) -> Summary:
    """The distance over all scans, and what was said of the records."""
    total = found.summary
    title = "No scan gave a distance"
    if total.counted:
        title = f"Distance {total.distance:.7g} m ± {1e6 * total.stderr:.2g} um"
    facts = [
        ("scans with a distance", f"{total.counted} of {found.table.size}"),
        ("method", found.method),
        ("index of air", f"{found.air_index.value:.9g}"),
    ]
    return Summary(title, facts, notes=tuple(found.faults))


def ranging_dataframe(found: Any) -> Any:
    """A row for each scan: time (s), direction, distance and standard error (m)."""
    import pandas as pd

    return pd.DataFrame(
        {
            "time_s": found.table.time_s,
            "direction": np.where(found.table.rising, "up", "down"),
            "distance_m": found.distance,
            "stderr_m": found.stderr,
        }
    )


def summarise_budget(lines: Sequence[Any]) -> Summary:
    """Each source's standard error of one scan's distance, the largest first."""
    ranked = sorted(lines, key=lambda line: -line.stderr)
    whole = float(np.sqrt(sum(line.stderr**2 for line in lines)))
    unit, factor = readable_unit("m", (whole,))
    rows = [(line.source, significant(factor * line.stderr, 3), line.note) for line in ranked]
    title = f"Standard error of a distance: {factor * whole:.3g} {unit}, all sources together"
    return Summary(title, (), ("source", f"stderr ({unit})", "note"), rows)
