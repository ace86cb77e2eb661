"""Table 1 through real VISA: measure, fit, compensate, upload, measure, behind wires.

    uv run python tests/benchmarks/wired_loop.py [--seed 0]

Generator, laser controller and oscilloscope are simulated ones on 127.0.0.1, over HiSLIP and over
raw TCP; everything is read from the oscilloscope's records.
"""

import argparse
import contextlib
import tempfile
import time
from pathlib import Path

RATES = (10.0, 20.0, 30.0, 40.0)
# The paper's rms nonlinearity in MHz, up and down: without and with compensation.
PAPER_UP = ((435, 400, 391, 400), (63.7, 75.8, 61.9, 33.8))
PAPER_DOWN = ((3280, 3240, 3120, 3030), (271, 243, 179, 154))


def served(stack, wires, seed):
    """A bench on a laboratory behind `wires`."""
    from hardware import open_bench
    from hardware.simulated import SimulatedBench, WiredLaboratory, bench_toml

    laboratory = SimulatedBench.like_paper().laboratory
    at = stack.enter_context(WiredLaboratory(laboratory, seed=seed).served(wires))
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
    path = folder / "bench.toml"
    path.write_text(bench_toml(at, delay_s=laboratory.interferometer.delay_s))
    return stack.enter_context(open_bench(path))


def main():
    """Print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    from fitting import identify
    from hardware import HislipServer, TcpServer
    from rapi_jax import Identified, compensate, linear_scan, linearity
    from rapi_jax.examples import paper_drives

    for wires in (HislipServer, TcpServer):
        began = time.perf_counter()
        with contextlib.ExitStack() as stack:
            bench = served(stack, wires, options.seed)
            training = bench.measure(paper_drives())
            model = identify(training)
            seen = Identified.of(training)
            made = [
                compensate(
                    model.ecdl, linear_scan(rate, span=75.0)[0], identified=seen,
                    limits=bench.limits, bias=3.0,
                ).drive
                for rate in RATES
            ]  # fmt: skip
            check = bench.measure(made)
        print(f"\n{wires.__name__}, {time.perf_counter() - began:.0f} s in all; rms in MHz")
        for k, rate in enumerate(RATES):
            before, after = (linearity(r.runs[k]).rms_ghz for r in (training, check))
            ours = [b / a for b, a in zip(before, after, strict=True)]
            paper = [PAPER_UP[0][k] / PAPER_UP[1][k], PAPER_DOWN[0][k] / PAPER_DOWN[1][k]]
            print(
                f"  {rate:3g} Hz  up {1e3 * before[0]:7.1f} -> {1e3 * after[0]:6.3f}, down "
                f"{1e3 * before[1]:7.1f} -> {1e3 * after[1]:6.3f}; straighter by "
                f"{ours[0]:.0f} and {ours[1]:.0f} (paper {paper[0]:.1f} and {paper[1]:.1f})"
            )


if __name__ == "__main__":
    main()
