"""Seconds that the simulated bench takes for one record of raw fringes, and for a measurement.

    uv run python tests/benchmarks/bench.py [--read]

Both channels at 30 MS/s, one period of the paper's triangle at each rate. `--read` adds the time to
read the optical frequency from them.
"""

import sys
import time


def main():
    """Command line."""
    from hardware import SimulatedBench
    from rapi_jax.examples import paper_drives
    from rapi_jax.readout import read_fringes

    for unmodelled in (False, True):
        bench = SimulatedBench.like_paper(unmodelled=unmodelled)
        print("with physics that RA-PI lacks" if unmodelled else "the paper's device")
        for drive in paper_drives():
            bench.fringes(drive)  # compiles
            seconds = []
            for _ in range(5):
                began = time.perf_counter()
                fringes = bench.fringes(drive)
                seconds.append(time.perf_counter() - began)
            line = f"  {drive.rate:4g} Hz {fringes.size:9d} samples   raw {min(seconds):6.3f} s"
            if "--read" in sys.argv[1:]:
                began = time.perf_counter()
                read_fringes(fringes, drive)
                line += f"   read {time.perf_counter() - began:6.2f} s"
            print(line)


if __name__ == "__main__":
    main()
