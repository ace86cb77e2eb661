"""Temporary files and folders that name their writer, and the removal of what the killed left.

A name holds the host, the process and a random part. What a process of this host left that no
longer runs is removed by the next writer in that folder; whether a process of another host (or of
another container) still runs cannot be seen, so what it left is removed once it is old.
"""

import contextlib
import hashlib
import os
import platform
import re
import secrets
import shutil
import time
from pathlib import Path

from ._unfinished import SUFFIX, finish_update

OLD_S = 7 * 86400.0  # far longer than any write takes; halved or doubled, it changes only tidiness
_NAME = re.compile(r"\.tmp-(?:([0-9a-f]{8})-([0-9]+)-)?[0-9a-f]{16}(?:\.[^.]*)?")


def temporary_name(suffix: str = "") -> str:
    """A new name for a temporary file or folder of this process."""
    return f".tmp-{_host()}-{os.getpid()}-{secrets.token_hex(8)}{suffix}"


def is_temporary(name: str) -> bool:
    """Whether a file or folder of this name is one that a writer of this package began."""
    return _NAME.fullmatch(name) is not None


def remove_leftovers(folder: Path) -> None:
    """Remove what killed writers left in `folder`, never what a living one writes.

    An update that was killed is finished: the files that its list names and the manifest does not
    are removed. Nothing is raised: what cannot be removed stays.
    """
    with contextlib.suppress(OSError):
        for path in [Path(entry.path) for entry in os.scandir(folder)]:
            found = _NAME.fullmatch(path.name)
            if found is None or not _is_left_over(path, *found.groups()):
                continue
            if path.suffix != SUFFIX or finish_update(path):
                _remove(path)


def _is_left_over(path: Path, host: str | None, process: str | None) -> bool:
    if host == _host() and process is not None and os.name == "posix":
        return not _runs(int(process))
    with contextlib.suppress(OSError):
        return time.time() - path.lstat().st_mtime > OLD_S
    return False  # another removed it


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)  # sends nothing
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True  # of another user
    return True


def _host() -> str:
    """This host, and where there are several on it, the space that process numbers count in."""
    space = ""
    with contextlib.suppress(OSError):
        space = os.readlink("/proc/self/ns/pid")
    return hashlib.sha256(f"{platform.node()} {space}".encode()).hexdigest()[:8]
