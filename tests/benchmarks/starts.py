"""1000 random starts up to 5 times off (10 % with wrong signs): how many reach the optimum.

    uv run python tests/benchmarks/starts.py [--starts 1000] [--processes 2]

Each start is given to `fit` with its default settings, on the paper's device at four rates with 20
MHz of noise. An end counts as the optimum where its cost is within 0.01 % of the lowest ever seen.
Printed: how many reached it, and whether any that ended elsewhere was trusted.
"""

import argparse
import multiprocessing
import time

import numpy as np

SAME = 1e-4
WRONG_SIGN = 0.1
FACTOR = 5.0


def scrambled(seed):
    """The paper's device with every parameter up to `FACTOR` off, some with the wrong sign."""
    from rapi_jax import ECDL, RAPI
    from rapi_jax.examples import paper_device

    rng = np.random.default_rng((7, seed))
    true = paper_device().operator

    def off(value):
        value = np.asarray(value)
        factor = FACTOR ** rng.uniform(-1.0, 1.0, value.shape)
        sign = np.where(rng.random(value.shape) < WRONG_SIGN, -1.0, 1.0)
        return value * factor * sign

    names = ("alpha", "zeta", "lam", "eta", "a", "b", "d")
    return ECDL(RAPI(**{n: off(getattr(true, n)) for n in names}, d_0=rng.normal(0, 10), plays=10))


def work(seeds, samples, guess, queue):
    """Fit from each seed's start; put (seed, cost, trusted, rmse against the truth, seconds)."""
    from fitting import fit
    from rapi_jax.examples import paper_recording

    recording, truth = paper_recording(samples=samples, seed=0)
    for seed in seeds:
        began = time.perf_counter()
        result = fit(scrambled(seed), recording, hold_out=False, throw=False, guess=guess)
        missed = np.sqrt(
            np.mean([np.mean((p - t) ** 2) for p, t in zip(result.predicted, truth, strict=True)])
        )
        best = min(start.cost for start in result.starts)
        queue.put((seed, best, result.verdict.trusted, missed, time.perf_counter() - began))


def run(starts, processes, samples, guess):
    """All rows, in order of seed."""
    context = multiprocessing.get_context("spawn")
    queue = context.Queue()
    shares = [range(i, starts, processes) for i in range(processes)]
    workers = [context.Process(target=work, args=(s, samples, guess, queue)) for s in shares]
    for worker in workers:
        worker.start()
    rows = []
    while len(rows) < starts:
        rows.append(queue.get(timeout=600))
        if len(rows) % 50 == 0:
            print(f"  {len(rows)} of {starts}", flush=True)
    for worker in workers:
        worker.join()
    return sorted(rows)


def report(rows):
    """Print the figures."""
    costs = np.array([row[1] for row in rows])
    trusted = np.array([row[2] for row in rows])
    lowest = costs.min()
    there = costs <= lowest * (1.0 + SAME)
    print(f"starts                      {len(rows)}")
    print(f"reached the optimum         {there.sum()}")
    print(f"elsewhere, but trusted      {(~there & trusted).sum()}")
    print(f"at the optimum, not trusted {(there & ~trusted).sum()}")
    print(
        "noise-free rmse, largest    "
        f"{1e3 * max(r[3] for r in rows if r[1] <= lowest * (1 + SAME)):.3f} MHz"
    )
    print(f"seconds a fit, median       {np.median([row[4] for row in rows]):.2f}")
    for row in np.array(rows)[~there][:20]:
        print(f"  elsewhere: seed {int(row[0])}, cost {row[1] / lowest:.4f} of the optimum's")


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=1000)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--samples", type=int, default=4000)
    parser.add_argument(
        "--no-guess", action="store_true", help="use the start given alone, without first guesses"
    )
    arguments = parser.parse_args()
    rows = run(arguments.starts, arguments.processes, arguments.samples, not arguments.no_guess)
    report(rows)


if __name__ == "__main__":
    main()
