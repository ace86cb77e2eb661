"""A recording as a summary, as a table and as labelled arrays."""

from typing import Any

import numpy as np

from ._readable_unit import quantity
from ._summary import Summary, significant


def summarise_recording(recording: Any) -> Summary:
    """Runs, rates, swings and spans of a `Recording`."""
    count, unit = len(recording.runs), recording.response_unit
    rows = [
        (
            run.name,
            run.drive.waveform,
            significant(run.drive.excitation_hz) if run.drive.excitation_hz else "-",
            str(run.drive.periods),
            str(run.drive.size),
            significant(1.0 / run.drive.step_s, 6),
            significant(run.drive.u_pp),
            quantity(run.span, unit) if run.valid.any() else "no response",
            str(int((~run.valid).sum())),
        )
        for run in recording.runs
    ]
    facts = [("response", unit), ("drive", recording.drive_unit)]
    facts.append(("zero of the response", f"one for each {recording.response_origin}"))
    if recording.response_lag_s:
        facts.append(("known latency", f"{significant(1e6 * recording.response_lag_s)} us"))
    if recording.recorded_at is not None:
        facts.append(("recorded at", recording.recorded_at.isoformat()))
    if recording.temperature_c is not None:
        facts.append(("temperature", f"{significant(recording.temperature_c)} deg C"))
    heads = (
        "run", "waveform", "rate (Hz)", "periods", "samples", "sampling (Hz)",
        f"swing ({recording.drive_unit})", "span", "masked",
    )  # fmt: skip
    return Summary(f"Recording of {count} run{'' if count == 1 else 's'}", facts, heads, rows)


def recording_dataframe(recording: Any) -> Any:
    """A row for each sample: run, time (s), session time (s), drive, response."""
    import pandas as pd

    frames = [
        pd.DataFrame(
            {
                "run": run.name,
                "excitation_hz": run.drive.rate,
                "time_s": run.drive.time,
                "session_s": run.drive.session_time,
                "drive": run.drive.value,
                "response": run.response,
            }
        )
        for run in recording.runs
    ]
    return pd.concat(frames, ignore_index=True)


def recording_dataset(recording: Any, **columns: Any) -> Any:
    """Labelled arrays over run and sample, NaN where a run is shorter than the longest.

    `columns`: further values for each run, by name, in the response's unit; `used` has none.
    """
    import xarray as xr

    runs = recording.runs
    longest = max(run.drive.size for run in runs)

    def padded(values: Any) -> np.ndarray:
        out = np.full((len(runs), longest), np.nan)
        for row, value in zip(out, values, strict=True):
            row[: len(value)] = value
        return out

    unit, drive_unit = {"units": recording.response_unit}, {"units": recording.drive_unit}
    shape = ("run", "sample")
    more = {
        name: (shape, padded(value), {} if name == "used" else unit)
        for name, value in columns.items()
    }
    return xr.Dataset(
        {
            "drive": (
                shape,
                padded([r.drive.value for r in runs]),
                drive_unit,
            ),
            "response": (shape, padded([r.response for r in runs]), unit),
            **more,
        },
        {
            "run": [run.name for run in runs],
            "excitation_hz": ("run", [run.drive.rate for run in runs], {"units": "Hz"}),
            "start_s": ("run", [run.drive.start_s for run in runs], {"units": "s"}),
            "time_s": (shape, padded([run.drive.time for run in runs]), {"units": "s"}),
        },
        dict(recording.provenance),
    )
