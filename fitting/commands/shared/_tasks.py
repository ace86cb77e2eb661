"""What a batch does with each recording: the single commands' work, with nothing printed."""

import errno
import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from cyclopts import App, CycloptsError

from fitting.batch.jobs._job import Job, Outcome
from fitting.commands.compensate.command import compensate
from fitting.commands.diagnose import diagnose
from fitting.commands.fit import fit
from fitting.commands.range import range_command

_COMMANDS: Mapping[str, Callable[..., int]] = {
    "fit": fit, "compensate": compensate, "diagnose": diagnose, "range": range_command,
}  # fmt: skip
# What a batch decides itself: where data come from and results go, and how it is printed.
_NOT_OPTIONS = {"recording", "recordings", "records", "model", "output", "json", "check"}
_OF_TWO = {"compare", "effects"}  # of `rapi diagnose`: a job is one recording
_OF_THE_JOB = {"compensate": "model", "range": "records"}
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)


def parse_options(task: str, tokens: Sequence[str], folder: Path) -> dict[str, Any]:
    """The options of the single command that `tokens` set; paths are made absolute in `folder`.

    Raises `CycloptsError` where the single command would.
    """
    app = App(name=task, help_flags=(), version_flags=())
    app.default(_COMMANDS[task])
    given = ["JOB", "--output", "DIR", *tokens]
    try:
        _, bound, _ = app.parse_args(given, exit_on_error=False, print_error=False)
    except CycloptsError as error:
        error.command_chain = (task,)
        raise
    own = _own_options(task)
    extra = [name for name in bound.arguments if name not in own | _fixed(task)]
    if extra or bound.arguments.get("recordings"):
        what = f"--{extra[0]} is not for a batch." if extra else "the recordings come first."
        raise CycloptsError(msg=what, command_chain=("batch",))
    return {
        name: _absolute(value, folder) for name, value in bound.arguments.items() if name in own
    }


def complete_options(task: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """`options` with the defaults of the single command for what they leave out."""
    parameters = inspect.signature(_COMMANDS[task]).parameters
    own = _own_options(task)
    return {name: options.get(name, one.default) for name, one in parameters.items() if name in own}


def option_hints(task: str) -> dict[str, Any]:
    """The options of the single command that a batch takes, with their types."""
    own, parameters = _own_options(task), inspect.signature(_COMMANDS[task]).parameters
    return {name: one.annotation for name, one in parameters.items() if name in own}


def _fixed(task: str) -> set[str]:
    return {_OF_THE_JOB.get(task, "recording"), "recordings", "output"}


def _own_options(task: str) -> set[str]:
    not_options = _NOT_OPTIONS
    if task == "diagnose":
        not_options = not_options - {"model"} | _OF_TWO
    elif task == "compensate":
        not_options = not_options - {"recording"}
    return {name for name in inspect.signature(_COMMANDS[task]).parameters} - not_options


def _absolute(value: Any, folder: Path) -> Any:
    if isinstance(value, Path):
        return folder.resolve() / value
    if isinstance(value, tuple):
        return tuple(_absolute(item, folder) for item in value)
    return value


def run_task(job: Job, folder: Path) -> Outcome:
    """Compute a job into `folder`, as the single command does; an error is an outcome, too."""
    from fitting.commands.run import explain_error, one_line
    from fitting.commands.shared._model import UntrustedModel
    from rapi_jax.io import OutputError

    try:
        return _DO[job.task](job.path, folder, **job.options)
    except Exception as error:
        code, kind, message = explain_error(error)
        full = message if isinstance(error, OutputError) and error.errno in _FULL else ""
        return Outcome(
            "skipped" if isinstance(error, UntrustedModel) else "failed",
            code,
            one_line(f"{kind}: {message}"),
            lasting=not isinstance(error, OutputError),
            stop=full,
        )


def _about(path: Path, task: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """What the result's JSON says of its origin."""
    from fitting.commands.shared.files._provenance import provenance

    given = {"job": path, **options}
    return {"provenance": provenance(f"rapi batch --do {task}", given, ("job",))}


def _fit(
    path: Path, folder: Path, *, operator: str, plugin: tuple[Path, ...], nan: Any, **options: Any
) -> Outcome:
    from fitting.commands.fit import identify_into
    from fitting.commands.run import DONE, UNTRUSTED
    from fitting.commands.shared._out import output_folder
    from fitting.commands.shared._plugins import find_operator
    from rapi_jax.io import read_recording

    kind = find_operator(operator, plugin)
    data = read_recording(path, nan=nan)
    asked = options | {"operator": operator, "plugin": plugin, "nan": nan}
    result, written = identify_into(
        data, output_folder(folder), kind=kind, more=_about(path, "fit", asked), **options
    )
    trusted, reasons = result.verdict.trusted, result.verdict.reasons
    return Outcome(
        "done",
        DONE if trusted else UNTRUSTED,
        "" if trusted else f"not to be trusted: {'; '.join(reasons)}",
        data.provenance,
        written,
    )


def _compensate(path: Path, folder: Path, **options: Any) -> Outcome:
    from fitting.commands.compensate._drives import compensate_into

    more = _about(path, "compensate", options)
    written = compensate_into(path, folder, more=more, **options)[-1]
    return Outcome("done", 0, written=written)


def _diagnose(
    path: Path,
    folder: Path,
    *,
    model: Path | None,
    limits: Path | None,
    plugin: tuple[Path, ...],
    scan: bool,
    nan: Any,
) -> Outcome:
    from fitting.commands.diagnose import check_model_units, diagnose_into
    from fitting.commands.shared._limits import check_limits_unit
    from fitting.commands.shared._model import describe_distrust, load_model
    from fitting.commands.shared._out import output_folder
    from fitting.commands.shared._plugins import plugin_effects, plugin_operators
    from rapi_jax import effects
    from rapi_jax.io import read_limits, read_recording

    bounds = None if limits is None else read_limits(limits)
    own = plugin_effects(plugin)
    ecdl, about = (
        (None, None) if model is None else load_model(model, own, plugin_operators(plugin))
    )
    data = read_recording(path, nan=nan)
    check_model_units(about, data)
    check_limits_unit(bounds, limits, data.drive_unit)
    written = diagnose_into(
        data,
        output_folder(folder),
        folder.name,
        ecdl=ecdl,
        candidates=(*effects.ALL, *own),
        limits=bounds,
        scan=scan,
        notes=describe_distrust(about),
        more=_about(
            path,
            "diagnose",
            {"model": model, "limits": limits, "plugin": plugin} | {"scan": scan, "nan": nan},
        ),
    )
    return Outcome("done", 0, "", data.provenance, written)


def _range(
    path: Path, folder: Path, *, expected: tuple[float, float] | None, **options: Any
) -> Outcome:
    from fitting.commands.range import check_expected, range_into, why_no_distance
    from fitting.commands.run import BAD_DATA, DONE
    from fitting.commands.shared._out import output_folder
    from rapi_jax.io import printable, read_fringe_records

    check_expected(expected)
    records = read_fringe_records(path)
    name = printable(path.resolve().name)
    found, _, written = range_into(
        records,
        output_folder(folder),
        name,
        expected=expected,
        more=_about(path, "range", options | {"expected": expected}),
        **options,
    )
    if found.summary.counted:
        return Outcome("done", DONE, written=written)
    return Outcome("failed", BAD_DATA, f"bad data: {why_no_distance(found)}", written=written)


_DO: Mapping[str, Callable[..., Outcome]] = {
    "fit": _fit, "compensate": _compensate, "diagnose": _diagnose, "range": _range,
}  # fmt: skip
