"""Commands of `rapi` killed at random moments: what is left, and whether the next one works.

    python3 -m uv run python -m tests.benchmarks.killed_commands [--kills 40] [--seconds 600]
        [--seed 0] [--kind fit|import|compensate|predict|measure|diagnose ...]

Each kill ends a process by SIGKILL: half of them anywhere in the time that the command takes, half
shortly after it first touched its output. A process is forked from one that has imported what
commands import, which takes most of their time, and has begun nothing else. They write into one
folder, over what the last one left; after every tenth, and in the end, a command is let end by
itself. A line a kind: how often the folder held a whole result, none, or one that is refused by
name. Ends with 1 where once it was anything else, where what the user had beside it was changed, or
a command that was let end did not.
"""

import argparse
import collections
import contextlib
import dataclasses
import hashlib
import json
import os
import random
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from benches import Served  # noqa: E402
from scope_files import put, scanned, tektronix  # noqa: E402

from fitting._result_files import UNFINISHED, check_belongs  # noqa: E402
from fitting.compile_cache import machine_folder, variables  # noqa: E402
from hardware import HislipServer  # noqa: E402
from rapi_jax import DataError, Identified, ModelError, triangle  # noqa: E402
from rapi_jax.examples import paper_device, paper_recording  # noqa: E402
from rapi_jax.io import (  # noqa: E402
    read_model,
    read_recording,
    write_drive,
    write_model,
    write_recording,
)

SOON_S = 0.5  # after the output was touched
LONGEST_S = 600.0


@dataclasses.dataclass(frozen=True)
class Kind:
    """A command, the name of its output in the folder, and what is found there afterwards."""

    command: list[str]
    output: str
    outcome: Callable[[Path], str]


def listed(name: str) -> Callable[[Path], str]:
    """What a result is whose list is `name`."""

    def outcome(folder: Path) -> str:
        files = [p for p in sorted(folder.glob("*")) if not p.name.startswith(".tmp-")]
        if not files:
            return "absent"
        if not (folder / name).exists():
            return f"TORN: files without {name}: {[p.name for p in files]}"
        if UNFINISHED in (folder / name).read_text():
            return "refused"
        try:
            for path in files:
                check_belongs(path)
                if path.suffix == ".rapi":
                    read_model(path)
        except (DataError, ModelError) as error:
            return f"TORN: {error}"
        return "whole"

    return outcome


def recording(runs: int) -> Callable[[Path], str]:
    """What a recording of so many runs is."""

    def outcome(path: Path) -> str:
        if not path.exists():
            return "absent"
        try:
            found = read_recording(path)
        except DataError as error:
            return f"TORN: {error}"
        return "whole" if len(found.runs) == runs else f"TORN: {len(found.runs)} runs"

    return outcome


def prepare(folder: Path, stack: contextlib.ExitStack, kinds: list[str]) -> dict[str, Kind]:
    """Inputs of all commands in `folder`, and the commands."""
    small, _ = paper_recording(samples=200, periods=2, noise=0.02)
    write_recording(small, folder / "recording")
    about = {"response_unit": "GHz", "drive_unit": "V", "trusted": True, "data_sha256": ""}
    about["identified"] = Identified.of(small).to_dict()
    write_model(folder / "model.rapi", paper_device(), **about)
    put(folder / "scope.csv", tektronix(*scanned((10.0, 3, 4.5), (20.0, 4, 4.5))))
    (drive,) = triangle([100.0], amplitude=1.0, bias=3.0, samples=1000)
    write_drive(drive, folder / "drive.csv")
    if "measure" in kinds:
        Served(stack, folder, HislipServer)  # writes bench.toml
    columns = "--drive CH1 --response CH2 --response-scale 4.5 --response-unit GHz"
    fast = "--starts 2 --plays 4 --each none"
    made = {
        "fit": (f"fit recording {fast}", "fit", listed("model.json")),
        "import": (f"import scope.csv {columns}", "imported", recording(2)),
        "compensate": ("compensate model.rapi --span 60 --frequency 10 20", "drives",
                       listed("certificate.json")),
        "predict": ("predict model.rapi recording", "predicted", listed("prediction.json")),
        "measure": ("measure bench.toml drive.csv drive.csv", "measured", recording(2)),
        "diagnose": ("diagnose recording --model model.rapi", "diagnosed",
                     listed("diagnosis.json")),
    }  # fmt: skip
    return {
        name: Kind([*text.split(), "-o", output], output, outcome)
        for name, (text, output, outcome) in made.items()
    }


