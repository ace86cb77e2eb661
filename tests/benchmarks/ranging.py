"""Ranging through the simulated laboratory: the paper's Tables 2 to 4, beside its figures.

    python3 -m uv run python -m tests.benchmarks.ranging static [--sample-hz HZ] [--quiet]
    python3 -m uv run python -m tests.benchmarks.ranging moving [--sample-hz HZ] [--quiet]
    python3 -m uv run python -m tests.benchmarks.ranging coverage [--replicates N]
    python3 -m uv run python -m tests.benchmarks.ranging tracking [--replicates N]
    python3 -m uv run python -m tests.benchmarks.ranging speed
    python3 -m uv run python -m tests.benchmarks.ranging figure2

The laboratory is `SimulatedBench.like_paper_range`, whose disturbances were fixed by uncompensated
distances alone; `--quiet` switches vibration, wander and noise of the cavity off. The laser is
identified on the same bench, from 10 to 40 Hz, and scanned at 10 Hz by the plain triangle, by the
paper's inverse and by the exact one. `coverage` counts how often 95 % intervals hold the truth,
from raw fringes on, `tracking` from scans' distances on; `speed` is the time of reading over that
of recording.
"""

import argparse
import time
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from fitting import identify, identify_inverse
from hardware import SimulatedBench
from hardware.simulated import ConstantVelocity, Target
from rapi_jax import Drive, Identified, compensate, linear_scan, triangle
from rapi_jax.ranging._range import range_records
from rapi_jax.ranging._ranging import Ranging

RATE, AMPLITUDE, BIAS = 10.0, 4.5, 3.0
NODES_M = 0.598 + 0.02 * np.arange(10)
SPEEDS = (5e-3, 10e-3, 20e-3, 30e-3, 40e-3, 50e-3)
METHODS = ("counting-region", "counting", "resample-fft", "resample-phase")
PAPER_STD = {
    "triangle": (53.68, 55.98, 58.25, 57.10, 43.26, 50.03, 45.61, 51.92, 45.58, 47.86),
    "paper": (6.65, 7.85, 7.20, 9.79, 6.41, 7.72, 5.65, 7.61, 6.15, 7.57),
}
PAPER_STEPS = {
    "triangle": (-27.77, 32.54, -20.97, -26.50, 30.43, -31.41, -26.76, 42.97, 23.93),
    "paper": (11.56, -9.99, -2.37, 9.77, 10.23, -4.16, 6.07, -6.63, 11.29),
}
PAPER_SPEED = {
    "triangle": (52.24, -61.80, 74.23, 40.99, 53.48, 40.81),
    "paper": (16.44, -23.65, -13.79, 12.14, -9.30, 10.41),
}


def drives(span_ghz: float = 73.0) -> dict[str, Drive]:
    """The plain triangle and both inverses' drives, the laser identified on a quiet bench."""
    bench = SimulatedBench.like_paper_range(
        Target(0.7), vibration=False, wander=False, cavity_noise=False
    )
    training = bench.measure(triangle([10, 20, 30, 40], amplitude=AMPLITUDE, bias=BIAS, periods=2))
    model = identify(training)
    (plain,) = triangle([RATE], amplitude=AMPLITUDE, bias=BIAS)
    (target,) = linear_scan(RATE, span=span_ghz)
    known = Identified.of(training)
    options: dict[str, Any] = {"identified": known, "limits": bench.limits}
    exact = compensate(model.ecdl, target, **options)
    inverse = identify_inverse(training, model, throw=False)
    paper = compensate(inverse.ecdl, target, **options)
    return {"triangle": plain, "paper": paper.drive, "exact": exact.drive}


