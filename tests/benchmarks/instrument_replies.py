"""Generated replies of an instrument: right, spoilt and hostile ones, and what came of them.

    uv run python tests/benchmarks/instrument_replies.py [COUNT]

Every promise is asserted for each: the right value or one error, within twice the deadline.
"""

import resource
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))


def main(count=100_000, seed=11):
    """Command line."""
    from generated_replies import try_one

    rng, outcomes, slowest = np.random.default_rng(seed), Counter(), 0.0
    for _ in range(1000):  # what is loaded once
        try_one(rng)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = time.perf_counter()
    for _ in range(count):
        start = time.perf_counter()
        outcomes[try_one(rng)] += 1
        slowest = max(slowest, time.perf_counter() - start)
    seconds = time.perf_counter() - began
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    print(f"{count} replies, seed {seed}: {dict(outcomes)} in {seconds:.1f} s")
    print(f"slowest {slowest * 1e3:.1f} ms of real time; memory grew by {grown:.1f} MB")


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:]))
