"""A DFB laser and a VCSEL, tuned by their current, through the commands made for a piezo's laser.

    uv run python tests/benchmarks/other_lasers.py [--laser dfb vcsel] [--diagnose] [-o FOLDER]

On a laboratory served as `rapi bench serve --laser` does: `rapi measure` of triangles at four
rates and two swings, `rapi fit`, with `--diagnose` also `rapi diagnose`, `rapi compensate`, and
`rapi measure` of the drives. Prints verdicts and the rms nonlinearity of both branches (MHz):
triangles of the same swing, the model's drives, and, at the highest rate, what learning control
leaves: from fringes, and on the device's own equations, ten times the bandwidth, without noise or
limit of slope.
"""

import argparse
import contextlib
import dataclasses
import json
import tempfile
import time
from pathlib import Path

# Scan rates (Hz), swings recorded (V), bias (V), span asked for (GHz).
PLANS = {
    "dfb": ((100.0, 200.0, 300.0, 400.0), (4.0, 3.0), 2.5, 45.0),
    "vcsel": ((250.0, 500.0, 750.0, 1000.0), (4.0, 3.0), 2.5, 450.0),
}


def rapi(*arguments):
    """A command, in this process; its exit code."""
    from fitting.cli import app
    from fitting.commands.run import run

    began = time.perf_counter()
    with contextlib.redirect_stdout(None), contextlib.redirect_stderr(None):
        code = run(app, [str(one) for one in arguments])
    print(f"rapi {arguments[0]}: {code}, {time.perf_counter() - began:.0f} s", flush=True)
    return code


def rms_mhz(run):
    """Up and down."""
    from rapi_jax import linearity

    found = linearity(run)
    return 1e3 * found.up.rms_ghz, 1e3 * found.down.rms_ghz


def write_limits(limits, path):
    """For `rapi compensate`."""
    names = ("low_v", "high_v", "slew_v_per_s", "max_frequency_hz")
    path.write_text("".join(f"{name} = {float(getattr(limits, name))}\n" for name in names))


def served(stack, laser, folder, seed):
    """`bench.toml` of a laboratory behind HiSLIP, and its bench without wires."""
    from hardware import HislipServer
    from hardware.simulated import SimulatedBench, WiredLaboratory, current_tuned_toml

    bench = getattr(SimulatedBench, laser)(seed)
    lab = WiredLaboratory(bench.laboratory, seed=seed, controller=False)
    at = stack.enter_context(lab.served(HislipServer))
    path = folder / "bench.toml"
    path.write_text(current_tuned_toml(at, bench.laboratory, limits=bench.limits))
    return path, bench


def measure(path, drives, output, periods=1):
    """`rapi measure` of drives that are already files."""
    from rapi_jax.io import read_recording

    assert rapi("measure", path, *drives, "-o", output, "--periods", periods) == 0
    return read_recording(output)


def show_verdict(folder):
    """What `fit` said."""
    model = json.loads((folder / "fit" / "model.json").read_text())
    claim = model["claim"]
    print(
        f"  fit: trusted {model['verdict']['trusted']}, with gap {model['verdict']['with_gap']}, "
        f"rmse {model['rmse']:.3g} GHz; claim {claim['rms']:.3g} ({claim['low']:.3g} to "
        f"{claim['high']:.3g}) GHz, noise {claim['noise']:.2g}"
    )
    for run in model["runs"]:
        print(
            f"    {run['excitation_hz']:g} Hz, span {run['span']:.4g} GHz: rmse "
            f"{run['rmse']:.3g} GHz, {run['rmse_fraction']:.2%}"
        )


def show_diagnosis(folder):
    """What `diagnose` said."""
    told = json.loads((folder / "diagnosis" / "diagnosis.json").read_text())
    names = {h["name"]: round(h["probability"], 3) for h in told["hypotheses"]}
    print(f"  diagnosis: {told['verdict']['name']}, set {told['verdict']['set']}; {names}")