def ranged(bench: SimulatedBench, drive: Drive, seconds: float) -> Iterator[tuple[str, Ranging]]:
    """The same records by every method."""
    periods = round(seconds * RATE)
    records = bench.range_records(drive, periods=10, records=periods // 10)
    for method in METHODS:
        yield method, range_records(records, method=method)


def static(args: argparse.Namespace) -> None:
    """Ten nodes of 5 s: Tables 2 and 3."""
    spread: dict[tuple[str, str], list[float]] = {}
    tracked: dict[tuple[str, str], list[float]] = {}
    mean: dict[tuple[str, str], list[float]] = {}
    made = drives()
    for node, where in enumerate(NODES_M):
        for name, drive in made.items():
            target = Target(float(where))
            bench = _bench(target, args, seed=node)
            for method, result in ranged(bench, drive, args.seconds):
                good = np.isfinite(result.distance)
                key = (name, method)
                spread.setdefault(key, []).append(1e6 * float(np.std(result.table.path[good])))
                track = result.target.track
                assert track is not None
                tracked.setdefault(key, []).append(1e6 * float(np.std(track.distance)))
                off = 1e6 * (float(np.mean(result.table.path[good])) - float(where))
                mean.setdefault(key, []).append(off)
        print(f"node {node + 1} of 10", flush=True)
    for name in made:
        print(f"\n{name}: standard deviation of a scan (um), node by node")
        if name in PAPER_STD:
            _row("the paper", PAPER_STD[name])
        for method in METHODS:
            _row(method, spread[name, method])
        for method in METHODS:
            _row(f"{method}, filtered", tracked[name, method])
        print(f"{name}: deviation of the steps between nodes (um)")
        if name in PAPER_STEPS:
            _row("the paper", PAPER_STEPS[name])
        for method in METHODS:
            _row(method, np.diff(mean[name, method]))
    print("\nlargest standard deviation, and largest deviation of a step: triangle over inverse")
    for method in METHODS:
        for name in ("paper", "exact"):
            std = max(spread["triangle", method]) / max(spread[name, method])
            step = _largest(mean["triangle", method]) / _largest(mean[name, method])
            print(f"{method:24} {name:6} {std:6.2f} {step:6.2f}")


def moving(args: argparse.Namespace) -> None:
    """Constant speeds for 2 s: Table 4."""
    made = drives()
    print("deviation of the velocity, um/s (standard error)")
    for name in PAPER_SPEED:
        _row(f"the paper, {name}", PAPER_SPEED[name])
    for name, drive in made.items():
        rows: dict[str, list[str]] = {}
        for number, speed in enumerate(SPEEDS):
            bench = _bench(Target(0.6) + ConstantVelocity(speed), args, seed=number)
            for method, result in ranged(bench, drive, 2.0):
                track = result.target.track
                if track is None:
                    rows.setdefault(method, []).append("none")
                    continue
                off = 1e6 * (float(np.mean(track.velocity)) - speed)
                error = 1e6 * float(np.mean(track.velocity_stderr))
                rows.setdefault(method, []).append(f"{off:.2f} ({error:.2f})")
        for method, row in rows.items():
            print(f"{name:9} {method:16} " + " ".join(f"{one:>16}" for one in row), flush=True)


def coverage(args: argparse.Namespace) -> None:
    """Shares of 95 % intervals that hold the truth: scans, track, velocity; from raw fringes on."""
    (drive,) = triangle([RATE], amplitude=AMPLITUDE, bias=BIAS)
    for name, velocity, shaken in (("rest", 0, False), ("shaken", 0, True), ("moving", 0.02, True)):
        held: dict[str, list[float]] = {"scans": [], "track": [], "velocity": []}
        for seed in range(args.replicates):
            target = Target(0.6 + 2e-4 * seed) + ConstantVelocity(velocity)
            bench = SimulatedBench.like_paper_range(
                target, seed, sample_hz=1e6, vibration=shaken, wander=True, cavity_noise=True
            )
            records = bench.range_records(drive, periods=10)
            # The wavelength is known as well as its standard error says.
            off_m = np.random.default_rng(seed).standard_normal() * records.wavelength_stderr_m
            records = records.replace(wavelength_m=records.wavelength_m + off_m)
            result = range_records(records, expected_m=(0.3, 1.5))
            track, arm = result.target.track, bench.laboratory.measurement
            assert track is not None and arm is not None
            truth = arm.target.distance(result.time_s)
            for key, off, error in (
                ("scans", result.distance - truth, result.stderr),
                ("track", track.distance - truth, track.distance_stderr),
                ("velocity", track.velocity - velocity, track.velocity_stderr),
            ):
                held[key].append(float(np.mean(np.abs(off) < 1.96 * error)))
        shares = "  ".join(f"{key} {np.mean(value):.3f}" for key, value in held.items())
        print(f"{name:8} {shares}", flush=True)


def tracking(args: argparse.Namespace) -> None:
    """The same from the distances of scans on, as a track sees them."""
    import sys

    sys.path.insert(0, "tests/support")
    from tracked_shares import shares

    speeds = [("constant", v) for v in (0.0, *SPEEDS)]
    for motion, velocity in (*speeds, ("vibrating", 0.0), ("stage", 0.05), ("stage", 0.01)):
        distances, velocities = shares(motion, velocity, args.replicates)
        print(f"{motion:10} {velocity:6.3f} m/s: {distances:.3f} {velocities:.3f}", flush=True)


def speed(args: argparse.Namespace) -> None:
    """Seconds of a record ranged in a second: raw at 30 MS/s, and 1000 scans at 1 MS/s."""
    (drive,) = triangle([RATE], amplitude=AMPLITUDE, bias=BIAS)
    for hz, seconds in ((30e6, 2.0), (1e6, 50.0)):
        bench = SimulatedBench.like_paper_range(Target(0.7), sample_hz=hz)
        records = bench.range_records(drive, periods=round(seconds * RATE))
        for method in METHODS:
            range_records(records, method=method)
            began = time.perf_counter()
            result = range_records(records, method=method)
            took = time.perf_counter() - began
            print(
                f"{hz / 1e6:.0f} MS/s {method:16} {result.table.size} scans in {took:.2f} s, "
                f"{seconds / took:.1f} times as fast as they are recorded",
                flush=True,
            )
    del args


def _bench(target: Target, args: argparse.Namespace, seed: int) -> SimulatedBench:
    loud = not args.quiet
    return SimulatedBench.like_paper_range(
        target,
        seed,
        sample_hz=args.sample_hz,
        vibration=loud and not args.no_vibration,
        wander=loud,
        cavity_noise=loud,
    )


def _largest(means: list[float]) -> float:
    return float(np.abs(np.diff(means)).max())


def _row(name: str, values) -> None:
    largest = max(abs(float(value)) for value in values)
    print(f"  {name:28} " + " ".join(f"{v:7.2f}" for v in values) + f"   largest {largest:.2f}")


def figure2(args: argparse.Namespace) -> None:
    """Fig. 2: phase from one cavity peak to the fourth next, straight and bent, and Eq. (4)'s."""
    del args
    light, distance, spacing, beta = 299_792_458.0, 0.07, 1.5e9, 3600e9
    delay = 2 * distance / light
    t = np.linspace(-1e-3, 6e-3, 2_000_001)
    for name, gamma in (("straight", 0.0), ("bent", 2.5e15)):
        nu = beta * t + gamma * t**2  # Eq. (3), from the first peak on
        nu = nu[t > -beta / (2 * gamma) if gamma else slice(None)]
        own = t[-nu.size :]
        ends = np.interp([0.0, 4 * spacing], nu, own)
        halves = np.arange(np.ceil(nu[0] * delay * 2), nu[-1] * delay * 2)
        extrema = np.interp(halves / 2 / delay, nu, own)
        true = 2 * np.pi * delay * 4 * spacing
        by_time = np.pi * float(np.diff(np.interp(ends, extrema, halves))[0])  # Eq. (4)
        off = (by_time / true - 1) * distance
        print(
            f"{name:9} {1e3 * np.diff(ends)[0]:.3f} ms, phase {true:.4f} rad, by Eq. (4) "
            f"{by_time:.4f} rad: {1e6 * off:+.1f} um of {1e3 * distance:.0f} mm"
        )
        for part in np.linspace(0, 1, 5):
            at = ends[0] + part * (ends[1] - ends[0])
            phase = 2 * np.pi * delay * float(np.interp(at, own, nu))
            print(f"    {1e3 * at:6.3f} ms {phase:8.4f} rad")


TABLES = {
    "figure2": figure2,
    "static": static,
    "moving": moving,
    "coverage": coverage,
    "tracking": tracking,
    "speed": speed,
}


def main() -> None:
    """Run one of the tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("table", choices=list(TABLES))
    parser.add_argument("--sample-hz", type=float, default=30e6)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--replicates", type=int, default=300)
    parser.add_argument("--no-vibration", action="store_true", help="all else as it is")
    parser.add_argument("--quiet", action="store_true")
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    began = time.perf_counter()
    TABLES[args.table](args)
    print(f"\n{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
