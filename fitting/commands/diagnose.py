"""`rapi diagnose`: where a model departs from a device, and which effect it lacks."""

import dataclasses
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import CycloptsError, Parameter

from fitting.commands.shared._plugins import Plugins


def diagnose(
    recording: Path,
    *recordings: Path,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    model: Path | None = None,
    limits: Path | None = None,
    plugin: Plugins = (),
    scan: bool = True,
    compare: Annotated[bool, Parameter(negative="")] = False,
    effects: Annotated[bool, Parameter(negative="")] = False,
    nan: Literal["raise", "mask"] = "raise",
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Diagnose the gap between a model and RECORDING: where it lies, which effect causes it.

    Writes `diagnosis.json`, `report.html` and `model.rapi`, the model with the effect named. With
    several recordings each has a folder of its own name in the output folder. `--compare BEFORE
    AFTER` tells instead what changed between two recordings of one device, with intervals, and
    writes `comparison.json` and `report.html`.

    Parameters
    ----------
    recording
        A folder with a `manifest.toml`, or a netCDF-4 file.
    recordings
        More recordings; code compiled for the first is reused for them.
    output
        Folder for the results; made if missing.
    model
        A folder that `rapi fit` or `rapi diagnose` wrote, or the `model.rapi` in it. Without one a
        model is identified first, so that no part of the gap comes from wrong parameters. One that
        was not to be trusted is used, and a note says so.
    limits
        A file with the drive's limits, for the next scan; by default the range and slew recorded.
    plugin
        A Python file with effects of your own (further candidates, and those that the model may
        name), or with an operator that it names. Its code is run. May be given several times.
    scan
        Look for the next scan, which would best separate the hypotheses that remain.
    compare
        Compare two recordings, the earlier first: which parameters changed, and by how much.
    effects
        With `--compare`: diagnose each as well, and add the effects named in either to the model.
    nan
        What to do with readings that are not finite: refuse, or leave those samples out.
    json
        Print `diagnosis.json` on standard output (a list with several recordings), or
        `comparison.json`.
    """
    options = dict(locals())
    several = [recording, *recordings]
    _check_options(len(several), compare, effects)
    from fitting._result_files import check_output
    from fitting.batch.jobs._find import name_jobs
    from fitting.commands.run import BAD_DATA, DONE, failing_alone
    from fitting.commands.shared._about import THRESHOLDS, describe_recording, estimate_seconds
    from fitting.commands.shared._limits import check_limits_unit
    from fitting.commands.shared._model import describe_distrust, load_model
    from fitting.commands.shared._out import (
        check_output_folder,
        console,
        output_folder,
        output_kept_if_written,
        print_json,
        read_json,
    )
    from fitting.commands.shared._plugins import plugin_effects, plugin_operators
    from fitting.commands.shared._progress import progress
    from fitting.commands.shared.files._provenance import provenance
    from rapi_jax.effects import ALL
    from rapi_jax.io import read_limits, read_recording

    bounds = None if limits is None else read_limits(limits)
    own = plugin_effects(plugin)
    ecdl, about = (
        (None, None) if model is None else load_model(model, own, plugin_operators(plugin))
    )
    candidates = (*ALL, *own)
    read = [read_recording(path, nan=nan) for path in several]  # all, before the first is judged
    for data in read:
        check_model_units(about, data)
        check_limits_unit(bounds, limits, data.drive_unit)
    names = name_jobs(several)
    more = {"provenance": provenance("rapi diagnose", options, ("recording", "recordings"))}
    if compare:
        check_output(output, "comparison.json", ["report.html"])
        folder = output_folder(output)
        return _compare_into(read, folder, names, ecdl, candidates, effects, json, more)
    places = [output / name if recordings else output for name in names]
    for place in places:
        check_output(place, "diagnosis.json", ["model.rapi", "report.html"])
    check_output_folder(output)
    failed: list[str] = []
    reports: list[dict[str, Any]] = []
    out = console(json)
    for path, name, place, data in zip(several, names, places, read, strict=True):
        seconds = estimate_seconds(data, "diagnose")
        begun = describe_recording(data, seconds, THRESHOLDS.diagnose_longest * seconds)
        label = f"diagnosing {name}" if recordings else "diagnosing"
        with (
            failing_alone(name, failed, alone=not recordings),
            progress(label, json, about=begun, expected_s=seconds) as say,
            output_kept_if_written(place),
        ):
            written = diagnose_into(
                data,
                place,
                name,
                ecdl=ecdl,
                candidates=candidates,
                limits=bounds,
                scan=scan,
                report_step=say,
                notes=describe_distrust(about),
                more=more,
            )
        if failed[-1:] == [name]:
            continue
        reports.append(read_json(written[0]))
        if not json:
            from fitting.diagnosis._text import effect_labels
            from fitting.report.diagnosis._terminal import render_lines

            if recordings:
                out.rule(name)
            shown = _naming(reports[-1], path)
            out.print(render_lines(shown, effect_labels(candidates, data.response_unit)))
            out.print(f"written to {place}: {', '.join(p.name for p in written)}", markup=False)
    if json:
        print_json(reports if recordings else reports[0])
    return BAD_DATA if failed else DONE


def _naming(report: dict[str, Any], path: Path) -> dict[str, Any]:
    """The report with the recording in the place of RECORDING in the commands of its notes."""
    named = f"rapi fit {shlex.quote(str(path))} "
    notes = [note.replace("rapi fit RECORDING ", named) for note in report.get("notes", [])]
    return report | {"notes": notes}


def _check_options(count: int, compare: bool, effects: bool) -> None:
    """Refuse options that do not go together, before anything is read."""
    if compare and count != 2:
        raise _usage(f"--compare takes two recordings, BEFORE and AFTER, not {count}.")
    if effects and not compare:
        raise _usage("--effects needs --compare: without --compare effects are always looked for.")


def _usage(message: str) -> CycloptsError:
    return CycloptsError(msg=message, command_chain=("diagnose",))


def _compare_into(
    pair: Sequence[Any],
    folder: Path,
    names: Sequence[str],
    ecdl: Any,
    candidates: Sequence[Any],
    effects: bool,
    json: bool,
    more: Mapping[str, Any],
) -> int:
    """What changed between two recordings, called `names`; its files in `folder`."""
    from fitting.commands.shared._out import console, print_json, read_json
    from fitting.commands.shared._progress import progress
    from fitting.comparison import compare

    with progress("comparing", json) as say:
        found = compare(
            pair[0], pair[1], ecdl=ecdl, effects=effects, candidates=candidates, progress=say
        )
        written = found.save(folder, names=(names[0], names[1]), more=more)
    if json:
        print_json(read_json(written[0]))
        return 0
    from fitting.report.comparison._terminal import render_lines

    out = console(json)
    out.print(render_lines(read_json(written[0])))
    out.print(f"written to {folder}: {', '.join(p.name for p in written)}", markup=False)
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
    notes: Sequence[str] = (),
    more: Mapping[str, Any] | None = None,
) -> list[Path]:
    """Diagnose a recording, called `name`, by the options of the command; its files in `folder`.

    `notes`: further ones, before those of the diagnosis. `more`: further keys of `diagnosis.json`.
    """
    from fitting.diagnosis import diagnose as run

    report = run(ecdl, data, candidates=candidates, limits=limits, scan=scan, progress=report_step)
    report = dataclasses.replace(report, notes=(*notes, *report.notes))
    return report.save(folder, name=name, more=more)


def check_model_units(about: dict[str, Any] | None, data: Any) -> None:
    """Refuse a model, described by `about`, whose units are not those of the recording."""
    from fitting.diagnosis._data_checks import check_units

    if about is not None:
        check_units(about, data)
