"""`rapi predict`: a model's response to the drive of a recording."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from fitting.commands.shared._plugins import Plugins

LIST, PICTURE = "prediction.json", "predictions.png"


def predict(
    model: Path,
    recording: Path,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    nan: Literal["raise", "mask"] = "raise",
    plugin: Plugins = (),
    plots: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Predict the response of MODEL to the drives of RECORDING, and compare.

    RECORDING may also be one drive without a response: a CSV file with the columns `time_s,drive`
    that holds one period, as `rapi compensate` writes it.

    Writes `<run>.csv` with the columns `time_s,drive,response,predicted` for each run, and
    `prediction.json`. The origin of the response is the model's; where the recording gives every
    run its own, it is taken from the run's mean.

    Parameters
    ----------
    model
        A folder that `rapi fit` wrote, or the `model.rapi` in it.
    recording
        A folder with a `manifest.toml`, a netCDF-4 file, or a drive as CSV.
    output
        Folder for the results; made if missing.
    nan
        What to do with readings that are not finite: refuse, or leave those samples out.
    plugin
        A Python file with effects or an operator of your own, which MODEL names; its code is run.
        May be given several times.
    plots
        Write a picture.
    json
        Print the errors of each run as JSON on standard output.
    """
    options = dict(locals())
    from fitting._json import json_text, replace_nonfinite
    from fitting._result_files import begin_result, check_output, list_files
    from fitting.commands.shared._model import load_model
    from fitting.commands.shared._out import console, output_folder, print_json
    from fitting.commands.shared._plugins import plugin_effects, plugin_operators
    from fitting.commands.shared._progress import progress
    from fitting.commands.shared.files._provenance import provenance
    from rapi_jax.io import write_atomic

    ecdl, about = load_model(model, plugin_effects(plugin), plugin_operators(plugin))
    data = _read(recording, about, nan)
    names = [f"{run.name}.csv" for run in data.runs] + [PICTURE] * plots
    check_output(output, LIST, names)
    with progress("predicting", json):
        rows, series = _predict_runs(ecdl, about, data)
    folder = output_folder(output)
    earlier = begin_result(folder, LIST, names)
    written = _write_predictions(folder, data, series, plots)
    report = {
        "schema": "rapi.prediction/1",
        "unit": data.response_unit,
        "runs": rows,
        "files": [path.name for path in written],
        "data_sha256": data.sha256(),
        "provenance": provenance("rapi predict", options, ("model", "recording")),
    }
    listed = report | list_files(written, earlier)
    write_atomic(folder / LIST, json_text(replace_nonfinite(listed)))
    if json:
        print_json(report)
        return 0
    out = console(json)
    out.print(_table(rows, data.response_unit, series))
    files = ", ".join([*(path.name for path in written), LIST])
    out.print(f"written to {folder}: {files}", markup=False)
    return 0


def _read(path: Path, about: dict[str, Any], nan: Any) -> Any:
    """The recording at `path`, or the drive there as one of which nothing was measured."""
    import numpy as np

    from rapi_jax import Recording, Run
    from rapi_jax.io import read_drive, read_recording

    if path.suffix.lower() != ".csv" or not path.is_file():
        return read_recording(path, nan=nan)
    drive = read_drive(path)
    run = Run(drive, np.full(drive.size, np.nan), path.stem)
    units = {kind: about[kind] for kind in ("response_unit", "drive_unit")}
    return Recording((run,), **units)


