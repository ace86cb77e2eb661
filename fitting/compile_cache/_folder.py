"""Where compiled programs are kept: a private folder, one subfolder a processor and versions."""

import hashlib
import importlib.metadata
import os
import platform
import re
import stat
import sys
from pathlib import Path

NAME = "rapi-jax"
_SUBFOLDER = re.compile(r"jax-[0-9a-f]{16}")
# What a Linux kernel says of a processor: what compilers choose instructions and their order by.
_PROCESSOR = {
    "vendor_id", "cpu family", "model", "stepping", "flags",  # x86
    "CPU implementer", "CPU architecture", "CPU variant", "CPU part", "Features",  # ARM
    "isa", "uarch", "cpu", "revision",  # RISC-V, POWER
}  # fmt: skip


class NotPrivateError(Exception):
    """Somebody else could put an entry into the folder."""


def cache_root() -> Path | None:
    """`RAPI_CACHE_DIR`, or a folder of ours in the user's cache folder; `None` without a home."""
    named = os.environ.get("RAPI_CACHE_DIR")
    if named:
        return Path(named).expanduser().absolute()
    try:
        if sys.platform == "win32":
            base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
        elif sys.platform == "darwin":
            base = Path.home() / "Library" / "Caches"
        else:
            base = Path(os.environ.get("XDG_CACHE_HOME", ""))
            base = base if base.is_absolute() else Path.home() / ".cache"  # as XDG has it
    except RuntimeError:  # no home folder
        return None
    return base / NAME if base.is_absolute() else None


def machine_folder(root: Path) -> Path:
    """The subfolder for this processor, and for these versions of JAX and Python.

    The key of an entry holds the version of jaxlib and, in JAX 0.10, the processor's features (a
    fingerprint of its topology); older versions left them out, and no version promises them. Python
    decides how an entry is packed.
    """
    about = [
        *(f"{name} {importlib.metadata.version(name)}" for name in ("jax", "jaxlib")),
        f"{sys.implementation.name} {sys.version_info.major}.{sys.version_info.minor}",
        sys.platform,
        platform.machine(),
        _processor(),
    ]
    return root / f"jax-{hashlib.sha256(repr(about).encode()).hexdigest()[:16]}"


def is_machine_folder(folder: Path | str) -> bool:
    """Whether the folder is one of ours, by its name."""
    return bool(_SUBFOLDER.fullmatch(os.path.basename(folder)))


def _processor() -> str:
    """The first processor's make and features."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            lines = [line.partition(":") for line in iter(file.readline, "")]
    except OSError:
        return platform.processor()
    found: dict[str, str] = {}
    for name, _, value in lines:
        if name.strip() in _PROCESSOR:
            found.setdefault(name.strip(), value.strip())
    return repr(sorted(found.items()))


def make_private(folder: Path) -> None:
    """Make the folder, readable and writable by its owner alone, or see that it is private.

    A folder that was there may be read by others. Raises `NotPrivateError` where it is a symbolic
    link or no folder, belongs to another user, or can be written by group or others, or where
    anybody could put another in its place; `OSError` where it cannot be made.
    """
    missing = [parent for parent in folder.parents if not parent.exists()]
    for parent in reversed(missing):
        parent.mkdir(mode=0o700, exist_ok=True)
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        pass
    about = folder.lstat()
    if stat.S_ISLNK(about.st_mode):
        raise NotPrivateError(f"{folder} is a symbolic link")
    if not stat.S_ISDIR(about.st_mode):
        raise NotPrivateError(f"{folder} is not a folder")
    if not hasattr(os, "geteuid"):  # Windows: the user's folders are closed to others
        return
    if about.st_uid != os.geteuid():
        raise NotPrivateError(f"{folder} belongs to another user")
    if about.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise NotPrivateError(f"{folder} can be written by other users")
    for parent in folder.resolve().parents:
        mode = parent.stat().st_mode
        if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
            raise NotPrivateError(f"{parent}, which holds {folder}, can be written by anybody")
