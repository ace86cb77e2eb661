"""The streaming compensator: time a sample, distance from the batch inverse, cost of short words.

    taskset -c 0 uv run python tests/benchmarks/streaming.py [--samples 1000000] [-o FOLDER]

The paper's device at 20 Hz, 75 GHz. Times are of one core, compiled, the best of `--repeats`: a
scan in `lax.scan`, and targets that jump anywhere in its range. The processor's time is that of a
machine at rest, the clock's follows its load. With `-o`, plots the largest errors of drive and scan
against word length.
"""

import argparse
import os
import time
from pathlib import Path

FREQ, SPAN, SAMPLES = 20.0, 75.0, 8192
WITHIN = (0.0, 7.0)


def best_of(repeats, run):
    """Seconds of processor and of the clock, each of the fastest of `repeats` runs, compiled."""
    import jax

    jax.block_until_ready(run())
    seconds = []
    for _ in range(repeats):
        began = time.process_time(), time.perf_counter()
        jax.block_until_ready(run())
        seconds.append((time.process_time() - began[0], time.perf_counter() - began[1]))
    return [min(column) for column in zip(*seconds, strict=True)]


def main():
    """Print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()

    import jax
    import jax.numpy as jnp
    import numpy as np

    jax.config.update("jax_enable_x64", True)
    from rapi_jax import (
        RAPI,
        FixedPointCompensator,
        StreamingCompensator,
        exact_inverse,
        linear_scan,
        plot,
        word_length_errors,
    )
    from rapi_jax.examples import paper_device

    count = options.samples
    operator = paper_device().operator
    (target,) = linear_scan(FREQ, span=SPAN, samples=SAMPLES)
    rng = np.random.default_rng(0)
    print(f"{len(os.sched_getaffinity(0))} core, load {os.getloadavg()[0]:.1f}, {count} samples")

    print("largest difference from the batch inverse")
    for rate in (10.0, 20.0, 40.0):
        for name, y in (
            ("rounded corners", 20.0 + target.value),
            ("triangle", 20.0 + SPAN * (1.0 - np.abs(1.0 - 2.0 * np.arange(SAMPLES) / SAMPLES))),
        ):
            stream = StreamingCompensator.for_scan(operator, rate, y, within=WITHIN)
            state, drive = stream.run(y)
            off = np.abs(np.asarray(drive) - exact_inverse(operator, y, rate, within=WITHIN)).max()
            print(f"  {rate:g} Hz {name:16s} drive {off:.1e} V, response {state.error:.1e} GHz")

    print("time a sample")
    y = 20.0 + target.value
    scan = jnp.asarray(np.resize(y, count))
    jumps = jnp.asarray(rng.uniform(y.min(), y.max(), count))
    for plays in (5, 10, 20):
        names = ("alpha", "zeta", "lam", "eta", "a", "b", "d", "d_0")
        fields = {name: getattr(operator, name) for name in names}
        model = RAPI(**(fields | {"a": fields["a"] * 10 / plays}), plays=plays)
        stream = StreamingCompensator.for_scan(model, FREQ, y, within=WITHIN)
        for name, targets in (("scan", scan), ("jumps", jumps)):
            best = best_of(options.repeats, lambda: stream.run(targets))  # noqa: B023
            processor, clock = (1e9 * seconds / count for seconds in best)
            error = float(stream.run(targets)[0].error)
            times = f"processor {processor:5.0f} ns, clock {clock:5.0f} ns"
            print(f"  {plays:2d} plays, {name:5s} {times}, error {error:.1e} GHz")

    print("in words: largest errors over the scan")
    stream = StreamingCompensator.for_scan(operator, FREQ, y, within=WITHIN)
    errors = word_length_errors(stream, y)
    print("  bits   drive (V)   scan (MHz)   iterations   widest intermediate (bits)")
    for e in errors:
        sizes = f"{e.drive:11.2e} {1e3 * e.response:12.2e}"
        print(f"  {e.bits:4d} {sizes} {e.iterations:12d} {e.widest:12d}")
    fixed = FixedPointCompensator.of(stream, bits=24)
    processor, _ = best_of(options.repeats, lambda: fixed.run(scan[: count // 10]))
    print(f"  simulated in 24 bits: processor {1e9 * processor / (count // 10):.0f} ns a sample")
    if options.output:
        options.output.mkdir(parents=True, exist_ok=True)
        (options.output / "word_lengths.png").write_bytes(plot.png(plot.word_lengths(errors)))


if __name__ == "__main__":
    main()
