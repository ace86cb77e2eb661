"""Cold processes: help, imports, and a first fit with an empty and with a filled compile cache."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from rapi_jax.io import write_recording

from ._cases import Case, case, recorded
from ._paired import Row, check_equal, compared, take_turns
from .fits import checked_start

RAPI = str(Path(sys.executable).parent / "rapi")
FIT = (sys.executable, "-m", f"{__package__}._cold_process")
IMPORT = (sys.executable, "-c")
END_AGREES = 1e-6  # relative
# The exit code of a fit that is not to be trusted, as one from a single start is.
ACCEPTED = (0, 4)


def environment(cache: Path) -> dict[str, str]:
    """Every compile cache of either side in `cache`, also of what compiles fast."""
    return os.environ | {
        "JAX_COMPILATION_CACHE_DIR": str(cache / "jax"),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
        "RAPI_CACHE_DIR": str(cache / "rapi"),
        "NUMBA_CACHE_DIR": str(cache / "numba"),
    }


def run(command: Sequence[str], cache: Path | None = None) -> str:
    """What `command` prints; caches in `cache`, or in an empty folder."""
    with tempfile.TemporaryDirectory() as empty:
        done = subprocess.run(
            command,
            env=environment(cache or Path(empty)),
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode not in ACCEPTED:
        raise RuntimeError(f"{' '.join(command)} ended with {done.returncode}: {done.stderr}")
    return done.stdout


def rows(rounds: int) -> Iterator[Row]:
    """Start-up against the least that it could be, fits against the peer's process."""
    for work, ours, peer, commands in (
        ("help", "`rapi --help`", "`python -c pass`", ((RAPI, "--help"), (*IMPORT, "pass"))),
        (
            "import",
            "`import rapi_jax`",
            "`import jax`",
            ((*IMPORT, "import rapi_jax"), (*IMPORT, "import jax")),
        ),
    ):
        mine, other = commands
        ways: dict[str, Callable[[], str]] = {ours: _way(mine), peer: _way(other)}
        seconds = _timed(ways, max(rounds, 5))
        more = float(np.median(seconds[ours] - seconds[peer]))
        yield compared(f"cold: {work}", ours, peer, seconds, note=f"{more:+.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        yield from _fits(Path(folder), rounds)


def _way(command: Sequence[str], cache: Path | None = None) -> Callable[[], str]:
    return lambda: run(command, cache)


def _timed(ways, rounds):
    for way in ways.values():
        way()  # reads the files into memory, and fills the cache where that is kept
    return take_turns(ways, rounds)


def _fits(folder: Path, rounds: int) -> Iterator[Row]:
    given = case(recorded())
    file = folder / "arrays.npz"
    save(file, given)
    write_recording(given.recording, folder / "recording")
    found = {side: float(run((*FIT, side, str(file)))) for side in ("ours", "peer")}
    check_equal("final cost of a cold fit", found["ours"], found["peer"], END_AGREES)
    costs = dict(start_cost=checked_start(given), ours_cost=found["ours"], peer_cost=found["peer"])
    source, out = str(folder / "recording"), str(folder / "out")
    command = (RAPI, "fit", source, "--output", out, "--no-plots")
    one, whole, peer = (
        "process with `fit`, one start",
        "`rapi fit`: guesses, both structures, held-out refits",
        "process with SciPy + Numba, one start",
    )
    for state in ("empty", "filled"):
        cache = folder / "cache" if state == "filled" else None
        ways = {
            one: _way((*FIT, "ours", str(file)), cache),
            peer: _way((*FIT, "peer", str(file)), cache),
            whole: _way(command, cache),
        }
        seconds = _timed(ways, rounds)
        work = f"cold: 4 x {given.runs.u.shape[1]}, {state} caches"
        yield compared(work, one, peer, seconds, **costs)
        yield compared(work, whole, peer, seconds, note="more work than the peer's")


def save(file: Path, given: Case) -> None:
    """The data and the start as arrays."""
    np.savez(file, values=given.values, shape=np.array(given.shape), **given.runs._asdict())
