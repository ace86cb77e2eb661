"""`rapi diagnose`: where a model departs from a device, and which effect it lacks."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from fitting.commands.shared._plugins import Plugins


def diagnose(
    recording: Path,
    *recordings: Path,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    model: Path | None = None,
    limits: Path | None = None,
    plugin: Plugins = (),
    scan: bool = True,
    nan: Literal["raise", "mask"] = "raise",
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Diagnose the gap between a model and RECORDING: where it lies, which effect causes it.

    Writes `diagnosis.json`, `report.html` and `model.rapi`, the model with the effect named. With
    several recordings each has a folder of its own name in the output folder.

    Parameters
    ----------
    recording
        A folder with a `manifest.toml`, or a netCDF-4 file.
    recordings
        More of them; what is compiled for the first serves the others.
    output
        Folder for the results; made if missing.
    model
        A folder that `rapi fit` or `rapi diagnose` wrote, or the `model.rapi` in it. Without one a
        model is identified first, and nothing of the gap is a wrong parameter's.
    limits
        A file with the drive's limits, for the next scan; by default the range and slew recorded.
    plugin
        A Python file with effects of your own: further candidates, and those that the model may
        name. Its code is run. May be given several times.
    scan
        Look for the scan that would best separate the hypotheses still tied.
    nan
        What to do with readings that are not finite: refuse, or leave those samples out.
    json
        Print `diagnosis.json` on standard output (a list with several recordings).
    """
    from fitting.batch.jobs._find import name_jobs
    from fitting.commands.shared._model import load_model
    from fitting.commands.shared._out import console, output_folder, print_json, progress, read_json
    from fitting.commands.shared._plugins import plugin_effects, plugin_operators
    from rapi_jax import effects
    from rapi_jax.io import read_limits, read_recording

    several = [recording, *recordings]
    bounds = None if limits is None else read_limits(limits)
    own = plugin_effects(plugin)
    ecdl, about = (
        (None, None) if model is None else load_model(model, own, plugin_operators(plugin))
    )
    candidates = (*effects.ALL, *own)
    read = [read_recording(path, nan=nan) for path in several]  # all, before the first is judged
    for data in read:
        check_model_units(about, data)
    folder = output_folder(output)
    reports: list[dict[str, Any]] = []
    out = console(json)
    for name, data in zip(name_jobs(several), read, strict=True):
        place = output_folder(folder / name) if recordings else folder
        with progress(f"diagnosing {name}" if recordings else "diagnosing", json) as say:
            written = diagnose_into(
                data,
                place,
                name,
                ecdl=ecdl,
                candidates=candidates,
                limits=bounds,
                scan=scan,
                report_step=say,
            )
        reports.append(read_json(written[0]))
        if not json:
            from fitting.report.diagnosis._terminal import render_lines

            if recordings:
                out.rule(name)
            out.print(render_lines(reports[-1]))
            out.print(f"written to {place}: {', '.join(p.name for p in written)}", markup=False)
    if json:
        print_json(reports if recordings else reports[0])
    return 0


def diagnose_into(
    data: Any,
    folder: Path,
    name: str,
    *,
    ecdl: Any,
    candidates: Sequence[Any],
    limits: Any,
    scan: bool,
    report_step: Callable[[str], None] | None = None,
) -> list[Path]:
    """Diagnose a recording, called `name`, by the options of the command; its files in `folder`."""
    from fitting.diagnosis import diagnose as run

    report = run(ecdl, data, candidates=candidates, limits=limits, scan=scan, progress=report_step)
    return report.save(folder, name=name)


def check_model_units(about: dict[str, Any] | None, data: Any) -> None:
    """Refuse a model, described by `about`, whose units are not those of the recording."""
    from fitting.diagnosis._data_checks import check_units

    if about is not None:
        check_units(about, data)
