"""How often what a fit claims holds: new runs and compensated scans of other simulated lasers.

    python3 -m uv run python -m tests.benchmarks.claims [--count N] [--first SEED] [--kind KIND]

Lasers of the simulator that shares no code with the model, half of them with a base that the model
fits only nearly, without an effect or with a listed one at up to 20 times the noise. A fit of the
session's runs claims an interval for the error of another run; a new run at a rate and a swing
between those recorded, read with noise, is inside or not. A scan compensated by the model is
straight to within what the certificate expects, or not. One line a laser, then the shares.
"""

import argparse
import os
import warnings
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from fitting import CertifiedDrive, FitResult, check_claim, check_scan, identify
from fitting.blind.realised._model_response import to_drive
from fitting.blind.simulator._scan import Scan, place_in_time, scan_from_samples
from fitting.blind.simulator._simulated_device import Run as SimulatedRun
from fitting.blind.simulator._simulated_device import SimulatedDevice, draw_device
from fitting.claim_check._check import Checked
from rapi_jax import (
    DataError,
    Identified,
    LimitError,
    ModelError,
    NotInvertible,
    Recording,
    compensate,
    linear_scan,
)

NEW_RUNS, PERIODS, SAMPLES, MOST_SIGMA = 3, 3, 400, 20.0
RENEWED = 50  # recordings; what is compiled for their shapes fills a process's memory maps


@dataclass(frozen=True)
class Row:
    """One laser: what was measured of new runs and of a scan, beside what was claimed; GHz."""

    seed: int
    effect: str
    end: str
    runs: tuple[Checked, ...] = ()
    branches: tuple[Checked, ...] = ()


def recorded(runs: tuple[SimulatedRun, ...]) -> Recording:
    """Runs of a simulated session as a recording."""
    return Recording.of([to_drive(run.scan) for run in runs], [run.response for run in runs])


def judge(seed: int, kind: str) -> Row:
    """Fit one laser, and hold new runs and a compensated scan against the claim."""
    rng = np.random.default_rng([seed, 99])
    sigma = float(rng.uniform(0.0, MOST_SIGMA))
    device = draw_device(seed, kind, None, None if kind == "null" else sigma)
    effect = "+".join(device.truth) or "none"
    recording = recorded(device.runs)
    try:
        result = identify(recording, each=(), throw=False)
    except (DataError, ModelError) as error:
        return Row(seed, effect, f"refused: {error}"[:90])
    claim = result.claim
    if not result.verdict.trusted or claim is None:
        return Row(seed, effect, f"not trusted: {result.verdict.reasons[0]}"[:90])
    like = device.runs[-1].scan
    scans = [
        replace(
            like,
            rate_hz=float(rng.uniform(*claim.rates_hz)),
            swing=float(rng.uniform(*claim.swings)),
            waveform="triangle",
            periods=PERIODS,
            samples=SAMPLES,
            phase=0.0,
        )
        for _ in range(NEW_RUNS)
    ]
    begin = like.start_s + like.duration_s + 2.0
    runs = check_claim(
        result.ecdl,
        recorded(device.measure(place_in_time(scans, begin), seed=1)),
        claim=claim,
    )
    return Row(seed, effect, "trusted", runs.checked, _branches(device, result, recording, rng))


def _branches(
    device: SimulatedDevice, result: FitResult, recording: Recording, rng: np.random.Generator
) -> tuple[Checked, ...]:
    """Both branches of a compensated scan, measured; nothing where there is no drive."""
    assert result.claim is not None
    rate = float(rng.uniform(*result.claim.rates_hz))
    full = max(run.span for run in recording.runs)
    (target,) = linear_scan([rate], span=float(rng.uniform(0.6, 0.9)) * full, samples=2000)
    try:
        made = compensate(result.ecdl, target, identified=Identified.of(recording))
    except (ModelError, LimitError, NotInvertible):
        return ()
    last = device.runs[-1].scan
    played: Scan = scan_from_samples(np.asarray(made.drive.value), rate, periods=PERIODS)
    begin = last.start_s + last.duration_s + 60.0
    measured = recorded(device.measure(place_in_time([played], begin), seed=2))
    certified = CertifiedDrive(replace(made.drive, start_s=0.0))
    return check_scan([certified], measured, claim=result.claim).checked


def _start(job: tuple[int, str]) -> Row:
    warnings.simplefilter("ignore")
    return judge(*job)


def main() -> None:
    """Print a line a laser, and the shares."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--first", type=int, default=70_000)
    parser.add_argument("--kind", nargs="*", default=["null", "listed"])
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.count)
    jobs = [(seed, options.kind[k % len(options.kind)]) for k, seed in enumerate(seeds)]
    inside: list[bool] = []
    straight: list[bool] = []
    ends: dict[str, int] = {}
    with get_context("spawn").Pool(options.processes, maxtasksperchild=RENEWED) as pool:
        for row in pool.imap(_start, jobs):
            print(
                f"{row.seed} {row.effect:<24} {row.end}; runs {_shown(row.runs)}; scan "
                f"{_shown(row.branches)}",
                flush=True,
            )
            end = row.end.split(":")[0]
            ends[end] = ends.get(end, 0) + 1
            inside += [_is_inside(one) for one in row.runs if not one.outside]
            straight += [_is_inside(one) for one in row.branches if not one.outside]
    print(
        f"{ends}; runs inside {np.mean(inside):.3f} of {len(inside)}, branches of scans "
        f"{np.mean(straight):.3f} of {len(straight)}"
    )


def _is_inside(one: Checked) -> bool:
    return one.low <= one.rms <= one.high


def _shown(found: tuple[Checked, ...]) -> str:
    """Measured and claimed, MHz."""
    return ", ".join(
        f"{1e3 * one.rms:.4g} ({1e3 * one.low:.4g} to {1e3 * one.high:.4g})"
        f"{'' if not one.outside else ' not judged'}"
        for one in found
    )


if __name__ == "__main__":
    main()
