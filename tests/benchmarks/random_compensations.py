"""Random requests for drives: none written beyond a limit, by a check of the files alone.

    python3 -m uv run python tests/benchmarks/random_compensations.py [COUNT] [SEED]

Spans, rates, biases, corners and limits are drawn so that about three in four requests are refused.
Every CSV and generator file that is written is read by plain NumPy, with none of this package's
code, and held against the limits: level, slope, step and the step that closes the period.
"""

import contextlib
import io
import json
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

SLACK = 1e-8  # of the range: as many digits as a limit file has


def main(count: int = 1000, seed: int = 0) -> None:
    """Command line."""
    from fitting.cli import app
    from fitting.commands.run import run
    from rapi_jax import Identified
    from rapi_jax.examples import paper_device, paper_recording
    from rapi_jax.io import write_model

    rng, codes, worst = np.random.default_rng(seed), Counter(), 0.0
    with tempfile.TemporaryDirectory() as where:
        model = Path(where) / "model.rapi"
        write_model(
            model, paper_device(), response_unit="GHz", drive_unit="V", trusted=True,
            identified=Identified.of(paper_recording(samples=400)[0]).to_dict(), data_sha256="",
        )  # fmt: skip
        for i in range(count):
            out = Path(where) / f"out{i}"
            low, high = rng.uniform(-0.5, 1.5), rng.uniform(4.5, 7.5)
            limits = {
                "low_v": round(float(low), int(rng.integers(2, 7))),
                "high_v": round(float(high), int(rng.integers(2, 7))),
                "slew_v_per_s": float(10 ** rng.uniform(2, 4)),
                "step_v": float(10 ** rng.uniform(-2, 0)),
                "max_frequency_hz": float(rng.uniform(15, 60)),
            }
            path = Path(where) / "limits.toml"
            path.write_text("".join(f"{key} = {value!r}\n" for key, value in limits.items()))
            numbers = {
                "--span": rng.uniform(40, 85),
                "--frequency": rng.uniform(8, 45),
                "--corner": rng.uniform(0.01, 0.1),
                "--samples": rng.choice([512, 1024]),
            }
            if rng.random() < 0.5:
                numbers["--bias"] = rng.uniform(2, 4)
            command = ["compensate", str(model), "--limits", str(path), "-o", str(out)]
            command += ["--no-plots", *["--extrapolate"] * (rng.random() < 0.2)]
            command += [str(part) for pair in numbers.items() for part in pair]
            quiet = io.StringIO()
            with contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
                code = run(app, command)
            codes[code] += 1
            written = list(out.iterdir()) if out.is_dir() else []
            assert (code == 0) == bool(written), (command, code, written)
            for file in written:
                if file.suffix in (".csv", ".afg"):
                    worst = max(worst, _beyond(file, limits))
            if written:
                json.loads((out / "certificate.json").read_text())
    print(f"{count} requests, seed {seed}: exit codes {dict(codes)}")
    print(f"farthest beyond a limit: {worst:.2e} of the range (0: none)")
    assert worst <= SLACK


def _beyond(path: Path, limits: dict[str, float]) -> float:
    """How far the file goes beyond a limit, as a share of the range; 0 where it does not."""
    span = limits["high_v"] - limits["low_v"]
    if path.suffix == ".csv":
        time, value = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
        ends, rate = value, 1 / (time[-1] + time[1])
        step = np.abs(np.diff(value, append=value[0]))
        over = [
            (step.max() - limits["step_v"]) / span,
            (step.max() - limits["slew_v_per_s"] * time[1]) / span,
        ]
    else:
        head = dict(
            line[2:].split(" = ") for line in path.read_text().splitlines() if " = " in line
        )
        ends = np.array([float(head["low_v"]), float(head["high_v"])])
        rate, over = float(head["frequency_hz"]), []
    over += [(ends.max() - limits["high_v"]) / span, (limits["low_v"] - ends.min()) / span]
    over += [rate / limits["max_frequency_hz"] - 1]
    return max(0.0, *over)


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:]))
