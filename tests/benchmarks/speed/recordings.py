"""Many recordings, each with a small fit: one process of ours against joblib, SciPy and Numba."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from joblib import Parallel, delayed  # pyright: ignore[reportMissingImports]

from fitting import fit_many

from ._cases import Case, case, peer_values, recorded
from ._ours import bare, bare_many, fitted, start_cost
from ._paired import Row, check_equal, compared, take_turns
from ._peer_fit import cost_at, peer_fit

PROCESSES = 2
START_AGREES, END_AGREES = 1e-10, 1e-6  # relative, as for one fit
PEER = f"joblib on {PROCESSES} processes, SciPy + Numba, closed Jacobian"
LOOP, WHOLE = "solver alone, a loop", "`fit`, a loop"
MANY, LANES = "`fit_many`", "solver alone, 64 lanes"


def made(count: int, samples: int = 500) -> list[Case]:
    """Recordings of devices that differ by some 10 %, each with noise of its own."""
    return [case(recorded(samples=samples, seed=i, spread=0.1)) for i in range(count)]


def by_peer(pool: Any, cases: list[Case]) -> list[float]:
    """Final costs by the peer."""
    work = (delayed(_one)(c.values, c.shape, c.runs) for c in cases)
    return list(pool(work))


def _many(cases: list[Case]) -> Any:
    return fit_many([c.start for c in cases], [c.recording for c in cases], check=False)


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
    work = f"{count} fits, 4 x {cases[0].runs.u.shape[1]}, {cases[0].size} parameters"
    # batch_size "auto" grows only slowly from 1; chunks are what a user would set.
    with Parallel(n_jobs=PROCESSES, batch_size=max(count // (8 * PROCESSES), 1)) as pool:
        peer = np.array(by_peer(pool, cases))  # starts the processes, compiles
        end = {
            LOOP: np.array([bare(c).cost for c in cases]),
            WHOLE: _ends([fitted(c) for c in cases], cases),
            MANY: _ends(_many(cases), cases),
            LANES: np.array([end.cost for end in bare_many(cases, 64)]),
        }
        ways = {
            LOOP: lambda: [bare(c) for c in cases],
            PEER: lambda: by_peer(pool, cases),
            WHOLE: lambda: [fitted(c) for c in cases],
            MANY: lambda: _many(cases),
            LANES: lambda: bare_many(cases, 64),
        }
        seconds = take_turns(ways, rounds)
    for name, costs in end.items():
        higher = int(np.sum(costs > peer * (1.0 + END_AGREES)))
        lower = int(np.sum(costs < peer * (1.0 - END_AGREES)))
        note = f"ours ended higher in {higher}, lower in {lower}" if higher or lower else ""
        sums = dict(
            start_cost=float(sum(own)), ours_cost=float(costs.sum()), peer_cost=float(peer.sum())
        )
        yield compared(work, name, PEER, seconds, note=note, **sums)
