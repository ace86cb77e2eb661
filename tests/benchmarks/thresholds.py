"""List every number that decides; halve and double each on open simulated devices.

`--list` prints the table. Otherwise each threshold is varied in this process on `--count` devices
of known effect, `diagnose` runs (`identify` for identification's), and a JSON line goes to
`--output` for each device, threshold and factor; lines that are there are not computed again.
Not a test.
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
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]
PACKAGES = ("rapi_jax", "fitting", "hardware")
FACTORS = (0.5, 2.0)


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


@contextlib.contextmanager
def set_to(threshold: Threshold, value: float | int) -> Iterator[None]:
    """Another value meanwhile. What was compiled with the first is forgotten before and after."""
    import jax

    before = threshold.value
    jax.clear_caches()
    object.__setattr__(threshold.holder, threshold.name, value)
    try:
        yield
    finally:
        object.__setattr__(threshold.holder, threshold.name, before)
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
    """None, then one device for each effect; each about four times the noise after projection."""
    from worlds import TRUTHS, drives, projected, recorded

    session = drives(rates=(10.0, 20.0, 40.0), periods=3, samples=192)
    out = [("none", recorded(noise=0.02, session=session))]
    for name, truth in list(TRUTHS.items())[: count - 1]:
        noise = projected([truth], session) / 4.0
        out.append((name, recorded([truth], noise=noise, session=session)))
    return out[:count]


def evaluate(recording: Any, room: str, limit_s: int) -> dict[str, Any]:
    """Verdict, set, gap and probabilities, or the error; with the seconds it took."""
    began = time.monotonic()
    try:
        with time_limit(limit_s):
            if room.startswith("fitting.identification"):
                from fitting import identify

                result = identify(recording, throw=False)
                out = {
                    "name": str(result.verdict.trusted),
                    "set": [],
                    "numbers": {"rmse": result.rmse},
                }
            else:
                from fitting import diagnose

                content = diagnose(None, recording, scan=False).to_dict()
                verdict = content["verdict"]
                numbers = {f"gap.{k}": v for k, v in content["gap"].items()}
                numbers |= {f"p.{h['name']}": h["probability"] for h in content["hypotheses"]}
                out = {"name": verdict["name"], "set": sorted(verdict["set"]), "numbers": numbers}
        out["numbers"] = {
            key: float(value)
            for key, value in out["numbers"].items()
            if isinstance(value, int | float) and not isinstance(value, bool)
        }
    except Exception as error:  # a number that breaks the diagnosis is a finding, too
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


def vary(thresholds: list[Threshold], count: int, output: Path, limit_s: int) -> None:
    """Write a JSON line for each device, threshold and factor that has none yet."""
    lines = output.read_text().splitlines() if output.exists() else []
    done = {(r["device"], r["room"], r["name"], r["factor"]) for r in map(json.loads, lines)}
    for device, recording in devices(count):
        reference: dict[bool, dict[str, Any]] = {}
        for threshold in thresholds:
            for factor in FACTORS:
                key = (device, threshold.room, threshold.name, factor)
                if key in done:
                    continue
                kind = threshold.room.startswith("fitting.identification")
                if kind not in reference:
                    reference[kind] = evaluate(recording, threshold.room, limit_s)
                value = threshold.scaled(factor)
                with set_to(threshold, value):
                    found = evaluate(recording, threshold.room, limit_s)
                row = dict(zip(("device", "room", "name", "factor"), key, strict=True))
                row |= {"value": value} | compare(reference[kind], found)
                row |= {key: found[key] for key in ("seconds", "error") if key in found}
                with output.open("a") as out:
                    out.write(json.dumps(row) + "\n")
                print(json.dumps(row), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", action="store_true", help="print the table and end")
    parser.add_argument("--only", default="", help="rooms whose name contains this")
    parser.add_argument("--count", type=int, default=4, help="devices, the first without an effect")
    parser.add_argument("--limit", type=int, default=300, help="seconds a device")
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
    vary(thresholds, arguments.count, arguments.output, arguments.limit)


if __name__ == "__main__":
    main()
