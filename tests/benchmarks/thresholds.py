"""List every number that decides; halve and double each on open simulated devices.

`--list` prints the table. Otherwise `identify` and `diagnose` run on `--count` devices of known
effect, `measure` in a simulated laboratory, and the data checks on damaged recordings, with those
thresholds halved and doubled that they read. One that a verdict, a set or a number follows (to
`MOVES`, relative) gets a JSON line in `--output`; those that move nothing are printed. Not a test.
"""

import argparse
import contextlib
import dataclasses
import importlib
import json
import math
import pkgutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]
PACKAGES = ("rapi_jax", "fitting", "hardware")
FACTORS = (0.5, 2.0)
MOVES = 1e-3  # relative: what a result printed to three digits would show
FIRST = ("etalon", "creep", "none", "gain_drift")  # repeats; has memory; nothing; drifts
GROUP = 8  # thresholds scaled together at first


@dataclasses.dataclass(frozen=True)
class Threshold:
    """A field made by `rapi_jax._threshold.threshold`, and the instance that the code reads."""

    room: str  # the module, without its last part
    holder: Any
    name: str
    unit: str
    origin: str

    @property
    def value(self) -> Any:
        return getattr(self.holder, self.name)

    def scaled(self, factor: float) -> Any:
        """A whole number stays one, and at least 1; of several numbers each is scaled."""
        value = self.value
        if isinstance(value, tuple):
            return tuple(one * factor for one in value)
        return max(1, round(value * factor)) if isinstance(value, int) else value * factor


def find_thresholds() -> list[Threshold]:
    """All of them, in the order of their rooms' names."""
    found: dict[tuple[int, str], Threshold] = {}
    for package in PACKAGES:
        for module in pkgutil.walk_packages(
            importlib.import_module(package).__path__, f"{package}."
        ):
            if not module.name.endswith("._thresholds"):
                continue
            for holder in vars(importlib.import_module(module.name)).values():
                if not dataclasses.is_dataclass(holder) or isinstance(holder, type):
                    continue
                for field in dataclasses.fields(holder):
                    if {"unit", "origin"} <= field.metadata.keys():
                        about = (field.metadata["unit"], field.metadata["origin"])
                        room = module.name.removesuffix("._thresholds")
                        found[id(holder), field.name] = Threshold(room, holder, field.name, *about)
    return sorted(found.values(), key=lambda one: (one.room, one.name))


class Reads:
    """Which thresholds an evaluation reads, and which of them while JAX traces."""

    def __init__(self, thresholds: list[Threshold]) -> None:
        self.names = {(id(one.holder), one.name) for one in thresholds}
        self.types = {type(one.holder) for one in thresholds}
        self.read: set[tuple[int, str]] = set()
        self.traced: set[tuple[int, str]] = set()

    @contextlib.contextmanager
    def recorded(self) -> Iterator[None]:
        """Every attribute read of the dataclasses is looked at meanwhile."""
        import jax
        import jax.numpy as jnp

        jax.clear_caches()

        def read(holder: Any, name: str) -> Any:
            key = (id(holder), name)
            if key in self.names:
                self.read.add(key)
                if key not in self.traced and isinstance(jnp.add(0.0, 0.0), jax.core.Tracer):
                    self.traced.add(key)
            return object.__getattribute__(holder, name)

        for kind in self.types:
            kind.__getattribute__ = read
        try:
            yield
        finally:
            for kind in self.types:
                del kind.__getattribute__


@contextlib.contextmanager
def scaled(thresholds: list[Threshold], factor: float, *, compiled: bool) -> Iterator[None]:
    """All of them scaled meanwhile; `compiled`: programs hold one, and are forgotten."""
    import jax

    before = [one.value for one in thresholds]
    if compiled:
        jax.clear_caches()
    for one in thresholds:
        object.__setattr__(one.holder, one.name, one.scaled(factor))
    try:
        yield
    finally:
        for one, value in zip(thresholds, before, strict=True):
            object.__setattr__(one.holder, one.name, value)
        if compiled:
            jax.clear_caches()


