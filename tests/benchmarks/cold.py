"""Seconds of the first fit in a cold process, imports and compilation included, and of the next.

    uv run python tests/benchmarks/cold.py

The paper's device, 4 runs of 4000 samples, from the recording to the verdict with held-out refits.
Then `rapi fit` with its defaults, pictures included, as processes of their own: with nothing
compiled, and twice with what the first has kept. Processor time is that of all cores.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

BEGAN = time.perf_counter()


def main():
    """Command line."""
    from fitting import fit
    from rapi_jax import ECDL, RAPI
    from rapi_jax.examples import paper_recording
    from rapi_jax.io import write_recording

    recording, _ = paper_recording()
    for name in ("first, with imports", "next"):
        began = BEGAN if name.startswith("first") else time.perf_counter()
        result = fit(ECDL(RAPI.guess(recording)), recording)
        seconds = time.perf_counter() - began
        print(f"{name:<32} {seconds:6.2f} s   trusted: {result.verdict.trusted}")
    with tempfile.TemporaryDirectory() as folder:
        write_recording(recording, Path(folder) / "recording")
        for name in ("nothing compiled", "all compiled", "again"):
            seconds, processor = command(Path(folder))
            print(f"{'rapi fit, ' + name:<32} {seconds:6.2f} s   processor: {processor:6.2f} s")


def command(folder: Path) -> tuple[float, float]:
    """Seconds of `rapi fit` as a process, and its processor time."""
    settings = {k: v for k, v in os.environ.items() if not k.startswith(("JAX_", "RAPI_"))}
    settings["RAPI_CACHE_DIR"] = str(folder / "kept")
    arguments = ("fit", folder / "recording", "-o", folder / "result", "--json")
    before, began = os.times(), time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "fitting.cli", *map(str, arguments)],
        env=settings, stdout=subprocess.DEVNULL, check=True,
    )  # fmt: skip
    seconds, after = time.perf_counter() - began, os.times()
    used = after.children_user + after.children_system
    return seconds, used - before.children_user - before.children_system


if __name__ == "__main__":
    main()
