"""JAX's settings for a cache, as environment variables, and the cache of the command line."""

import contextlib
import dataclasses
import os
from collections.abc import Callable, Iterator
from pathlib import Path

from ._damaged import UNREADABLE, UNWRITABLE, drop_damaged_entries
from ._entries import drop_oldest
from ._folder import NotPrivateError, cache_root, machine_folder, make_private

DIRECTORY = "JAX_COMPILATION_CACHE_DIR"
SWITCH = "RAPI_COMPILE_CACHE"
_OFF = ("0", "false", "no", "off")


def switched_off() -> bool:
    """Whether `RAPI_COMPILE_CACHE` says no, for this process and those that it starts."""
    return os.environ.get(SWITCH, "").strip().lower() in _OFF


def variables(folder: Path) -> dict[str, str]:
    """Environment variables with which a process keeps what it compiles in `folder`.

    Every program is kept, however small: to compile the smallest takes 5 to 10 ms, to read it 1 ms,
    and a fit has some fifteen of them. The warnings that are ignored are told in
    `drop_damaged_entries`. XLA's own messages below a fatal one are not shown: on some processors
    XLA writes a line for each program that it reads, about preferences of its compiler that it
    takes for features.
    """
    return {
        DIRECTORY: str(folder),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
        "PYTHONWARNINGS": ",".join(
            f"ignore:{text}:UserWarning" for text in (UNREADABLE, UNWRITABLE)
        ),
        "TF_CPP_MIN_LOG_LEVEL": "3",
    }


def worker_variables(root: Path) -> dict[str, str]:
    """The same for a process that this one starts: for its own cache, or for one in `root`.

    None where this process has a cache, of ours or the user's, since it is inherited; nor where the
    cache is switched off or `root` is no place for one.
    """
    if DIRECTORY in os.environ or switched_off():
        return {}
    try:
        return variables(_made(root))
    except (NotPrivateError, OSError):
        return {}


@dataclasses.dataclass(frozen=True)
class CacheState:
    """The cache of the command line: where it is, and why it is off."""

    root: Path | None  # of all subfolders
    folder: Path | None  # where entries are read and written; `None` where the cache is off
    reason: str = ""
    insecure: bool = False  # off because others could write the folder


def cache_state() -> CacheState:
    """Whether this process may use the cache; its folders are made."""
    root = cache_root()
    named = os.environ.get(DIRECTORY)
    if named is not None and (root is None or named != str(machine_folder(root))):
        return CacheState(root, None, f"{DIRECTORY} names {named or 'no folder'}: JAX uses that")
    if switched_off():
        return CacheState(root, None, f"{SWITCH} is {os.environ[SWITCH]}")
    if root is None:
        return CacheState(root, None, "this user has no home folder")
    try:
        return CacheState(root, _made(root))
    except NotPrivateError as error:
        return CacheState(root, None, str(error), insecure=True)
    except OSError as error:
        return CacheState(root, None, f"{root}: {error.strerror}")


@contextlib.contextmanager
def compiled_programs_kept(warn: Callable[[str], None]) -> Iterator[None]:
    """Keep what this process compiles in the block, and what processes it starts compile.

    For a process that is ours: it sets environment variables (but none that is set already) and how
    warnings are shown, and must come before JAX is imported. `warn` is called with one line where
    others could write the folder; a folder that cannot be made is no fault.
    """
    state = cache_state()
    if state.insecure:
        warn(f"compiled programs are not kept: {state.reason}. Name another with RAPI_CACHE_DIR.")
    if state.root is None or state.folder is None:
        yield
        return
    for name, value in variables(state.folder).items():
        os.environ.setdefault(name, value)
    drop_damaged_entries(state.folder)
    before = _changed(state.folder)
    try:
        yield
    finally:
        if _changed(state.folder) != before:  # something was written
            drop_oldest(state.root)


def _made(root: Path) -> Path:
    folder = machine_folder(root)
    make_private(root)
    make_private(folder)
    return folder


def _changed(folder: Path) -> int:
    """When an entry was last added or removed."""
    try:
        return folder.stat().st_mtime_ns
    except OSError:
        return 0
