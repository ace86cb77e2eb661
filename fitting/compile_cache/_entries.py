"""The entries of a cache: counted, the oldest dropped, all removed. No link is followed."""

import contextlib
import dataclasses
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from ._folder import is_machine_folder

# An entry takes some 10 kB, so this is a hundred thousand: far beyond what one laser needs, and
# little beside a disk.
KEPT_BYTES = 2**30
_ENTRY, _BESIDE = "-cache", ("-atime", ".lockfile")  # JAX's names; the others with a bound of its
_TUNING = "xla_gpu_per_fusion_autotune_cache_dir"  # a folder that XLA makes where there is a GPU


@dataclasses.dataclass(frozen=True)
class Entries:
    """How many programs are kept, and the bytes they take."""

    count: int
    size: int


def count_entries(root: Path) -> Entries:
    """Of all subfolders of `root`."""
    sizes = [about.st_size for about, _ in _entries(root)]
    return Entries(len(sizes), sum(sizes))


def drop_oldest(root: Path, kept: int = KEPT_BYTES) -> None:
    """Drop the entries used longest ago where all of `root` take more than `kept` bytes.

    When an entry was read is known as well as the file system tells, usually to a day. JAX's own
    bound (`jax_compilation_cache_max_size`) reads the whole folder at each writing.
    """
    total = 0
    for about, path in sorted(
        _entries(root), key=lambda entry: max(entry[0].st_mtime, entry[0].st_atime), reverse=True
    ):
        total += about.st_size
        if total > kept:
            _unlink(path)


def clear_entries(root: Path) -> Entries:
    """Remove all that JAX wrote in the subfolders of `root`, and the folders that are then empty.

    Returns what was removed. Files of another name stay, and so do their folders.
    """
    before = count_entries(root)
    for folder in _subfolders(root):
        for name in os.listdir(folder):
            if name.endswith((_ENTRY, *_BESIDE)):
                _unlink(os.path.join(folder, name))
        shutil.rmtree(os.path.join(folder, _TUNING), ignore_errors=True)  # follows no link
        _remove_empty(folder)
    _remove_empty(root)
    after = count_entries(root)
    return Entries(before.count - after.count, before.size - after.size)


def _subfolders(root: Path) -> Iterator[str]:
    if os.path.islink(root):
        return
    with contextlib.suppress(OSError), os.scandir(root) as inside:
        for one in inside:
            if is_machine_folder(one.name) and one.is_dir(follow_symlinks=False):
                yield one.path


def _entries(root: Path) -> Iterator[tuple[os.stat_result, str]]:
    for folder in _subfolders(root):
        with contextlib.suppress(OSError), os.scandir(folder) as inside:
            for one in inside:
                if not one.name.endswith(_ENTRY) or not one.is_file(follow_symlinks=False):
                    continue
                with contextlib.suppress(FileNotFoundError):  # another process dropped it
                    yield one.stat(follow_symlinks=False), one.path


def _unlink(path: str) -> None:
    with contextlib.suppress(OSError):  # gone, or open in another process (Windows)
        os.unlink(path)


def _remove_empty(folder: str | Path) -> None:
    with contextlib.suppress(OSError):
        os.rmdir(folder)
