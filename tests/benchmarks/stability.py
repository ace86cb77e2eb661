"""Fig. 11: the rms nonlinearity over 120 simulated minutes with drift, one measurement a minute.

    uv run python tests/benchmarks/stability.py [--drive identified|device|plain] [--rate 40]
        [--minutes 120] [--seeds 0] [--fast]

The drive is made once and then left alone: from a model identified at 10 to 40 Hz on the same bench
("identified"), from the simulated device itself as it is at the start ("device"), or a plain
triangle ("plain"). `--fast` takes the laser's true frequency with white noise of a reading's size
in place of fringes.
"""

import argparse

import numpy as np

PAPER = (2.34, 2.57)  # MHz, up and down
NOISE = 1.5e-4  # GHz: what fringes add to one of 4096 samples a period, the generator's codes apart


def arguments():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drive", choices=("identified", "device", "plain"), default="identified")
    parser.add_argument("--rate", type=float, default=40.0)
    parser.add_argument("--minutes", type=int, default=120)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--fast", action="store_true")
    return parser.parse_args()


def reader(bench, fast, seed):
    """A function from drive to run."""
    from rapi_jax import Run

    if not fast:
        return lambda drive: bench.measure(drive).runs[0]
    rng = np.random.default_rng(seed)

    def read(drive):
        run = Run(drive, bench.truth(drive) + NOISE * rng.standard_normal(drive.size))
        bench.wait(3.0 / drive.rate)
        return run

    return read


def made(kind, bench, read, rate):
    """The drive to be repeated."""
    from rapi_jax import ECDL, Identified, Recording, compensate, linear_scan, triangle
    from rapi_jax.examples import paper_device, paper_drives

    (target,) = linear_scan(rate, span=75.0, samples=4096)
    if kind == "plain":
        return triangle(rate, amplitude=4.5, bias=3.0, samples=4096)[0]
    if kind == "device":
        return compensate(paper_device(), target, limits=bench.limits, bias=3.0).drive
    from fitting import identify

    training = Recording(
        tuple(named(read(d), i) for i, d in enumerate(paper_drives())), response_origin="run"
    )
    ecdl: ECDL = identify(training, throw=False).ecdl
    seen = Identified.of(training)
    return compensate(
        ecdl, target, identified=seen, limits=bench.limits, bias=3.0, extrapolate=True
    ).drive


def named(run, number):
    """The run under a name of its own."""
    import dataclasses

    return dataclasses.replace(run, name=f"run{number:02d}")


def main():
    """Command line."""
    from hardware import SimulatedBench
    from hardware.simulated import Drift
    from rapi_jax._metrics import linearity

    given = arguments()
    print(f"{given.drive} drive, {given.rate:g} Hz, {given.minutes} min; MHz")
    for seed in given.seeds:
        bench = SimulatedBench.like_paper(seed=seed, drift=Drift.laboratory(seed))
        read = reader(bench, given.fast, seed)
        drive = made(given.drive, bench, read, given.rate)
        rms = []
        for _ in range(given.minutes):
            began = bench.session_s
            rms.append(linearity(read(drive)).rms_ghz)
            bench.wait(max(0.0, began + 60.0 - bench.session_s))
        mhz = 1e3 * np.array(rms)
        mean, std, worst = mhz.mean(axis=0), mhz.std(axis=0), mhz.max(axis=0)
        for k, side in enumerate(("up", "down")):
            line = f"  seed {seed} {side:<4} std {std[k]:6.3f} (paper {PAPER[k]})"
            line += f"   mean {mean[k]:8.2f}   first {mhz[0, k]:8.2f}   last {mhz[-1, k]:8.2f}"
            print(f"{line}   largest {worst[k]:8.2f}")


if __name__ == "__main__":
    main()
