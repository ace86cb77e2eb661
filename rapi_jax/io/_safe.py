"""Opening files that are not trusted: kind, size and place are checked before parsing."""

import contextlib
import difflib
import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import BinaryIO

from rapi_jax._errors import DataError

MAX_BYTES = 4 * 2**30
MAX_MANIFEST = 2**20
_BLOCK = 2**20

StrPath = str | os.PathLike[str]


def printable(text: object, limit: int = 200) -> str:
    """`text` on one line and safe on a terminal: control characters escaped, the middle cut out.

    >>> from rapi_jax.io import printable
    >>> printable("path/" + "a" * 100, limit=20)
    'path/aaaaa...aaaaaaaaaa'
    """
    safe = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text))
    half = limit // 2
    return safe if len(safe) <= limit else f"{safe[:half]}...{safe[-half:]}"


def cause(error: BaseException) -> str:
    """What went wrong, on one line, without the path that `OSError` adds."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return printable(text.strip().split("\n")[0].rstrip(".") or type(error).__name__)


@contextlib.contextmanager
def located(label: str) -> Iterator[None]:
    """Put `label` (already printable) in front of a `DataError` from inside."""
    try:
        yield
    except DataError as error:
        raise DataError(f"{label}: {error}") from error


def _near_names(path: StrPath) -> str:
    """Which file of nearly that name is there, in a sentence; empty where none is."""
    with contextlib.suppress(OSError, ValueError):
        folder, name = os.path.split(os.fspath(path))
        near = difflib.get_close_matches(str(name), os.listdir(folder or "."), 1, 0.8)
        return "".join(f" Did you mean {printable(one)}?" for one in near)
    return ""


@contextlib.contextmanager
def open_regular(path: StrPath, max_bytes: int = MAX_BYTES) -> Iterator[BinaryIO]:
    """Open a regular file of at most `max_bytes` for reading; never waits on a pipe or device."""
    label = printable(path)
    try:
        # Non-blocking, so that a named pipe is refused below instead of waited for.
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        handle = os.open(path, flags)
    except FileNotFoundError:
        raise DataError(f"{label}: no such file.{_near_names(path)} Check the path.") from None
    except (OSError, ValueError) as error:
        raise DataError(
            f"{label}: cannot be opened ({cause(error)}). Check its permissions and its path."
        ) from error
    status = os.fstat(handle)
    if not stat.S_ISREG(status.st_mode):
        os.close(handle)
        raise DataError(f"{label}: not a regular file. Give a file, not a folder or a device.")
    with os.fdopen(handle, "rb") as file:
        if status.st_size > max_bytes:
            raise DataError(
                f"{label}: {status.st_size} bytes, but at most {max_bytes} are read. Split the "
                "recording, or sample it less densely."
            )
        try:
            yield file
        except OSError as error:
            if error.filename is not None or error.errno is None:  # of another file, or our own
                raise
            raise DataError(
                f"{label}: cannot be read ({cause(error)}). Check the disk, or copy the file again."
            ) from error


def bytes_on_disk(file: BinaryIO) -> int:
    """Bytes that the file really stores: the holes of a sparse file do not count."""
    handle = file.fileno()
    size = os.fstat(handle).st_size
    stored, start = 0, 0
    try:
        while start < size:
            start = os.lseek(handle, start, os.SEEK_DATA)
            end = os.lseek(handle, start, os.SEEK_HOLE)
            stored, start = stored + end - start, end
    except AttributeError:  # no such call on this system
        stored = size
    except OSError as error:
        if error.errno != errno.ENXIO:  # ENXIO: a hole up to the end; else not known here
            stored = size
    finally:
        os.lseek(handle, 0, os.SEEK_SET)
    return stored


def read_text(path: StrPath, max_bytes: int = MAX_BYTES) -> str:
    """The text of a UTF-8 file, line ends as newlines; refused at the first NUL byte."""
    label = printable(path)
    blocks = []
    with open_regular(path, max_bytes) as file:
        left = max_bytes  # again: the file may grow while it is read
        while block := file.read(min(_BLOCK, left + 1)):
            if b"\0" in block:
                raise DataError(
                    f"{label}: holds NUL bytes, so it is not text (or is UTF-16, or was cut short "
                    "by a crash). Export it again as UTF-8 text."
                )
            left -= len(block)
            if left < 0:
                raise DataError(f"{label}: grew beyond {max_bytes} bytes while it was read.")
            blocks.append(block)
    try:
        text = b"".join(blocks).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(
            f"{label}: not UTF-8 text at byte {error.start}. Save it as UTF-8 again."
        ) from error
    return text.replace("\r\n", "\n")


def inside(folder: Path, file: str) -> Path:
    """The path of `file` in `folder`; refused where it is, or leads, outside."""
    label = printable(file)
    windows = PureWindowsPath(file)
    bad = windows.drive or windows.root or ".." in windows.parts or not file.isprintable()
    if bad or not PurePosixPath(file).parts:
        raise DataError(f"`file` = '{label}' must be a plain path inside the recording's folder.")
    path = folder / file
    try:
        real, root = path.resolve(), folder.resolve()
        path.is_file()  # a name that is too long fails here, in any folder
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        raise DataError(f"`file` = '{label}' cannot be followed ({cause(error)}).") from error
    if not real.is_relative_to(root):
        raise DataError(
            f"`file` = '{label}' is a link out of the recording's folder. Copy the file itself."
        )
    return path


def check_name(name: str) -> str:
    """`name` back, where it can be a file stem and a group name; outputs are named by it."""
    plain = name.isprintable() and name == name.strip() and not set(name) & set('/\\:*?"<>|')
    if not (plain and name and not name.startswith(".") and len(name.encode()) <= 200):
        raise DataError(
            f"'{printable(name)}' cannot name a run: use a short file stem of letters, digits, "
            "'-', '_' and '.'."
        )
    return name
