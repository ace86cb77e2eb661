"""One size in a process of its own: `KIND SAMPLES PLAYS RUNS RECORDINGS`, figures as JSON.

`forward`: `predict` of one drive of ten periods. `free`: of one that never repeats. `fit`: the
solver alone on each recording, ten parameters; samples are those of a run.

Seconds are the least of several warm calls. Bytes are the peak above what was in memory before the
first call at this size, so with its compilation, once the same work was done at a small size.
"""

import json
import sys
import time
from collections.abc import Callable

import numpy as np

from rapi_jax import ECDL, predict

from ._cases import case, device, free_drive, periodic_drive, recorded
from ._memory import peak_above, resident
from ._ours import bare

SMALL = 256  # samples
FEWEST, LONGEST = 3, 20.0  # calls, unless they take so many s
MOST, ENOUGH = 20, 0.5  # calls, or s of calls


def forward(kind: str, samples: int, plays: int) -> Callable[[], int]:
    """A call that predicts; it returns 1, the number of passes."""
    ecdl = ECDL(device(plays))
    drive = periodic_drive(samples) if kind == "forward" else free_drive(samples, samples // 50)

    def call() -> int:
        np.asarray(predict(ecdl, drive))
        return 1

    return call


def fit(samples: int, plays: int, runs: int, recordings: int) -> Callable[[], int]:
    """A call that fits every recording; it returns the number of solver steps."""
    spread = 0.1 if recordings > 1 else 0.0
    made = (
        recorded(samples=samples, runs=runs, plays=plays, seed=i, spread=spread)
        for i in range(recordings)
    )
    cases = [case(recording, plays=plays) for recording in made]
    return lambda: sum(bare(one).solver.steps for one in cases)


def measured(call: Callable[[], int]) -> dict[str, float]:
    """Seconds of the fastest warm call, steps of one, and peak memory of the first."""
    before = resident()
    began = time.perf_counter()
    steps = call()
    first, high = time.perf_counter() - began, peak_above(before)
    seconds: list[float] = []
    while _short(seconds):
        began = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - began)
    return {"seconds": min(seconds), "first": first, "steps": steps, "bytes": high}


def _short(seconds: list[float]) -> bool:
    """Whether more calls are wanted."""
    total, calls = sum(seconds), len(seconds)
    limit, most = (LONGEST, FEWEST) if calls < FEWEST else (ENOUGH, MOST)
    return calls == 0 or (total < limit and calls < most)


def main() -> None:
    """Command line."""
    kind = sys.argv[1]
    samples, plays, runs, recordings = (int(number) for number in sys.argv[2:])
    if kind == "fit":
        fit(SMALL, plays, runs, 1)()
        call = fit(samples, plays, runs, recordings)
    else:
        forward(kind, SMALL, plays)()
        call = forward(kind, samples, plays)
    print(json.dumps(measured(call)))


if __name__ == "__main__":
    main()
