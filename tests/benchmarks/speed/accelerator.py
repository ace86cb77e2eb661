"""What one accelerator does, or the CPU where there is none: bandwidth, fits, in float64.

    python3 -m uv run python -m tests.benchmarks.speed.accelerator [--json PATH] [--many N]

The forward model needs one read and one write a sample; what it reaches is given as a share of the
bandwidth of a kernel that copies. Needs neither Numba nor joblib.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp

from fitting.identification._thresholds import THRESHOLDS
from rapi_jax import ECDL
from rapi_jax.internal import float64
from rapi_jax.plays._prefix_scan import prefix_values

from ._cases import case, device, recorded, scanned
from ._ours import bare, bare_many, forward_of

BYTES = 16  # a sample: one read, one write of float64
SIZES = (4_000_000, 400_000)  # samples of the long drive: on an accelerator, on a CPU
ENOUGH, CALLS = 1.0, 50  # s of calls, or at most so many


def fastest(call: Callable[[], Any]) -> float:
    """Seconds of the fastest call, once compiled; until the device is done."""
    jax.block_until_ready(call())
    seconds: list[float] = []
    while not seconds or (sum(seconds) < ENOUGH and len(seconds) < CALLS):
        began = time.perf_counter()
        jax.block_until_ready(call())
        seconds.append(time.perf_counter() - began)
    return min(seconds)


@float64
def copy_bandwidth() -> float:
    """Bytes a second of a kernel that reads an array and writes one."""
    size = 2**24 if jax.default_backend() == "cpu" else 2**28
    array = jnp.arange(size, dtype=jnp.float64)
    copy = jax.jit(lambda x: x + 1.0)
    return BYTES * size / fastest(lambda: copy(array))


def bandwidth_row(work: str, samples: int, seconds: float, copied: float) -> dict[str, Any]:
    """A row of the forward model."""
    reached = BYTES * samples / seconds
    share = f"{reached / 1e9:.3g} GB/s, {100 * reached / copied:.3g} % of copy"
    return {"work": work, "seconds": seconds, "bytes_per_s": reached, "figure": share}


def forward_rows(copied: float) -> Iterator[dict[str, Any]]:
    """Runs of one period that share a call, and one long drive that never repeats."""
    size = SIZES[jax.default_backend() == "cpu"]
    for runs, samples, plays in ((64, size // 40, 10), (64, size // 40, 100), (1, size, 10)):
        drives = scanned(runs, samples) if runs > 1 else scanned(1, samples, free=True)
        call = forward_of(ECDL(device(plays)), drives)
        work = f"forward, {runs} x {samples} samples, {plays} plays"
        yield bandwidth_row(work, runs * samples, fastest(call), copied)


@float64  # no generator: its body would run after 64-bit types are off again
def prefix_row(copied: float) -> dict[str, Any]:
    """The evaluation by a prefix scan of clamps."""
    size = SIZES[jax.default_backend() == "cpu"]
    work = f"forward by prefix scan, 1 x {size} samples, 10 plays"
    (drive,) = scanned(1, size, free=True)
    plays = device().plays(jnp.asarray(drive.u_pp), jnp.asarray(drive.rate))
    u = jnp.asarray(drive.value)
    start = plays.lowest(jnp.min(u))

    @jax.jit
    def respond(u, plays, start):
        r, lam, shift = (x[None, :] for x in (plays.r, plays.lam, plays.eta * plays.r))
        return prefix_values(u[:, None] - r, lam * u[:, None] + shift, start) @ plays.p

    seconds = fastest(lambda: respond(u, plays, start))
    return bandwidth_row(work, drive.size, seconds, copied)


def fit_rows(many: int) -> Iterator[dict[str, Any]]:
    """One fit as it is, some in a loop, and many in one batch."""
    one = case(recorded())
    seconds = fastest(lambda: bare(one).values)
    yield {"work": "one fit, 4 x 4000, 10 parameters", "seconds": seconds, "figure": "solver alone"}
    cases = [case(recorded(samples=500, seed=i, spread=0.1)) for i in range(20)]
    seconds = fastest(lambda: [bare(c).values for c in cases]) / len(cases)
    figure = f"{1 / seconds:.3g} fits a second"
    yield {"work": "fits of 4 x 500 in a loop, each", "seconds": seconds, "figure": figure}
    lanes = min(many, THRESHOLDS.lanes)
    all_cases = [cases[i % len(cases)] for i in range(many)]
    seconds = fastest(lambda: [end.values for end in bare_many(all_cases, lanes)]) / many
    work = f"{many} fits of 4 x 500, {lanes} lanes, each"
    yield {"work": work, "seconds": seconds, "figure": f"{1 / seconds:.3g} fits a second"}


def rows(many: int) -> Iterator[dict[str, Any]]:
    """All figures, each as soon as it is known."""
    copied = copy_bandwidth()
    yield {"work": "copy", "seconds": None, "figure": f"{copied / 1e9:.3g} GB/s"}
    yield from forward_rows(copied)
    yield prefix_row(copied)
    yield from fit_rows(many)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Speed on one device, in float64.")
    parser.add_argument("--json", type=Path, help="keep all figures there")
    parser.add_argument("--many", type=int, default=1000, help="fits in one batch")
    given = parser.parse_args()
    where = jax.devices()[0]
    print(f"{where.platform}: {where.device_kind}\n\n| work | time | figure |\n| --- | --- | --- |")
    measured = []
    for row in rows(given.many):
        measured.append(row)
        taken = "" if row["seconds"] is None else f"{row['seconds']:.3g} s"
        print(f"| {row['work']} | {taken} | {row['figure']} |", flush=True)
    if given.json:
        named = {"platform": where.platform, "device": where.device_kind, "jax": jax.__version__}
        given.json.write_text(json.dumps({"device": named, "rows": measured}, indent=1) + "\n")


if __name__ == "__main__":
    main()
