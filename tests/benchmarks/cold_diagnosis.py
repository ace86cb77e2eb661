"""Seconds of the first diagnosis in a cold process, imports and compilation included, and of later.

    uv run python tests/benchmarks/cold_diagnosis.py

The paper's device with an effect, 8 runs of 5 periods of 780 samples: 31 200 in all, every listed
effect a candidate, the next scan looked for. The recordings are made by another process, so that
nothing is compiled beforehand.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

BEGAN = time.perf_counter()
ROOT = Path(__file__).parents[1]
NAMES = ("etalon", "amplifier_lowpass", "creep", "mode_hop", "etalon")


def make(folder: Path) -> None:
    """The recordings, 20 MHz of noise."""
    sys.path.insert(0, str(ROOT / "support"))
    from worlds import TRUTHS, drives, recorded

    from rapi_jax.io import write_recording

    session = drives((10.0, 20.0, 30.0, 40.0), (2.0, 3.0), periods=5, samples=780)
    for i, name in enumerate(NAMES):
        recording = recorded([TRUTHS[name]], noise=0.02, seed=i, session=session)
        write_recording(recording, folder / f"{i}_{name}")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--make", type=Path, help="write the recordings there and end")
    args = parser.parse_args()
    if args.make:
        make(args.make)
        return
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, __file__, "--make", folder], check=True)
        made = time.perf_counter() - BEGAN
        from fitting import diagnose
        from rapi_jax.io import read_recording

        for i, path in enumerate(sorted(Path(folder).iterdir())):
            began = time.perf_counter()
            report = diagnose(None, read_recording(path))
            seconds = time.perf_counter() - (began if i else BEGAN + made)
            print(f"{path.name:<22} {seconds:6.2f} s   {report.verdict.name}", flush=True)


if __name__ == "__main__":
    main()
