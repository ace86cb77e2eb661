"""Generated waveforms for the simulated generator: legal ones are played, all others send nothing.

uv run python tests/benchmarks/instrument_waveforms.py [COUNT]
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))


def main(count=100_000, seed=12):
    """Command line."""
    from generated_waveforms import KINDS, Generator, waveform

    rng, generator = np.random.default_rng(seed), Generator()
    began = time.perf_counter()
    for i in range(count):
        wave, rate = waveform(rng, KINDS[i % len(KINDS)])
        generator.try_one(wave, rate, n=1 + i % 2, start=i % 1111 == 0)
    generator.check()
    seconds = time.perf_counter() - began
    print(f"{count} waveforms, seed {seed}: {generator.counts} in {seconds:.1f} s")
    for n, seen in generator.instrument.seen.items():
        print(f"channel {n}: {seen}")


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:]))
