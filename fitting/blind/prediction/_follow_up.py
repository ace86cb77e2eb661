"""Second measurements of ambiguous devices: with the advised scan, and with a random one.

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

from fitting.blind.protocol._answers import read_answer, read_spec
from fitting.blind.protocol._exchange import to_run, write_verified
from fitting.blind.protocol._folder import BankFolder, make_folder, read_json, refuse_unknown_files
from fitting.blind.protocol._frozen import tree_sha256
from fitting.blind.simulator._scan import Scan, scan_from_samples
from rapi_jax import Drive, Identified, LimitError, Recording
from rapi_jax.io import read_drive, read_recording

from ._predict import NEXT, recording_seed
from ._predictions import Progress, close_predictions, run_missing
from ._thresholds import THRESHOLDS
from ._workers import Job

if TYPE_CHECKING:
    from fitting.blind.simulator._simulated_device import SimulatedDevice

KINDS = ("advised", "random")
CLOSED = "predictions.json"
PAUSE_S = 60.0
_LEAD_S = 0.1  # a drive is on for this long, and two periods, before its first sample


@dataclass(frozen=True)
class FollowUp:
    """The predictions of one device after the advised scan and after the random one."""

    name: str
    advised: Path
    random: Path


def select_ambiguous(predictions: dict[str, dict[str, Any]]) -> list[str]:
    """Names of the recordings with several causes in the set, and a scan advised."""
    return [
        name
        for name, prediction in predictions.items()
        if len(prediction.get("diagnosis", {}).get("verdict", {}).get("set", ())) > 1
        and NEXT in prediction["files"]
        and prediction["withheld"] is None
    ]


def closed_follow_ups(folder: BankFolder, predictions: dict[str, dict[str, Any]]) -> list[FollowUp]:
    """The second predictions that were closed."""
    promised = read_json(folder.follow / CLOSED).get("sha256", {})
    return follow_up_paths(
        folder, [name for name in select_ambiguous(predictions) if f"{KINDS[0]}/{name}" in promised]
    )


def follow_up_paths(folder: BankFolder, names: Sequence[str]) -> list[FollowUp]:
    """Where the second predictions of these recordings are."""
    places = [folder.follow / kind / "predictions" for kind in KINDS]
    return [FollowUp(name, *(place / f"{name}.json" for place in places)) for name in names]


def files_by_key(found: Sequence[FollowUp]) -> dict[str, Path]:
    """The second predictions under the names by which they are closed."""
    return {f"{kind}/{p.name}": getattr(p, kind) for p in found for kind in KINDS}


def follow_up(
    folder: BankFolder,
    predictions: dict[str, dict[str, Any]],
    *,
    most: int | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Measure the first `most`, diagnose and close; what is there already is kept."""
    names, tree, jobs = (
        select_ambiguous(predictions)[: THRESHOLDS.follow_ups if most is None else most],
        tree_sha256(),
        [],
    )
    make_folder(folder.follow)
    for kind in KINDS:
        refuse_unknown_files(folder.follow / kind / "recordings", set(names))
        make_folder(folder.follow / kind / "recordings")
    for name in names:
        value, _ = read_answer(folder, name)
        device = read_spec(value).draw()
        first = read_recording(folder.recordings / name)
        advised = read_advised_scan(folder, name, predictions[name], device)
        scans = {"advised": advised, "random": draw_random_scan(first, advised)}
        for number, kind in enumerate(KINDS):
            place = folder.follow / kind
            second = append_run(first, device, scans[kind], 1 + number)
            write_verified(second, place / "recordings" / name)
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
    run_missing(folder, jobs, workers=workers, progress=progress)
    close_predictions(folder.follow / CLOSED, files_by_key(follow_up_paths(folder, names)), tree)


def append_run(first: Recording, device: "SimulatedDevice", scan: Scan, seed: int) -> Recording:
    """The recorded session with one more run of the same device."""
    run = device.measure([*(run.scan for run in device.runs), scan], seed)[-1]
    return replace(first, runs=(*first.runs, to_run(run, f"run{len(first.runs):02d}")))


def read_advised_scan(
    folder: BankFolder, name: str, prediction: dict[str, Any], device: "SimulatedDevice"
) -> Scan:
    """The scan of a prediction's `next_drive.csv`, as the laboratory plays it."""
    said = prediction["diagnosis"]["next_scan"]
    whole = read_drive(folder.predictions / name / NEXT, waveform=said["waveform"])
    rate = said["excitation_hz"]
    periods = 1 if rate is None else max(round(rate * whole.size * whole.step_s), 1)
    samples = whole.size // periods
    hz = 1 / (samples * whole.step_s) if rate is None else float(rate)
    scan = scan_from_samples(whole.value[:samples], hz, periods=periods, waveform=said["waveform"])
    if scan.waveform in ("triangle", "sine"):
        plain = replace(scan, swing=said["amplitude"], bias=said["bias"], table=None)
        if np.allclose(plain.drive, whole.value, rtol=0, atol=1e-6 * plain.swing):
            scan = plain  # known between its samples too
    return _start_after_session(scan, device)


def draw_random_scan(recording: Recording, like: Scan) -> Scan:
    """A triangle or sine, drawn from the recording's content, as long as `like`.

    Rates from half the slowest to ten times the fastest, evenly in the logarithm; swings from an
    eighth to the whole of the range recorded and 5 % more, at any bias that fits; no steeper than
    an advised scan may be. Steps have no period: their time is cut into five.
    """
    rng = np.random.default_rng([recording_seed(recording), 1])
    limits = Identified.of(recording).limits()
    span = limits.high_v - limits.low_v
    rates = [rate for rate in recording.rates if rate > 0]
    periods = like.periods if like.periods > 1 else 5
    samples = like.samples if like.periods > 1 else max(like.samples // 5, 16)
    for _ in range(THRESHOLDS.scan_draws):
        swing = float(rng.uniform(0.125, 1.0)) * span
        scan = Scan(
            rate_hz=float(np.exp(rng.uniform(np.log(min(rates) / 2), np.log(10 * max(rates))))),
            swing=swing,
            bias=limits.low_v + swing / 2 + float(rng.uniform()) * (span - swing),
            waveform=str(rng.choice(["triangle", "sine"])),
            periods=periods,
            samples=samples,
        )
        scan = replace(scan, start_s=_start_s(scan, _end_s(recording)))
        with contextlib.suppress(LimitError):
            limits.check(Drive(scan.time_s, scan.drive, scan.rate_hz, scan.waveform))  # pyright: ignore
            return scan
    return replace(like, start_s=_start_s(like, _end_s(recording)))


def _start_after_session(scan: Scan, device: "SimulatedDevice") -> Scan:
    last = device.runs[-1].scan
    return replace(scan, start_s=_start_s(scan, last.start_s + last.duration_s))


def _end_s(recording: Recording) -> float:
    last = recording.drives[-1]
    return last.start_s + last.size * last.step_s


def _start_s(scan: Scan, end_s: float) -> float:
    """First sample of a drive that is switched on a minute after the session's end, s."""
    lead = max(2.0, np.ceil(_LEAD_S * scan.rate_hz)) / scan.rate_hz
    return round(end_s + PAUSE_S + float(lead), 3)
