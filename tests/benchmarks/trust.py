"""Spoiled recordings, fitted as `rapi fit` does: which are trusted, and what such trust costs.

    python3 -m uv run python -m tests.benchmarks.trust [--seeds N] [--first SEED] [WAY ...]
    python3 -m uv run python -m tests.benchmarks.trust --mixtures N
    python3 -m uv run python -m tests.benchmarks.trust --diagnose [WAY ...]

A line a way: how its recordings ended (refused on reading, not trusted, trusted) and, from the
device that made them, the rms error at a rate that was not recorded and the nonlinearity of a
compensated scan. Trusted wrongly is what misses its claim by more than half a reading's noise.
Named are those of the ways in `CAUSES` where a finding gives cause and place.
Mixtures are two or three ways, drawn at random, one after the other. `--diagnose` asks for a cause
instead: named wrongly is an effect that is given more than one half. `--processes N` (default: all
cores) and `--rows FILE` (each recording's end as a line of JSON) go with each of these.
"""

import argparse
import dataclasses
import json
import os
import re
import tempfile
import warnings
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from fitting import FitResult, diagnose, identify
from rapi_jax import (
    DataError,
    Identified,
    LimitError,
    ModelError,
    NotInvertible,
    Recording,
    Run,
    compensate,
    linear_scan,
    linearity,
    predict,
    triangle,
)
from rapi_jax.examples import NOISE
from rapi_jax.io import read_recording, write_recording
from tests.support.spoiled import CAUSES, WAYS, Columns, healthy

UNSEEN, SWING, SCAN = 25.0, 4.2, 20.0  # Hz, V, Hz
RENEWED = 50  # recordings; what is compiled for their shapes fills a process's memory maps
MIXED, SURE = " + ", 0.5


@dataclasses.dataclass(frozen=True)
class Row:
    """What became of one recording; errors in GHz, not numbers where there is none."""

    way: str
    seed: int
    end: str
    why: str
    error: float = np.nan
    scan: float = np.nan
    high: float = np.nan
    noise: float = np.nan
    findings: tuple[str, ...] = ()

    @property
    def named(self) -> bool | None:
        """Whether a finding gives cause and place; `None` where the way is not to be told."""
        cause = CAUSES.get(self.way)
        if cause is None:
            return None
        return any(re.search(cause, found) for found in (self.why, *self.findings))

    @property
    def wrong(self) -> bool:
        """Whether it was trusted, and its claim does not hold for the device."""
        promised = np.sqrt(max(self.high**2 - self.noise**2, 0.0))
        return self.end == "trusted" and not max(self.error, self.scan) <= max(promised, NOISE / 2)


def judge(way: str, seed: int) -> Row:
    """Spoil the recording of `seed`, write it, read it, and fit it."""
    columns = healthy(seed)
    try:
        recording = _read(way, columns)
        result = identify(recording, throw=False)
    except (DataError, ModelError) as error:
        return Row(way, seed, "refused", str(error))
    found = (*result.verdict.reasons, *result.verdict.notes)
    if not result.verdict.trusted:
        return Row(way, seed, "not trusted", found[0], findings=found)
    claim = result.claim
    assert claim is not None
    error, scan = _truth(columns, result, recording)
    return Row(way, seed, "trusted", "", error, scan, claim.high, claim.noise, found)


def _read(way: str, columns: Columns) -> Recording:
    """The spoiled recording, as a command reads it."""
    with np.errstate(all="ignore"), tempfile.TemporaryDirectory() as folder:
        for one in way.split(MIXED) if way != "healthy" else ():
            WAYS[one](columns)
        write_recording(columns.recording(), Path(folder) / "recording.nc")
        return read_recording(Path(folder) / "recording.nc")


def ask(way: str, seed: int) -> Row:
    """Spoil the recording of `seed`, and diagnose it."""
    try:
        verdict = diagnose(None, _read(way, healthy(seed))).verdict
    except (DataError, ModelError) as error:
        return Row(way, seed, "refused", str(error))
    named = verdict.effects and verdict.probability > SURE
    return Row(way, seed, f"named {verdict.name}" if named else "not named", verdict.name)


