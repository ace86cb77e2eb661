"""Writers of results killed at random moments, and disks full at every byte: what is read then.

    python3 -m uv run python -m tests.benchmarks.torn_results [--kills 200] [--positions 400]
        [--kind fit|diagnose|compensate ...] [--part kills|quota|limit|tmpfs ...]

- `kills`: a process writes one result over another in one folder, again and again, and is ended
  by SIGKILL; the next one goes on in the folder as it was left.
- `quota`: a write fails after so many bytes in all, as on a full disk (an injected ENOSPC), over an
  earlier result and in a new folder: bytes in even steps, and those beside the end of every file.
- `limit`: the kernel refuses bytes beyond so many in a file (RLIMIT_FSIZE).
- `tmpfs`: a small file system, 4096 bytes larger each time; skipped where none may be mounted.

A line a part and kind: how often the folder held the first result, the second, or was refused by
name. Ends with 1 where once it was anything else, or a full disk raised anything but `OutputError`.
"""

import argparse
import collections
import contextlib
import errno
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax

from rapi_jax.io import OutputError

jax.config.update("jax_enable_x64", True)
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from tests.support.torn import KINDS, Kind  # noqa: E402

Counts = collections.Counter[str]
PAGE = 4096  # bytes, of a tmpfs


def kills(kind: Kind, folder: Path, trials: int) -> Counts:
    """Kill writers in one folder, and read it after each."""
    counts, moments = collections.Counter(), random.Random(0)
    began = time.perf_counter()
    for write in (*kind.writers, kind.writers[0]):
        write(folder)
    cycle = (time.perf_counter() - began) * 2.0 / 3.0
    for _ in range(trials):
        child = _fork(lambda: _write_forever(kind, folder))
        time.sleep(moments.uniform(0.0, 1.5 * cycle))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        counts[kind.outcome(folder)] += 1
    kind.writers[0](folder)  # whole this time: it removes what the killed ones left
    if left := len([*folder.glob(".tmp-*")]):
        counts["TORN: temporary files left"] = left
    return counts


def _write_forever(kind: Kind, folder: Path) -> None:
    while True:
        for write in kind.writers[::-1]:
            write(folder)


def _fork(body: Any) -> int:
    child = os.fork()
    if child == 0:
        try:
            body()
        finally:
            os._exit(0)
    return child


def quota(kind: Kind, folder: Path, positions: int) -> Counts:
    """Let writes fail after so many bytes in all, with the first result there or nothing."""
    with _quota(1 << 40) as spent:
        kind.writers[1](folder)
    total, ends = spent[0], spent[1:]
    beside = {at + off for at in ends for off in (-1, 0, 1)}
    step = max(1, total // max(1, positions))
    counts = collections.Counter()
    for at in sorted({*range(0, total, step), *beside} & {*range(total)}):
        for fresh in (False, True):
            _clear(folder)
            if not fresh:
                kind.writers[0](folder)
            with _quota(at):
                counts[_after_a_full_disk(kind, folder)] += 1
    return counts


@contextlib.contextmanager
def _quota(left: int) -> Iterator[list[int]]:
    """Let `Path.write_bytes` write `left` bytes more; gives the bytes in all, and after each."""
    real, spent = Path.write_bytes, [0]

    def write(path: Path, data: Any) -> int:
        room = max(0, left - spent[0])
        spent[0] += len(data)
        spent.append(spent[0])
        if len(data) > room:
            real(path, bytes(data)[:room])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(path, data)

    Path.write_bytes = write
    try:
        yield spent
    finally:
        Path.write_bytes = real


def limit(kind: Kind, folder: Path, positions: int) -> Counts:
    """Let the kernel refuse what is beyond so many bytes of a file."""
    kind.writers[1](folder)
    largest = max(path.stat().st_size for path in folder.iterdir())
    counts = collections.Counter()
    _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    for at in range(0, largest, max(1, largest // max(1, positions))):
        _clear(folder)
        kind.writers[0](folder)
        resource.setrlimit(resource.RLIMIT_FSIZE, (at, most))
        try:
            found = _write_second(kind, folder)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
        counts[found or kind.outcome(folder)] += 1
    return counts


def tmpfs(kind: Kind, folder: Path, positions: int) -> Counts:
    """Fill a file system that is a page larger each time."""
    del positions
    counts = collections.Counter()
    _mount(folder, "size=64m")
    try:
        kind.writers[0](folder)
        used = _used(folder)
        kind.writers[1](folder)
        more = _used(folder) + max(p.stat().st_size for p in folder.iterdir()) - used
        for size in range(used, used + max(more, 0) + 8 * PAGE, PAGE):
            _mount(folder, "remount,size=64m")
            _clear(folder)
            kind.writers[0](folder)
            _mount(folder, f"remount,size={size}")
            counts[_after_a_full_disk(kind, folder)] += 1
    finally:
        subprocess.run(["umount", str(folder)], check=True)
    return counts


def _mount(folder: Path, options: str) -> None:
    command = ["mount", "-t", "tmpfs", "-o", options, "none", str(folder)]
    subprocess.run(command, check=True, capture_output=True)


def _used(folder: Path) -> int:
    status = os.statvfs(folder)
    return (status.f_blocks - status.f_bfree) * status.f_frsize


def _after_a_full_disk(kind: Kind, folder: Path) -> str:
    return _write_second(kind, folder) or kind.outcome(folder)


def _write_second(kind: Kind, folder: Path) -> str:
    """Nothing, or what is wrong with how it failed."""
    try:
        kind.writers[1](folder)
    except OutputError as error:
        if "\n" in str(error) or str(folder) not in str(error):
            return f"TORN: a full disk without a name: {error}"
    except Exception as error:
        return f"TORN: a full disk raised {type(error).__name__}: {error}"
    return "TORN: a temporary file was left" if [*folder.glob(".tmp-*")] else ""


def _clear(folder: Path) -> None:
    for path in folder.iterdir():
        path.unlink()


PARTS = {"kills": kills, "quota": quota, "limit": limit, "tmpfs": tmpfs}


def main() -> int:
    """Print it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--positions", type=int, default=400)
    parser.add_argument("--kind", nargs="+", choices=KINDS, default=[*KINDS])
    parser.add_argument("--part", nargs="+", choices=PARTS, default=[*PARTS])
    options = parser.parse_args()
    warnings.simplefilter("ignore")  # a fork beside JAX's threads; the children call none of it
    failed = False
    for name in options.kind:
        kind = KINDS[name]()
        for part in options.part:
            folder = Path(tempfile.mkdtemp(prefix="torn-"))
            count = options.kills if part == "kills" else options.positions
            try:
                counts = PARTS[part](kind, folder, count)
            except (subprocess.CalledProcessError, FileNotFoundError) as error:
                said = getattr(error, "stderr", None) or str(error).encode()
                print(f"{name:10} {part:6} skipped: {said.decode().strip()}", flush=True)
                continue
            finally:
                shutil.rmtree(folder, ignore_errors=True)
            failed |= any(outcome.startswith("TORN") for outcome in counts)
            said = ", ".join(f"{outcome} {n}" for outcome, n in sorted(counts.items()))
            print(f"{name:10} {part:6} {said}", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
