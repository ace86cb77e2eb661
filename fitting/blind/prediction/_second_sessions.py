"""Second sessions of tied devices: after the scan that was advised, and after one at random.

A device whose diagnosis names more than one possible cause is measured once more, on its own clock,
first with the scan that its diagnosis advised, then, as if that had not been, with a scan drawn at
random within the same limits and of the same length. Both drives are switched on a minute after the
session, and both recordings are diagnosed under the blindfold.
"""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.blind.protocol._answers import read_answer, spec_of
from fitting.blind.protocol._exchange import recorded, write_exact
from fitting.blind.protocol._folder import BankFolder, make_folder, read_json, refuse_foreign
from fitting.blind.protocol._frozen import tree_sha256
from fitting.blind.simulator._scan import Scan, sampled
from rapi_jax import Drive, Identified, LimitError, Recording
from rapi_jax.io import read_drive, read_recording

from ._predict import NEXT, seed_of
from ._predictions import Progress, carry_out, close
from ._workers import Job

if TYPE_CHECKING:
    from fitting.blind.simulator._world import World

MOST = 40
KINDS = ("advised", "random")
CLOSED = "predictions.json"
PAUSE_S = 60.0
_LEAD_S = 0.1  # a drive is on for this long, and two periods, before its first sample
_TRIES = 1000


@dataclass(frozen=True)
class Pair:
    """The predictions of one device after the advised scan and after the random one."""

    name: str
    advised: Path
    random: Path


def tied(predictions: dict[str, dict[str, Any]]) -> list[str]:
    """Names of the recordings with several causes in the set, and a scan advised."""
    return [
        name
        for name, prediction in predictions.items()
        if len(prediction.get("diagnosis", {}).get("verdict", {}).get("set", ())) > 1
        and NEXT in prediction["files"]
        and prediction["withheld"] is None
    ]


def closed(folder: BankFolder, predictions: dict[str, dict[str, Any]]) -> list[Pair]:
    """The second predictions that were closed."""
    promised = read_json(folder.follow / CLOSED).get("sha256", {})
    return pairs(folder, [name for name in tied(predictions) if f"{KINDS[0]}/{name}" in promised])


def pairs(folder: BankFolder, names: Sequence[str]) -> list[Pair]:
    """Where the second predictions of these recordings are."""
    places = [folder.follow / kind / "predictions" for kind in KINDS]
    return [Pair(name, *(place / f"{name}.json" for place in places)) for name in names]


def files(found: Sequence[Pair]) -> dict[str, Path]:
    """The second predictions under the names by which they are closed."""
    return {f"{kind}/{p.name}": getattr(p, kind) for p in found for kind in KINDS}


def follow(
    folder: BankFolder,
    predictions: dict[str, dict[str, Any]],
    *,
    most: int = MOST,
    workers: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Measure the first `most`, diagnose and close; what is there already is kept."""
    names, tree, jobs = tied(predictions)[:most], tree_sha256(), []
    make_folder(folder.follow)
    for kind in KINDS:
        refuse_foreign(folder.follow / kind / "recordings", set(names))
        make_folder(folder.follow / kind / "recordings")
    for name in names:
        value, _ = read_answer(folder, name)
        world = spec_of(value).draw()
        first = read_recording(folder.recordings / name)
        advised = advised_scan(folder, name, predictions[name], world)
        scans = {"advised": advised, "random": random_scan(first, advised)}
        for number, kind in enumerate(KINDS):
            place = folder.follow / kind
            second = again(first, world, scans[kind], 1 + number)
            write_exact(second, place / "recordings" / name)
            jobs.append(
                Job(
                    str(place / "recordings" / name),
                    None,
                    str(place / "predictions"),
                    tree,
                    baselines=False,
                    scan=False,
                )
            )
    carry_out(folder, jobs, workers=workers, progress=progress)
    close(folder.follow / CLOSED, files(pairs(folder, names)), tree)


def again(first: Recording, world: "World", scan: Scan, seed: int) -> Recording:
    """The recorded session with one more run of the same device."""
    run = world.measure([*(run.scan for run in world.runs), scan], seed)[-1]
    return replace(first, runs=(*first.runs, recorded(run, f"run{len(first.runs):02d}")))


def advised_scan(folder: BankFolder, name: str, prediction: dict[str, Any], world: "World") -> Scan:
    """The scan of a prediction's `next_drive.csv`, as the laboratory plays it."""
    said = prediction["diagnosis"]["next_scan"]
    whole = read_drive(folder.predictions / name / NEXT, waveform=said["waveform"])
    rate = said["excitation_hz"]
    periods = 1 if rate is None else max(round(rate * whole.size * whole.step_s), 1)
    samples = whole.size // periods
    hz = 1 / (samples * whole.step_s) if rate is None else float(rate)
    scan = sampled(whole.value[:samples], hz, periods=periods, waveform=said["waveform"])
    if scan.waveform in ("triangle", "sine"):
        plain = replace(scan, swing=said["amplitude"], bias=said["bias"], table=None)
        if np.allclose(plain.drive, whole.value, rtol=0, atol=1e-6 * plain.swing):
            scan = plain  # known between its samples too
    return _switched_on(scan, world)


def random_scan(recording: Recording, like: Scan) -> Scan:
    """A triangle or sine, drawn from the recording's content, as long as `like`.

    Rates from half the slowest to ten times the fastest, evenly in the logarithm; swings from an
    eighth to the whole of the range recorded and 5 % more, at any bias that fits; no steeper than
    an advised scan may be. Steps have no period: their time is cut into five.
    """
    rng = np.random.default_rng([seed_of(recording), 1])
    limits = Identified.of(recording).limits()
    span = limits.high_v - limits.low_v
    rates = [rate for rate in recording.rates if rate > 0]
    periods = like.periods if like.periods > 1 else 5
    samples = like.samples if like.periods > 1 else max(like.samples // 5, 16)
    for _ in range(_TRIES):
        swing = float(rng.uniform(0.125, 1.0)) * span
        scan = Scan(
            rate_hz=float(np.exp(rng.uniform(np.log(min(rates) / 2), np.log(10 * max(rates))))),
            swing=swing,
            bias=limits.low_v + swing / 2 + float(rng.uniform()) * (span - swing),
            waveform=str(rng.choice(["triangle", "sine"])),
            periods=periods,
            samples=samples,
        )
        scan = replace(scan, start_s=_begin(scan, _end(recording)))
        with contextlib.suppress(LimitError):
            limits.check(Drive(scan.time_s, scan.drive, scan.rate_hz, scan.waveform))  # pyright: ignore
            return scan
    return replace(like, start_s=_begin(like, _end(recording)))


def _switched_on(scan: Scan, world: "World") -> Scan:
    last = world.runs[-1].scan
    return replace(scan, start_s=_begin(scan, last.start_s + last.duration_s))


def _end(recording: Recording) -> float:
    last = recording.drives[-1]
    return last.start_s + last.size * last.step_s


def _begin(scan: Scan, end_s: float) -> float:
    """First sample of a drive that is switched on a minute after the session's end, s."""
    lead = max(2.0, np.ceil(_LEAD_S * scan.rate_hz)) / scan.rate_hz
    return round(end_s + PAUSE_S + float(lead), 3)