def mixtures(count: int, seed: int) -> list[str]:
    """So many mixtures of two or three ways, drawn at random."""
    rng = np.random.default_rng(seed)
    sizes = rng.integers(2, 4, count)
    return [MIXED.join(rng.choice(list(WAYS), size, replace=False)) for size in sizes]


def _truth(columns: Columns, result: FitResult, recording: Recording) -> tuple[float, float]:
    """The error at a rate not recorded, about its mean, and the nonlinearity of a scan; GHz."""
    (drive,) = triangle((UNSEEN,), amplitude=SWING, bias=3.0, samples=2000)
    said, true = (np.asarray(predict(m, drive)) for m in (result.ecdl, columns.device))
    error = float(np.std(said - true))
    try:
        (target,) = linear_scan([SCAN], span=0.8 * float(np.ptp(true)), samples=2048)
        made = compensate(result.ecdl, target, identified=Identified.of(recording))
        answer = np.asarray(predict(columns.device, made.drive))
    except (ModelError, LimitError, NotInvertible):
        return error, 0.0  # no drive, no harm
    scan = linearity(Run(made.drive, answer))
    return error, max(scan.up.rms_ghz, scan.down.rms_ghz)


def _start(job: tuple[str, int, bool]) -> Row:
    warnings.simplefilter("ignore")
    way, seed, asks = job
    try:
        return ask(way, seed) if asks else judge(way, seed)
    except Exception as error:  # an internal error is what this is to find
        return Row(way, seed, "INTERNAL ERROR", f"{type(error).__name__} {error}")


def main() -> None:
    """Print the table, and what it adds up to."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("ways", nargs="*", default=["healthy", *WAYS])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--mixtures", type=int, default=0)
    parser.add_argument("--diagnose", action="store_true")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--rows", type=Path, help="a file that gets each row as a line of JSON")
    options = parser.parse_args()
    ways = mixtures(options.mixtures, options.first) if options.mixtures else options.ways
    count = 1 if options.mixtures else options.seeds
    seeds = range(options.first, options.first + count)
    jobs = [(way, seed, options.diagnose) for way in ways for seed in seeds]
    rows: list[Row] = []
    with get_context("spawn").Pool(options.processes, maxtasksperchild=RENEWED) as pool:
        found = pool.imap(_start, jobs)
        for way in ways:
            rows += (some := [next(found) for _ in seeds])
            _print(way, some)
            _keep(some, options.rows)
    spoiled = [row for row in rows if row.way != "healthy"]
    if options.diagnose:
        print(f"of {len(spoiled)}: {_count(row.end.split()[0] for row in spoiled)}")
        return
    counts: dict[str, Any] = {
        end: sum(row.end == end for row in spoiled) for end in ("refused", "not trusted", "trusted")
    }
    print(f"spoiled: {counts}; trusted wrongly {sum(row.wrong for row in spoiled)}")
    named = [row.named for row in spoiled if row.named is not None]
    ways = {row.way for row in spoiled if row.named is False}
    print(f"cause and place named: {sum(named)} of {len(named)}; not always: {sorted(ways)}")
    well = [row for row in rows if row.way == "healthy"]
    print(f"healthy: {sum(row.end != 'trusted' for row in well)} of {len(well)} not trusted")


def _print(way: str, rows: list[Row]) -> None:
    ends = ", ".join(f"{end} {n}" for end, n in _count(row.end for row in rows).items())
    errors = [1e3 * row.error for row in rows if row.end == "trusted"]
    scans = [1e3 * row.scan for row in rows if row.end == "trusted"]
    harm = f"; error {max(errors):.3g}, scan {max(scans):.3g} MHz" if errors else ""
    wrong = sum(row.wrong for row in rows)
    reasons = _count(row.why.split(":")[0] for row in rows if row.why)
    print(
        f"{way}: {ends}{harm}{f'; WRONG {wrong}' if wrong else ''}"
        f"{'; ' + ', '.join(reasons) if reasons else ''}",
        flush=True,
    )


def _keep(rows: list[Row], path: Path | None) -> None:
    if path is not None:
        with path.open("a") as file:
            file.writelines(json.dumps(dataclasses.asdict(row)) + "\n" for row in rows)


def _count(values: Any) -> dict[str, int]:
    found: dict[str, int] = {}
    for value in values:
        found[value] = found.get(value, 0) + 1
    return found


if __name__ == "__main__":
    main()
