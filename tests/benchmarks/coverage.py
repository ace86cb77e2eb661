"""How often 95 % intervals hold the truth under correlated noise.

    uv run python tests/benchmarks/coverage.py [--replicates 300] [--rho 0 0.9 0.98]

The paper's device, four rates, 4000 samples a run, AR(1) noise of 20 MHz; each replicate is fitted
from the truth's neighbourhood with default weights, and each parameter's 95 % interval is looked
at.
"""

import argparse

import numpy as np

from fitting import fit
from rapi_jax import ECDL, RAPI, Recording
from rapi_jax.examples import paper_device, paper_recording

NAMES = ("alpha", "zeta", "lam", "eta", "a", "b", "d_1", "d_2", "d_3", "d_0")


def noise(rng, size, rho, sigma):
    """AR(1) noise with standard deviation `sigma`, stationary from the first sample."""
    white = rng.standard_normal(size)
    out = np.empty(size)
    out[0] = white[0]
    innovation = np.sqrt(1.0 - rho**2)
    for i in range(1, size):
        out[i] = rho * out[i - 1] + innovation * white[i]
    return sigma * out


def coverage(rho, replicates, samples=4000, sigma=0.020, seed=0):
    """Share of replicates in which each parameter's interval holds the truth."""
    recording, truth = paper_recording(samples=samples, noise=0.0)
    true = paper_device()
    operator = true.operator
    values = {n: float(np.asarray(getattr(operator, n))) for n in NAMES if not n.startswith("d_")}
    values |= {f"d_{k + 1}": float(v) for k, v in enumerate(np.asarray(operator.d))} | {"d_0": 0.0}
    hits = dict.fromkeys(NAMES, 0)
    rng = np.random.default_rng((seed, round(1000 * rho)))
    for _ in range(replicates):
        noisy = [y + noise(rng, y.size, rho, sigma) for y in truth]
        data = Recording.of(recording.drives, noisy)
        result = fit(
            ECDL(_near(operator, rng)), data, starts=1, guess=False, hold_out=False, throw=False
        )
        for name in NAMES:
            estimate = result[name]
            low, high = estimate.interval(0.95, result.effective - len(NAMES))
            hits[name] += low <= values[name] <= high
    return {name: count / replicates for name, count in hits.items()}


def _near(operator, rng):
    def change(value):
        return np.asarray(value) * (1.0 + 0.03 * rng.standard_normal(np.shape(value)))

    names = ("alpha", "zeta", "lam", "eta", "a", "b", "d")
    return RAPI(**{n: change(getattr(operator, n)) for n in names}, d_0=0.0, plays=operator.count)


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--replicates", type=int, default=300)
    parser.add_argument("--rho", type=float, nargs="*", default=[0.0, 0.9, 0.98])
    arguments = parser.parse_args()
    print("rho   mean   " + " ".join(f"{name:>6}" for name in NAMES))
    for rho in arguments.rho:
        found = coverage(rho, arguments.replicates)
        row = " ".join(f"{100 * found[name]:6.1f}" for name in NAMES)
        print(f"{rho:<5g} {100 * np.mean(list(found.values())):5.1f}  {row}", flush=True)


if __name__ == "__main__":
    main()
