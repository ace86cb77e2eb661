"""Seconds of the first fit in a cold process, imports and compilation included, and of the next.

    uv run python tests/benchmarks/cold.py

The paper's device, 4 runs of 4000 samples, from the recording to the verdict with held-out refits.
"""

import time

BEGAN = time.perf_counter()


def main():
    """Command line."""
    from fitting import fit
    from rapi_jax import ECDL, RAPI
    from rapi_jax.examples import paper_recording

    recording, _ = paper_recording()
    for name in ("first, with imports", "next"):
        began = BEGAN if name.startswith("first") else time.perf_counter()
        result = fit(ECDL(RAPI.guess(recording)), recording)
        seconds = time.perf_counter() - began
        print(f"{name:<20} {seconds:6.2f} s   trusted: {result.verdict.trusted}")


if __name__ == "__main__":
    main()
