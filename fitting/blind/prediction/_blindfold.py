"""The blindfold: audit hooks that keep a process from the answers and from the simulator.

Python reports what it is about to do to audit hooks, and a hook cannot be removed. This one
refuses whatever names a path among the answers; programs and threads of other processes, which no
hook would see; and modules that simulate devices, or that open files behind Python's back. It is no
defence against code written to break out (Python's own documentation says as much of audit
hooks): it makes sure that no diagnosis reads an answer by mistake or for convenience.
"""

import errno
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

WITHHELD_MODULES = (
    "fitting.blind.simulator._bank",
    "fitting.blind.simulator._simulated_device",
    "fitting.blind.simulator.effects._kinds",
)
# They open files in C, where no hook is asked. Recordings here are text.
UNAUDITED_READERS = ("_sqlite3", "h5netcdf", "h5py", "netCDF4", "sqlite3")
_STARTS = (
    "ctypes.dlsym",
    "os.exec",
    "os.fork",
    "os.forkpty",
    "os.posix_spawn",
    "os.spawn",
    "os.startfile",
    "os.system",
    "pty.spawn",
    "subprocess.Popen",
)
_NO_PATHS = ("os.putenv", "os.unsetenv")
_ON_PATHS = ("open", "glob", "mmap", "os", "pathlib", "shutil", "sqlite3", "tempfile")


class BlindfoldError(PermissionError):
    """Access that a diagnosis must not have."""


def install(answers: Path) -> list[str]:
    """Refuse, from now on and for good, all that could show what is in the folder `answers`.

    Returns a list that grows by a word for each refusal. Raises `RuntimeError` where a module that
    must not be there is loaded already.
    """
    loaded = [name for name in (*WITHHELD_MODULES, *UNAUDITED_READERS) if name in sys.modules]
    if loaded:
        raise RuntimeError(f"the blindfold comes too late: {', '.join(loaded)} is loaded already.")
    refused: list[str] = []
    hidden = [_normalised(os.path.realpath(answers)), *_sources()]
    sys.addaudithook(_hook(hidden, _normalised(answers.name), refused))
    import _posixsubprocess  # what multiprocessing starts programs with is not reported  # noqa: PLC2701 (of the standard library)

    def no_program(*arguments: Any) -> int:
        del arguments
        refused.append("fork_exec")
        raise BlindfoldError(errno.EACCES, "no program is started under the blindfold")

    _posixsubprocess.fork_exec = no_program
    return refused


def _sources() -> list[str]:
    """The files that hold the generator's entrances, compiled or not.

    A module that `importlib` is asked for by name is reported by the files it opens alone.
    """
    home = Path(os.path.realpath(__file__)).parents[3]
    tag = sys.implementation.cache_tag
    found = []
    for name in WITHHELD_MODULES:
        source = home.joinpath(*name.split(".")).with_suffix(".py")
        found += [source, source.parent / "__pycache__" / f"{source.stem}.{tag}.pyc"]
    return [_normalised(str(path)) for path in found]


def _normalised(path: str) -> str:
    return os.path.normcase(path).casefold()  # some file systems do not tell letters apart


def _hook(
    hidden: list[str], folder: str, refused: list[str]
) -> Callable[[str, tuple[Any, ...]], None]:
    # All that is called here is bound now: a name that is replaced later changes nothing.
    real, decode, absolute = os.path.realpath, os.fsdecode, os.path.isabs
    normalised, separator = _normalised, os.sep

    def names_hidden(value: Any) -> bool:
        if not isinstance(value, str | bytes | os.PathLike):
            return False
        try:
            path = decode(value)
        except (TypeError, ValueError):
            return False
        if not absolute(path) and folder in normalised(path).split(separator):
            return True  # it may be meant from another folder than the current one
        try:
            found = normalised(real(path))
        except (OSError, ValueError):
            return False
        return any(found == one or found.startswith(one + separator) for one in hidden)

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "import":
            name = str(arguments[0])
            bad = name in WITHHELD_MODULES or name.partition(".")[0] in UNAUDITED_READERS
        elif event in _STARTS:
            bad = True
        elif event == "ctypes.dlopen":
            bad = arguments[0] is not None  # None: what is loaded anyway, as `ctypes` itself does
        elif event.partition(".")[0] in _ON_PATHS and event not in _NO_PATHS:
            bad = any(names_hidden(value) for value in arguments)
        else:
            return
        if bad:
            refused.append(event)
            raise BlindfoldError(errno.EACCES, f"{event} is refused under the blindfold")

    return hook