@contextlib.contextmanager
def time_limit(seconds: int) -> Iterator[None]:
    """`TimeoutError` after so long (POSIX)."""

    def stop(*_: Any) -> None:
        raise TimeoutError(f"not done in {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def devices(count: int) -> list[tuple[str, Any]]:
    """Those of `FIRST`, then one for each other effect, of about four times the noise each."""
    from worlds import TRUTHS, drives, projected, recorded

    session = drives(rates=(10.0, 20.0, 40.0), periods=3, samples=192)
    out = []
    for name in [*FIRST, *(name for name in TRUTHS if name not in FIRST)][:count]:
        truth = () if name == "none" else (TRUTHS[name],)
        noise = projected(truth, session) / 4.0 if truth else 0.02
        out.append((name, recorded(truth, noise=noise, session=session)))
    return out


def identified(recording: Any) -> dict[str, Any]:
    """What `identify` returns: verdict and parameters."""
    from fitting import identify

    result = identify(recording, throw=False)
    content = result.to_dict()["parameters"]
    numbers = {name: one["value"] for name, one in content.items()}
    numbers |= {f"{name}.stderr": one["stderr"] for name, one in content.items()}
    return {"name": result.verdict.trusted, "set": [], "numbers": numbers | {"rmse": result.rmse}}


def diagnosed(recording: Any) -> dict[str, Any]:
    """What `diagnose` returns: verdict, set, gap, probabilities, and the next scan."""
    from fitting import diagnose

    content = diagnose(None, recording).to_dict()
    verdict, scan = content["verdict"], content["next_scan"]
    numbers = {f"gap.{key}": value for key, value in content["gap"].items()}
    numbers |= {f"p.{one['name']}": one["probability"] for one in content["hypotheses"]}
    numbers |= {f"shrinkage.{key}": value for key, value in content["shrinkage"].items()}
    numbers |= {f"where.{k}": one["rms"] for k, one in enumerate(content["where"])}
    keys = ("excitation_hz", "amplitude", "power")
    numbers |= {f"scan.{key}": scan[key] for key in keys if scan is not None}
    return {"name": verdict["name"], "set": sorted(verdict["set"]), "numbers": numbers}


def measured(recording: Any) -> dict[str, Any]:
    """What a simulated laboratory records of two scans, read from its fringes."""
    from benches import bench_file

    from hardware import dry_run, read_bench
    from rapi_jax import triangle

    del recording
    drives = triangle([40.0, 80.0], amplitude=2.0, bias=3.0, samples=2000)
    with tempfile.TemporaryDirectory() as folder:
        with dry_run(read_bench(bench_file(Path(folder)))).bench as bench:
            runs = bench.measure(drives).runs
    numbers = {f"{k}.{n}": v for k, run in enumerate(runs) for n, v in enumerate(run.response)}
    return {"name": "", "set": [], "numbers": numbers}


def checked(recording: Any) -> dict[str, Any]:
    """What the data checks find in damaged recordings: kinds of faults, and how many samples."""
    import bad_input as bad

    from fitting.identification.data_checks._data_checks import find_faults
    from fitting.identification.data_checks._mode_hops import find_mode_hops
    from rapi_jax.io import read_recording

    del recording
    damages = {
        "clipped above": bad.clipped(None, 0.9),
        "clipped below": bad.clipped(0.1, None),
        "hop": bad.hopped(2.0, 130),
        "hop and back": bad.hopped(-3.0, 60, 75),
        "rate high": bad.entry(excitation_hz=12.5),
        "rate halved": bad.entry(excitation_hz=5.0),
        "rate doubled": bad.entry(excitation_hz=20.0),
        "clock in ms": bad.scale(0, 1000.0),
        "resting": bad.put(0, 2, slice(None), 3.0),
        "noise": bad.unrelated("noise"),
        "none": lambda damaged: None,
    }
    found, numbers = set(), {}
    for name, damage in damages.items():
        with tempfile.TemporaryDirectory() as folder:
            bad.data(damage)(Path(folder) / "r")
            damaged = read_recording(Path(folder) / "r")
        errors = [
            good.response - run.response
            for run, good in zip(damaged.runs, bad.good().runs, strict=True)
        ]
        for fault in [*find_faults(damaged), *find_mode_hops(damaged, errors)]:
            found.add(f"{name}: {fault.kind}")
            key = f"{name}.{fault.kind}.{fault.run}"
            numbers[key] = float(sum(last - first + 1 for first, last in fault.samples))
    return {"name": "", "set": sorted(found), "numbers": numbers}


EVALUATIONS = {"identify": identified, "diagnose": diagnosed, "measure": measured, "check": checked}
ONCE = ("measure", "check")  # do not depend on the device


def evaluate(which: str, recording: Any, limit_s: int) -> dict[str, Any]:
    """The result as a name, a set and numbers, or the error; with the seconds it took."""
    began = time.monotonic()
    try:
        with time_limit(limit_s):
            out = EVALUATIONS[which](recording)
        out["numbers"] = {
            key: float(value)
            for key, value in out["numbers"].items()
            if isinstance(value, int | float) and not isinstance(value, bool)
        }
    except Exception as error:  # a number that breaks the program is a finding, too
        out = {"error": f"{type(error).__name__}: {error}"}
    return out | {"seconds": round(time.monotonic() - began, 2)}


def compare(before: dict[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    """Whether verdict or set changed, and the largest relative change of a number."""
    if "error" in before or "error" in after:
        return {"changed": before.get("error") != after.get("error"), "largest": None}
    one, two = before["numbers"], after["numbers"]
    change = [
        abs(two.get(key, 0.0) - value) / max(abs(value), 1e-3)  # probabilities below 1e-3 are none
        for key, value in one.items()
        if math.isfinite(value)
    ]
    changed = [before[key] != after[key] for key in ("name", "set")]
    return {"changed": any(changed), "largest": max(change, default=0.0)}


def moves(row: dict[str, Any]) -> bool:
    """Whether a result follows: verdict, set, an error, or a number by more than `MOVES`."""
    return row["changed"] or row["largest"] is None or row["largest"] > MOVES


def vary(thresholds: list[Threshold], count: int, output: Path, limit_s: int) -> None:
    """A JSON line for each threshold that moves a result; on the next device the others are left.

    By group testing: several are scaled together, and the group is halved where a result moves.
    """
    moved: set[tuple[str, str]] = set()
    read: set[tuple[str, str]] = set()
    evaluations = 0
    for device, recording in devices(count):
        for which in EVALUATIONS:
            if which in ONCE and device != FIRST[0]:
                continue
            left = [one for one in thresholds if (one.room, one.name) not in moved]
            reads = Reads(left)
            with reads.recorded():
                evaluate(which, recording, limit_s)
            reference = evaluate(which, recording, limit_s)  # what compiled programs return
            left = [one for one in left if (id(one.holder), one.name) in reads.read]
            read |= {(one.room, one.name) for one in left}
            for factor in FACTORS:
                waiting = [left[k : k + GROUP] for k in range(0, len(left), GROUP)]
                while waiting:
                    group = waiting.pop()
                    compiled = any((id(one.holder), one.name) in reads.traced for one in group)
                    with scaled(group, factor, compiled=compiled):
                        found = evaluate(which, recording, limit_s)
                    evaluations += 1
                    row = compare(reference, found)
                    if not moves(row):
                        continue
                    if len(group) > 1:
                        middle = len(group) // 2
                        waiting += [group[:middle], group[middle:]]
                        continue
                    one = group[0]
                    moved.add((one.room, one.name))
                    row |= {"room": one.room, "name": one.name, "on": which, "device": device}
                    row |= {"factor": factor, "value": one.scaled(factor)}
                    row |= {key: found[key] for key in ("error",) if key in found}
                    with output.open("a") as out:
                        out.write(json.dumps(row) + "\n")
            print(f"{device}, {which}: {len(moved)} move, {evaluations} evaluations", flush=True)
    still = [one for one in thresholds if (one.room, one.name) in read - moved]
    print(
        f"{len(thresholds)} thresholds, {len(read)} read, {len(moved)} move a result, "
        f"{len(still)} move nothing:"
    )
    for one in still:
        print(f"{one.room}.{one.name} = {one.value!r} {one.unit} ({one.origin})")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", action="store_true", help="print the table and end")
    parser.add_argument("--only", default="", help="rooms whose name contains this")
    parser.add_argument("--part", default="1/1", help="k/n: every nth threshold from the kth")
    parser.add_argument("--count", type=int, default=4, help="devices")
    parser.add_argument("--limit", type=int, default=300, help="seconds an evaluation")
    parser.add_argument("--output", type=Path, default=Path("thresholds.jsonl"))
    arguments = parser.parse_args()
    thresholds = [one for one in find_thresholds() if arguments.only in one.room]
    if arguments.list:
        for one in thresholds:
            print(f"{one.room}.{one.name} = {one.value!r} {one.unit} ({one.origin})")
        print(f"{len(thresholds)} thresholds in {len({one.room for one in thresholds})} rooms")
        return
    import jax

    jax.config.update("jax_enable_x64", True)
    k, n = map(int, arguments.part.split("/"))
    vary(thresholds[k - 1 :: n], arguments.count, arguments.output, arguments.limit)


if __name__ == "__main__":
    main()
