"""Many recordings, each with a small fit: one process of ours against joblib, SciPy and Numba."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from joblib import Parallel, delayed  # pyright: ignore[reportMissingImports]

from ._cases import Case, case, peer_values, recorded
from ._hooks import NOT_YET, batch_fit
from ._ours import bare, fitted, start_cost
from ._paired import Row, check_equal, compared, take_turns
from ._peer_fit import cost_at, peer_fit

PROCESSES = 2
START_AGREES, END_AGREES = 1e-10, 1e-6  # relative, as for one fit
PEER = f"joblib on {PROCESSES} processes, SciPy + Numba, closed Jacobian"
LOOP, WHOLE, BATCH = "solver alone, a loop", "`fit`, a loop", "one batch"


def made(count: int, samples: int = 500) -> list[Case]:
    """Recordings of devices that differ by some 10 %, each with noise of its own."""
    return [case(recorded(samples=samples, seed=i, spread=0.1)) for i in range(count)]


def by_peer(pool: Any, cases: list[Case]) -> list[float]:
    """Final costs by the peer."""
    work = (delayed(_one)(c.values, c.shape, c.runs) for c in cases)
    return list(pool(work))


def _one(values, shape, runs) -> float:
    return peer_fit(values, shape, runs, analytic=True).cost


def _ends(results: Any, cases: list[Case]) -> np.ndarray:
    """Final costs of our results, by the peer's model."""
    return np.array(
        [
            cost_at(peer_values(result.ecdl.operator), c.shape, c.runs)
            for result, c in zip(results, cases, strict=True)
        ]
    )


def rows(rounds: int, count: int) -> Iterator[Row]:
    """`count` fits of 4 x 500 samples, ten parameters."""
    cases = made(count)
    own = [start_cost(c) for c in cases]
    for c, ours in zip(cases, own, strict=True):
        check_equal("cost at a start", ours, cost_at(c.values, c.shape, c.runs), START_AGREES)
    batch = batch_fit()
    work = f"{count} fits, 4 x {cases[0].runs.u.shape[1]}, {cases[0].size} parameters"
    # batch_size "auto" grows only slowly from 1; chunks are what a user would set.
    with Parallel(n_jobs=PROCESSES, batch_size=max(count // (8 * PROCESSES), 1)) as pool:
        peer = np.array(by_peer(pool, cases))  # starts the processes, compiles
        end = {
            LOOP: np.array([bare(c).cost for c in cases]),
            WHOLE: _ends([fitted(c) for c in cases], cases),
        }
        ways = {
            LOOP: lambda: [bare(c) for c in cases],
            PEER: lambda: by_peer(pool, cases),
            WHOLE: lambda: [fitted(c) for c in cases],
        }
        if batch is not None:
            end[BATCH] = _ends(batch(cases), cases)
            ways[BATCH] = lambda: batch(cases)
        seconds = take_turns(ways, rounds)
    for name, costs in end.items():
        higher = int(np.sum(costs > peer * (1.0 + END_AGREES)))
        lower = int(np.sum(costs < peer * (1.0 - END_AGREES)))
        note = f"ours ended higher in {higher}, lower in {lower}" if higher or lower else ""
        sums = dict(
            start_cost=float(sum(own)), ours_cost=float(costs.sum()), peer_cost=float(peer.sum())
        )
        yield compared(work, name, PEER, seconds, note=note, **sums)
    if batch is None:
        yield Row(work, BATCH, PEER, None, None, note=NOT_YET)