def show_bounds(bench, drive, bias, span):
    """Learning from fringes, from a triangle and from the model's drive; and on the equations."""
    from rapi_jax import Drive, Run, learn, linear_scan

    (target,) = linear_scan(drive.rate, span=span, samples=4096)
    swing = float(drive.value.max() - drive.value.min())
    volts = bias + swing * (target.value / span - 0.5)
    triangle = Drive(target.time, volts, drive.rate, "triangle")

    def exact(one):
        return Run(one, -bench.truth(one))  # a reading rises with the drive

    def fringes(one):
        return bench.measure(one).runs[0]

    steep = dataclasses.replace(bench.limits, slew_v_per_s=1e6)
    courses = (
        ("fringes, from a triangle", fringes, triangle, bench.limits, 6, None),
        ("fringes, from the model", fringes, drive, bench.limits, 6, None),
        ("equations", exact, drive, steep, 60, 150.0 * drive.rate),
    )
    for name, play, start, limits, iterations, band in courses:
        found = learn(play, target, start, limits=limits, iterations=iterations, bandwidth_hz=band)
        ends = ", ".join(f"{up:.4g}/{down:.4g}" for up, down in 1e3 * found.rms_ghz[:7])
        up, down = 1e3 * found.rms_ghz[found.best]
        print(f"  {drive.rate:g} Hz, {name}: best {up:.4g}/{down:.4g} of {ends} ({found.stopped})")


def work(laser, folder, options):
    """All of it for one laser."""
    from rapi_jax import triangle
    from rapi_jax.io import read_drive, write_drive

    rates, swings, bias, span = PLANS[laser]
    print(f"\n{laser}: {rates} Hz, {swings} V about {bias} V")
    with contextlib.ExitStack() as stack:
        path, bench = served(stack, laser, folder, options.seed)
        drives = [
            drive
            for swing in swings
            for drive in triangle(rates, amplitude=swing, bias=bias, samples=500)
        ]
        for number, drive in enumerate(drives):
            write_drive(drive, folder / f"triangle{number}.csv")
        files = [folder / f"triangle{number}.csv" for number in range(len(drives))]
        measure(path, files, folder / "recording", periods=2)
        code = rapi("fit", folder / "recording", "-o", folder / "fit")
        show_verdict(folder)
        write_limits(bench.limits, folder / "limits.toml")
        untrusted = ("--untrusted",) if code else ()
        rapi("compensate", folder / "fit", "--span", span, "--frequency", *rates, "--bias", bias,
             "--limits", folder / "limits.toml", "-o", folder / "drives", *untrusted)  # fmt: skip
        made = [folder / "drives" / f"drive_{rate:g}Hz.csv" for rate in rates]
        after = measure(path, made, folder / "check")
        alike = [read_drive(one, waveform="triangle") for one in made]
        for number, drive in enumerate(alike):
            swing = float(drive.value.max() - drive.value.min())
            (plain,) = triangle([drive.rate], amplitude=swing, bias=bias, samples=2000)
            write_drive(plain, folder / f"plain{number}.csv")
        files = [folder / f"plain{number}.csv" for number in range(len(alike))]
        before = measure(path, files, folder / "plain")
    for rate, one, other in zip(rates, before.runs, after.runs, strict=True):
        a, b = rms_mhz(one), rms_mhz(other)
        print(
            f"  {rate:5g} Hz up {a[0]:7.1f} -> {b[0]:6.1f} ({a[0] / b[0]:.1f}), down {a[1]:7.1f} "
            f"-> {b[1]:6.1f} ({a[1] / b[1]:.1f}) MHz; span {other.span:.1f} GHz",
            flush=True,
        )
    print(f"  rapi fit --check: {rapi('fit', folder / 'check', '--check', folder / 'drives')}")
    show_bounds(bench, alike[-1], bias, span)
    if options.diagnose:
        parts = (folder / "recording", "--model", folder / "fit", "-o", folder / "diagnosis")
        rapi("diagnose", *parts)
        show_diagnosis(folder)


def main():
    """Print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--laser", nargs="+", choices=tuple(PLANS), default=tuple(PLANS))
    parser.add_argument("--diagnose", action="store_true")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    for laser in options.laser:
        with tempfile.TemporaryDirectory() as temporary:
            folder = (options.output or Path(temporary)) / laser
            folder.mkdir(parents=True, exist_ok=True)
            work(laser, folder, options)


if __name__ == "__main__":
    main()