_LAUNCHER = """
import json, os, sys
import h5netcdf, jax, jinja2, matplotlib.figure, optimistix, pyvisa_py, scipy.optimize, xarray
import fitting, hardware
from fitting.cli import app
from fitting.commands.run import run
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        said = os.open("said.txt", os.O_CREAT | os.O_WRONLY | os.O_TRUNC)
        os.dup2(said, 1)
        os.dup2(said, 2)
        code = run(app, json.loads(line))
        sys.stdout.flush()
        os._exit(code)
    print(child, flush=True)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


class Commands:
    """Runs commands of `rapi` in a folder, each in a process of its own. A context manager."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._launcher = subprocess.Popen(
            [sys.executable, "-c", _LAUNCHER], cwd=folder, env=ENVIRONMENT, text=True, bufsize=1,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def __enter__(self) -> "Commands":
        return self

    def __exit__(self, *error: object) -> None:
        assert self._launcher.stdin is not None
        self._launcher.stdin.close()
        self._launcher.wait()

    def begin(self, command: list[str]) -> int:
        """Start a command; the number of its process."""
        assert self._launcher.stdin is not None
        self._launcher.stdin.write(json.dumps(command) + "\n")
        return int(self._line())

    def ended(self) -> bool:
        """Whether it has ended."""
        return bool(select.select([self._launcher.stdout], [], [], 0.001)[0])

    def wait(self) -> int:
        """Its exit code; the number of a signal, negative, where one ended it."""
        return int(self._line())

    def _line(self) -> str:
        assert self._launcher.stdout is not None
        return self._launcher.stdout.readline()


class Trials:
    """Kills of one kind of command, in one folder."""

    def __init__(self, kind: Kind, commands: Commands, rng: random.Random) -> None:
        self.kind, self.commands, self.rng = kind, commands, rng
        self.output = commands.folder / kind.output
        self.counts: collections.Counter[str] = collections.Counter()
        self.longest_s = 0.0

    def run(self, kills: int, seconds: float) -> None:
        """Let it end, then kill it so often, or for so long."""
        until = time.monotonic() + seconds
        self.let_end()
        for trial in range(kills):
            if time.monotonic() > until:
                break
            self.kill(soon=trial % 2 == 1)
            if trial % 10 == 9:
                self.let_end()
        self.let_end()

    def let_end(self) -> None:
        """The command as a user runs it again: it works, whatever was left."""
        began = time.monotonic()
        self.commands.begin(self.kind.command)
        code = self.commands.wait()
        self.longest_s = time.monotonic() - began
        outcome = self.kind.outcome(self.output)
        if code not in (0, 4) or outcome != "whole":
            said = (self.commands.folder / "said.txt").read_text()
            self.counts[f"NEXT FAILED: {code}, {outcome}: {said[-500:]}"] += 1
        if beside := [path.name for path in self.commands.folder.rglob(".tmp-*")]:
            self.counts[f"LEFT: {beside}"] += 1

    def kill(self, *, soon: bool) -> None:
        """One process, ended by SIGKILL."""
        if self.rng.random() < 0.3:
            _remove(self.output)
        before = _touched(self.output)
        process = self.commands.begin(self.kind.command)
        until = time.monotonic() + (LONGEST_S if soon else self.rng.uniform(0.0, self.longest_s))
        while time.monotonic() < until and not self.commands.ended():
            if soon and _touched(self.output) != before:
                time.sleep(self.rng.uniform(0.0, SOON_S) ** 2 / SOON_S)
                break
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
        killed = self.commands.wait() == -signal.SIGKILL
        self.counts["killed" if killed else "ended before"] += 1
        self.counts[self.kind.outcome(self.output)] += 1


# What JAX compiles is kept, as by the command itself, which sets this before it imports JAX.
ENVIRONMENT = os.environ | variables(machine_folder(ROOT / ".pytest_cache/d/compiled"))
ENVIRONMENT |= {"PYTHONPATH": str(ROOT), "RAPI_PROGRESS": "0"}


def _touched(path: Path) -> list[tuple[str, int]]:
    """What is at `path` and beside it that is being written, by name and time of change."""
    found = [*path.parent.glob(".tmp-*"), *path.glob("*"), *path.glob(".tmp-*")]
    states = []
    for one in found:
        with contextlib.suppress(OSError):
            states.append((str(one), one.stat().st_mtime_ns))
    return sorted(states)


def _remove(path: Path) -> None:
    for one in path.glob("*") if path.is_dir() else ():
        one.unlink()
    if path.is_dir() and not any(path.iterdir()):
        path.rmdir()


def hashes(folder: Path, outputs: set[str]) -> dict[str, str]:
    """Of all that the user has in the folder but for the outputs."""
    return {
        str(path): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.relative_to(folder).parts[0] not in outputs
        and ".tmp-" not in str(path)
    }  # fmt: skip


def main() -> int:
    """Print it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    names = ["fit", "import", "compensate", "predict", "measure", "diagnose"]
    parser.add_argument("--kills", type=int, default=40)
    parser.add_argument("--seconds", type=float, default=600.0, help="of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kind", nargs="+", choices=names, default=names[:-1])
    options = parser.parse_args()
    failed = False
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="killed-")))
        kinds = prepare(folder, stack, options.kind)
        outputs = {kind.output for kind in kinds.values()} | {"said.txt"}
        before = hashes(folder, outputs)
        commands = stack.enter_context(Commands(folder))
        for name in options.kind:
            trials = Trials(kinds[name], commands, random.Random(f"{options.seed} {name}"))
            trials.run(options.kills, options.seconds)
            if hashes(folder, outputs) != before:
                trials.counts["CHANGED: what the user had"] += 1
            failed |= any(outcome[:1].isupper() for outcome in trials.counts)
            said = ", ".join(f"{outcome} {n}" for outcome, n in sorted(trials.counts.items()))
            print(f"{name:10} {said}", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
