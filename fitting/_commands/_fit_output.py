"""The files of a fit."""

from pathlib import Path

from fitting._result import FitResult, versions
from rapi_jax import Recording
from rapi_jax.io import write_atomic, write_model

from ._out import json_text, save_figure

MODEL, TABLE = "model.rapi", "model.json"


def identified_range(recording: Recording) -> dict[str, object]:
    """What the model has seen: drive range, slew, rates, amplitudes. Beyond it, it extrapolates."""
    import numpy as np

    drives = recording.drives
    slopes = [np.abs(np.diff(d.value)).max() / d.step_s for d in drives]
    return {
        "drive_min": min(float(d.value.min()) for d in drives),
        "drive_max": max(float(d.value.max()) for d in drives),
        "slew_max": float(max(slopes)),
        "rates_hz": [rate for rate in recording.rates if rate > 0],
        "amplitudes": recording.amplitudes,
    }


def write_fit(result: FitResult, folder: Path, *, plots: bool) -> list[Path]:
    """Write `model.json`, the loadable model and the pictures; return their paths."""
    recording = result.recording
    write_model(
        folder / MODEL,
        result.ecdl,
        response_unit=recording.response_unit,
        drive_unit=recording.drive_unit,
        response_origin=recording.response_origin,
        response_lag_s=recording.response_lag_s,
        trusted=result.verdict.trusted,
        identified=identified_range(recording),
        rmse=result.rmse,
        versions=versions(),
        data_sha256=recording.sha256(),
    )
    write_atomic(folder / TABLE, json_text(result.to_dict()))
    written = [folder / TABLE, folder / MODEL]
    if plots:
        from rapi_jax import plot

        traces = [(start.origin, start.trace, start.agrees) for start in result.starts]
        pictures = {
            "loops.png": plot.loops(recording, result.predicted),
            "residuals.png": plot.residuals(recording, result.predicted, result.used),
            "starts.png": plot.convergence(traces),
        }
        written += [save_figure(figure, folder / name) for name, figure in pictures.items()]
    return written