def _predict_runs(
    ecdl: Any, about: dict[str, Any], data: Any
) -> tuple[list[dict[str, Any]], list[Any]]:
    import numpy as np

    from rapi_jax import ModelError
    from rapi_jax import predict as respond
    from rapi_jax.internal import usable

    for kind in ("response_unit", "drive_unit"):
        if about[kind] != getattr(data, kind):
            raise ModelError(
                f"the model's {kind} is {about[kind]}, the recording's {getattr(data, kind)}. Use "
                "a model identified in the same unit."
            )
    rows, series = [], []
    for run in data.runs:
        response = np.asarray(respond(ecdl, run.drive.delayed(data.response_lag_s)))
        use = usable(run, data.response_lag_s)
        if not use.any():
            use = run.valid
        if not use.any():  # a drive alone
            rows.append(_describe_drive(run, data.response_unit))
            series.append(response)
            continue
        error = (response - run.response)[use]
        if data.response_origin == "run":
            response = response - error.mean()
            error = error - error.mean()
        span = float(np.ptp(run.response[use]))
        rmse = float(np.sqrt(np.mean(error**2)))
        rows.append(
            {
                "run": run.name,
                "excitation_hz": run.drive.excitation_hz,
                "samples": int(use.sum()),
                "rmse": rmse,
                "std": float(np.std(error)),
                "unit": data.response_unit,
                "span": span,
                "rmse_fraction": rmse / span if span > 0 else None,
            }
        )
        series.append(response)
    return rows, series


def _describe_drive(run: Any, unit: str) -> dict[str, Any]:
    """The row of a run of which nothing was measured."""
    none = dict.fromkeys(("rmse", "std", "span", "rmse_fraction"))
    rate = run.drive.excitation_hz
    return {"run": run.name, "excitation_hz": rate, "samples": 0, "unit": unit} | none


def _write_predictions(folder: Path, data: Any, series: list[Any], plots: bool) -> list[Path]:
    import io

    import numpy as np

    from fitting.report import save_figure
    from rapi_jax.io import write_atomic

    written = []
    for run, response in zip(data.runs, series, strict=True):
        text = io.StringIO()
        columns = np.column_stack([run.drive.time, run.drive.value, run.response, response])
        header = "time_s,drive,response,predicted"
        np.savetxt(text, columns, "%.17g", ",", header=header, comments="")
        path = folder / f"{run.name}.csv"
        write_atomic(path, text.getvalue())
        written.append(path)
    if plots:
        from rapi_jax import plot

        written.append(save_figure(plot.predictions(data, series), folder / PICTURE))
    return written


def _table(rows: list[dict[str, Any]], unit: str, series: list[Any]) -> Any:
    from rich.markup import escape
    from rich.table import Table

    from fitting._units import readable_unit

    if all(row["rmse"] is None for row in rows):
        return _list_predicted(rows, unit, series)
    unit, factor = readable_unit(unit, (row["rmse"] for row in rows if row["rmse"] is not None))
    table = Table(title="Prediction against measurement", title_justify="left")
    for name in ("run", "rate (Hz)", f"rmse ({unit})", f"std ({unit})", "% of span"):
        table.add_column(name, justify="left" if name == "run" else "right")
    for row in rows:
        rate = row["excitation_hz"]
        share = row["rmse_fraction"]
        table.add_row(
            escape(row["run"]),
            "-" if rate is None else f"{rate:g}",
            "-" if row["rmse"] is None else f"{factor * row['rmse']:.4g}",
            "-" if row["std"] is None else f"{factor * row['std']:.4g}",
            "-" if share is None else f"{100 * share:.3g}",
        )
    return table


def _list_predicted(rows: list[dict[str, Any]], unit: str, series: list[Any]) -> Any:
    """What is predicted of drives of which nothing was measured."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title="Predicted response; nothing was measured", title_justify="left")
    for name in ("run", "rate (Hz)", f"from ({unit})", f"to ({unit})", f"span ({unit})"):
        table.add_column(name, justify="left" if name == "run" else "right")
    for row, response in zip(rows, series, strict=True):
        rate, low, high = row["excitation_hz"], float(response.min()), float(response.max())
        cells = (f"{x:.4g}" for x in (low, high, high - low))
        table.add_row(escape(row["run"]), "-" if rate is None else f"{rate:g}", *cells)
    return table
