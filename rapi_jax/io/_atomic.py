"""Output files that are whole or not there: temporary file, fsync, rename, fsync of the folder."""

import contextlib
import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from ._leftovers import remove_leftovers, temporary_name
from ._safe import StrPath, cause, printable

_CURE = {
    errno.ENOSPC: "Free some space and run again.",
    errno.EDQUOT: "Free some of your quota and run again.",
    errno.ENOENT: "Make the folder first.",
    errno.EACCES: "Choose a folder that you may write to.",
    errno.EROFS: "Choose a folder that you may write to.",
}


class OutputError(OSError):
    """An output that could not be written: path, cause and cure; what was there is unchanged.

    >>> from rapi_jax.io import OutputError, write_atomic
    >>> try:
    ...     write_atomic("no/such/folder/a.txt", "text")
    ... except OutputError as error:
    ...     print(str(error).split(".")[0])
    cannot write no/such/folder/a
    """


def output_error(path: StrPath, error: OSError) -> OutputError:
    """`error` as one line that names the output."""
    if isinstance(error, OutputError):
        return error
    cure = _CURE.get(error.errno or 0, "Nothing there was changed.")
    new = OutputError(f"cannot write {printable(path)}: {cause(error)}. {cure}")
    new.errno = error.errno
    return new


def sync(path: Path) -> None:
    """Wait until a file is on the disk."""
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sync_folder(path: Path) -> None:
    """Wait until a folder's entries are on the disk, where the file system can."""
    with contextlib.suppress(OSError):
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _reserve(target: Path) -> Path:
    """An empty temporary file beside `target`, with its permissions and its suffix."""
    mode = 0o666  # less the umask
    if target.exists():
        status = target.stat()
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "it is there and is not a regular file")
        mode = stat.S_IMODE(status.st_mode)
    temporary = target.with_name(temporary_name(target.suffix))
    handle = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666)
    try:
        if mode != 0o666 and hasattr(os, "fchmod"):
            os.fchmod(handle, mode)
    finally:
        os.close(handle)
    return temporary


@contextlib.contextmanager
def atomic_path(path: StrPath) -> Iterator[Path]:
    """A temporary path to write to; renamed to `path` once the block ends without an exception.

    On any exception the temporary is removed and the old file stays. Of two processes that write
    one path, the last to complete wins. A process that is killed may leave a `.tmp-*` file behind,
    which the next write into the same folder removes. Raises `OutputError` for every `OSError` of
    the block.

    >>> from pathlib import Path
    >>> from rapi_jax.io import atomic_path
    >>> with atomic_path("result.csv") as path:
    ...     _ = path.write_text("1,2")
    ...     print(Path("result.csv").exists())
    False
    >>> Path("result.csv").exists()
    True
    """
    target = Path(os.path.realpath(path))  # a link stays a link
    remove_leftovers(target.parent)
    temporary: Path | None = None
    try:
        temporary = _reserve(target)
        yield temporary
        sync(temporary)
        os.replace(temporary, target)
    except BaseException as error:
        if temporary is not None:
            with contextlib.suppress(OSError):
                temporary.unlink()
        if isinstance(error, OSError):
            raise output_error(path, error) from error
        raise
    sync_folder(target.parent)


def write_atomic(path: StrPath, data: bytes | memoryview | str) -> None:
    """Write `data` (text as UTF-8) to `path`, whole or not at all. Raises `OutputError`.

    >>> from pathlib import Path
    >>> from rapi_jax.io import write_atomic
    >>> write_atomic("result.txt", "42.7 MHz")
    >>> Path("result.txt").read_text()
    '42.7 MHz'
    """
    content = data.encode() if isinstance(data, str) else data
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)
