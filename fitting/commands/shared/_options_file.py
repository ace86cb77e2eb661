"""Options of a command from a `rapi.toml` beside the data; those on the command line win."""

import datetime
import difflib
import hashlib
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cyclopts import App, ArgumentCollection, CycloptsError
from cyclopts.config import Dict

NAME = "rapi.toml"
# Of each command that reads the file, the arguments that are its data.
DATA = {
    "import": ("file", "files"),
    "check": ("recording", "recordings"),
    "fit": ("recording", "recordings"),
    "predict": ("recording",),
    "compensate": ("model",),
    "diagnose": ("recording", "recordings"),
    "range": ("records",),
    "population": ("result", "results"),
    "batch": ("jobs",),
}
_CODE = "its code is run"
_PLACE = "it says where this run writes, or how"
_SAFETY = "it allows a drive that is not backed by the data"
_ELSEWHERE = "it sends the jobs to another computer"
# A file that comes with somebody's data must not run code, choose where is written or drop a check.
_COMMAND_LINE_ONLY = {
    "plugin": _CODE,
    "output": _PLACE,
    "json": _PLACE,
    "dry_run": _PLACE,
    "untrusted": _SAFETY,
    "extrapolate": _SAFETY,
    "scheduler": _ELSEWHERE,
}


def options_hint(command: str) -> str:
    """What the help of a command says of the file; empty where it reads none."""
    if command not in DATA:
        return ""
    return f"Options can also be given in a {NAME} beside the data, in the table [{command}]."


def find_options_file(paths: Sequence[Path]) -> Path | None:
    """The `rapi.toml` in each of `paths`, where these are folders, or in the folder that holds it.

    Raises `CycloptsError` where it is not the same for all.
    """
    found = {_beside(path) for path in paths}
    if len(found) > 1:
        listed = " and ".join(sorted("none" if one is None else str(one) for one in found))
        raise CycloptsError(
            msg=f"the data have different option files: {listed}. Run the command once for each."
        )
    return next(iter(found), None)


def read_options(path: Path, command: str) -> dict[str, Any]:
    """The table of `command` in the file, by names with underscores; empty without one.

    Raises `CycloptsError` where the file holds anything but tables of commands, or an option that
    only the command line may give, and `DataError` where it is no TOML.
    """
    from rapi_jax.internal import read_toml

    content = read_toml(path, str(path))
    for name, table in content.items():
        if name not in DATA or not isinstance(table, dict):
            close = difflib.get_close_matches(name, DATA, 1)
            hint = f" Did you mean [{close[0]}]?" if close else f" There are: {', '.join(DATA)}."
            raise CycloptsError(msg=f"{path}: {name!r} is no table of a command.{hint}")
    options = {key.replace("-", "_"): value for key, value in content.get(command, {}).items()}
    for key in options:
        if key in _COMMAND_LINE_ONLY:
            raise CycloptsError(
                msg=f"{path}: `{key}` is given on the command line only: {_COMMAND_LINE_ONLY[key]}."
            )
        if key in DATA[command]:
            raise CycloptsError(msg=f"{path}: `{key}` is the data, which the command line names.")
    return options


def apply_options_file(app: App, commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
    """Fill the options that the command line does not give; say so on standard error.

    A configuration as cyclopts calls it. Raises `CycloptsError` for an unknown option.
    """
    if len(commands) != 1 or commands[0] not in DATA:
        return
    (command,) = commands
    given = {one.field_info.name: one for one in arguments if len(one.keys) == 0}
    paths = [
        Path(str(token.value))
        for name in DATA[command]
        if name in given
        for token in _data_tokens(command, given[name].tokens)
    ]
    file = find_options_file(paths)
    options = {} if file is None else read_options(file, command)
    if file is None or not options:
        return
    for key in options:
        if key not in given:
            close = difflib.get_close_matches(key, given, 1)
            hint = f" Did you mean `{close[0]}`?" if close else ""
            if command == "batch" and not close:
                hint = " Options of the single command follow JOBS, or stand in a list of jobs."
            raise CycloptsError(msg=f"{file}: [{command}] has no option `{key}`.{hint}")
    free = {
        key: locate(value, given[key].hint, file.parent)
        for key, value in options.items()
        if not given[key].tokens
    }
    Dict({command: {k.replace("_", "-"): v for k, v in free.items()}}, source=str(file))(
        app, commands, arguments
    )
    from fitting.commands.run import fail

    kept = ", ".join(f"{key} = {value}" for key, value in free.items())
    unused = f"{file} changes nothing: its options are on the command line."
    fail("note", f"options from {file}: {kept}." if kept else unused)


def describe_options_file(command: str, options: Mapping[str, Any]) -> dict[str, str] | None:
    """Path and SHA-256 of the file whose options a command read; None without one.

    `command`: as it is typed, such as `rapi fit`; `options`: all its arguments, by name.
    """
    name = command.split()[1]
    values = [options.get(key) for key in DATA.get(name, ())]
    paths = [p for v in values for p in (v if isinstance(v, tuple) else (v,)) if p is not None]
    file = find_options_file(paths)
    if file is None or not read_options(file, name):
        return None
    return {"path": str(file), "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}


def _data_tokens(command: str, tokens: Sequence[Any]) -> Sequence[Any]:
    """Those that name data: behind the jobs of a batch come options of the single command."""
    options = (at for at, token in enumerate(tokens) if str(token.value).startswith("-"))
    return tokens[: next(options, len(tokens))] if command == "batch" else tokens


def _beside(path: Path) -> Path | None:
    while any(sign in str(path.parent) for sign in "*?[") and not path.parent.exists():
        path = path.parent  # of a pattern, the folder that is named in full
    places = [path / NAME] if path.is_dir() else []
    return next((file for file in (*places, path.parent / NAME) if file.is_file()), None)


def locate(value: Any, hint: Any, folder: Path) -> Any:
    """A value as the command line takes it; a relative path is from where the file is."""
    if isinstance(value, str) and Path in (hint, *typing.get_args(hint)):
        return str(folder / value)
    return value.isoformat() if isinstance(value, datetime.date | datetime.time) else value
