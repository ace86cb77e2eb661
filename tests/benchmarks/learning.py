"""Learning control from zero and from the model's drive, on a device with physics the model lacks.

    uv run python tests/benchmarks/learning.py [--rate 20] [--iterations 10] [-o FOLDER]

The device has an amplifier of 1.5 kHz, a mirror resonance and an etalon, none of which RA-PI knows.
Everything is read from fringes. Prints the rms nonlinearity (MHz) of each iteration; with `-o`,
plots both courses in one picture.
"""

import argparse
from pathlib import Path


def main():
    """Print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rate", type=float, default=20.0)
    parser.add_argument("--iterations", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()

    from fitting import identify
    from hardware import SimulatedBench
    from rapi_jax import Drive, Identified, compensate, learn, linear_scan, plot
    from rapi_jax.examples import paper_drives

    bench = SimulatedBench.like_paper(seed=options.seed, unmodelled=True, latency_s=1e-4)
    training = bench.measure(paper_drives())
    result = identify(training, throw=False)
    print("model of the device trusted:", result.verdict.trusted, *result.verdict.reasons[:1])
    (target,) = linear_scan(options.rate, span=75.0, corner=0.1, samples=4096)
    zero = Drive(target.time, 0.75 + 4.5 * target.value / 75.0, options.rate, "triangle")
    model = compensate(
        result.ecdl,
        target,
        identified=Identified.of(training),
        limits=bench.limits,
        bias=3.0,
    ).drive

    def measure(drive):
        return bench.measure(drive).runs[0]

    courses = []
    for name, start in (("from zero", zero), ("from the model", model)):
        course = learn(measure, target, start, limits=bench.limits, iterations=options.iterations)
        courses.append((name, course))
        print(f"{name}: {course.stopped} {course.reason}")
        for number, (up, down) in enumerate(1e3 * course.rms_ghz):
            print(f"  {number:3d} {up:9.3g} {down:9.3g}", flush=True)
    if options.output:
        options.output.mkdir(parents=True, exist_ok=True)
        (options.output / "learning.png").write_bytes(plot.png(plot.learning(courses)))


if __name__ == "__main__":
    main()
