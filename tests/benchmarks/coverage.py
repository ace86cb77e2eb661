"""How often 95 % intervals hold the truth under correlated noise, or noise with heavy tails.

    uv run python tests/benchmarks/coverage.py [--replicates 300] [--rho 0 0.9 0.98]
    uv run python tests/benchmarks/coverage.py --noise mixed seldom flicker [--periods 4]
    uv run python tests/benchmarks/coverage.py --noise student contaminated --loss huber student

The paper's device, four rates, 4000 samples a run (`--samples`), noise of 20 MHz; each replicate is
fitted from the truth's neighbourhood with default weights, and each parameter's 95 % interval is
looked at. `mixed`: 72 % white, 28 % AR(1) at 0.96; `seldom`: 90 %, 10 % at 0.99; `flicker`: 1/f
from an eighth of a run's reciprocal on. `student`: Student's t with 3 degrees of freedom, of scale
20 MHz; `contaminated`: white, of which one reading in twenty is ten times as large. Last: the error
of each parameter (rms over the replicates, then their geometric mean), in units of that with the
first loss named.
"""

import argparse
from functools import partial

import numpy as np

from fitting import fit
from fitting.identification.robust._loss import LOSSES
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


SLOW = {"mixed": (0.28, 0.96), "seldom": (0.1, 0.99)}


def slow(rng, size, kind, sigma):
    """White noise with slow noise under it, or flicker noise, of standard deviation `sigma`."""
    if kind in SLOW:
        share, rho = SLOW[kind]
        white = np.sqrt(1.0 - share) * sigma * rng.standard_normal(size)
        return white + noise(rng, size, rho, np.sqrt(share) * sigma)
    cycles = np.fft.rfftfreq(8 * size)
    gain = 1.0 / np.sqrt(np.maximum(cycles, cycles[1]))
    series = np.fft.irfft(gain * np.fft.rfft(rng.standard_normal(8 * size)))
    start = int(rng.integers(0, 7 * size))
    return sigma * (series / np.sqrt(np.fft.irfft(gain**2)[0]))[start : start + size]


def heavy(rng, size, kind, sigma):
    """White noise of scale `sigma` with heavy tails."""
    if kind == "student":
        return sigma * rng.standard_t(3, size)
    return sigma * rng.standard_normal(size) * np.where(rng.random(size) < 0.05, 10.0, 1.0)


NOISES = {
    "mixed": slow,
    "seldom": slow,
    "flicker": slow,
    "student": heavy,
    "contaminated": heavy,
}


def coverage(make, replicates, samples=4000, seed=(0,), loss="squares", periods=1):
    """Share of replicates in which each parameter's interval holds the truth, and rms errors.

    `make(rng, size)`: the noise of a run.
    """
    recording, truth = paper_recording(samples=samples, periods=periods, noise=0.0)
    true = paper_device()
    operator = true.operator
    values = {n: float(np.asarray(getattr(operator, n))) for n in NAMES if not n.startswith("d_")}
    values |= {f"d_{k + 1}": float(v) for k, v in enumerate(np.asarray(operator.d))} | {"d_0": 0.0}
    hits = dict.fromkeys(NAMES, 0)
    squares = dict.fromkeys(NAMES, 0.0)
    rng = np.random.default_rng(seed)
    for _ in range(replicates):
        noisy = [y + make(rng, y.size) for y in truth]
        data = Recording.of(recording.drives, noisy)
        result = fit(
            ECDL(_near(operator, rng)),
            data,
            loss=loss,
            starts=1,
            guess=False,
            hold_out=False,
            throw=False,
        )
        for name in NAMES:
            estimate = result[name]
            low, high = estimate.interval(0.95, result.effective - len(NAMES))
            hits[name] += low <= values[name] <= high
            squares[name] += (estimate.value - values[name]) ** 2 / replicates
    shares = {name: count / replicates for name, count in hits.items()}
    return shares, {name: np.sqrt(square) for name, square in squares.items()}


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
    parser.add_argument("--noise", nargs="*", default=[], choices=sorted(NOISES))
    parser.add_argument("--loss", nargs="*", default=["squares"], choices=LOSSES)
    parser.add_argument("--samples", type=int, default=4000)
    parser.add_argument("--periods", type=int, default=1)
    arguments = parser.parse_args()
    sigma, first = 0.020, {}
    kinds = {
        f"AR(1) {rho:g}": (partial(noise, rho=rho, sigma=sigma), (0, round(1000 * rho)))
        for rho in ([] if arguments.noise else arguments.rho)
    } | {
        kind: (partial(NOISES[kind], kind=kind, sigma=sigma), (1, len(kind)))
        for kind in arguments.noise
    }
    print(f"{'noise':<13} {'loss':<8} mean   {' '.join(f'{name:>6}' for name in NAMES)}  error")
    for kind, (make, seed) in kinds.items():
        for loss in arguments.loss:
            found, errors = coverage(
                make, arguments.replicates, arguments.samples, seed, loss, arguments.periods
            )
            row = " ".join(f"{100 * found[name]:6.1f}" for name in NAMES)
            mean = 100 * np.mean(list(found.values()))
            usual = first.setdefault(kind, errors)
            ratio = np.exp(np.mean([np.log(errors[name] / usual[name]) for name in NAMES]))
            print(f"{kind:<13} {loss:<8} {mean:5.1f}  {row}  {ratio:.2f}", flush=True)


if __name__ == "__main__":
    main()
