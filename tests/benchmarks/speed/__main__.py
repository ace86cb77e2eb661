"""Speed against what a user would pick instead: one table, ratios of paired runs.

    python3 -m uv run --group bench python -m tests.benchmarks.speed [PART ...] [--json PATH]

Parts: fits, forward, inverse, recordings, cold, growth; all by default. Each comparison takes both
sides in turns in one process, on the same data from the same start, and gives the median of the
ratios with their range. It refuses to report where the two did not do the same work.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

# Before NumPy is imported. One thread of linear algebra on either side: two are slower here, and
# SciPy's steps many times.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

PARTS = ("fits", "forward", "inverse", "recordings", "cold", "growth")


def options() -> argparse.Namespace:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--rounds", type=int, default=7, help="of each comparison")
    parser.add_argument("--many", type=int, default=100, help="recordings to fit in one go")
    parser.add_argument("--full", action="store_true", help="growth to the largest sizes")
    parser.add_argument("--limit", type=float, default=300.0, help="s, for one size of growth")
    parser.add_argument("--json", type=Path, help="keep all figures there")
    parser.add_argument("--plot", type=Path, help="a PNG of the growth")
    given = parser.parse_args()
    unknown = set(given.parts) - set(PARTS)
    if unknown:
        parser.error(f"unknown part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    given.parts = given.parts or list(PARTS)
    missing = [name for name in ("numba", "joblib") if find_spec(name) is None]
    if missing:
        parser.error(f"{' and '.join(missing)} missing: `python3 -m uv run --group bench ...`")
    return given


def comparisons(given: argparse.Namespace) -> Iterator[Any]:
    """The rows of the parts asked for, each as soon as it is known."""
    if "fits" in given.parts:
        from . import fits

        yield from fits.rows(given.rounds)
    if "forward" in given.parts:
        from . import forward

        yield from forward.rows(given.rounds)
        yield from forward.memory_rows()
    if "inverse" in given.parts:
        from . import inverse

        yield from inverse.rows(given.rounds)
    if "recordings" in given.parts:
        from . import recordings

        yield from recordings.rows(max(1, min(given.rounds, 300 // given.many)), given.many)
    if "cold" in given.parts:
        from . import cold

        yield from cold.rows(min(given.rounds, 3))


def growths(given: argparse.Namespace) -> list[dict[str, Any]]:
    """The growth of time and memory, its table printed and plotted."""
    if "growth" not in given.parts:
        return []
    from . import growth

    found = []
    for one in growth.series(given.full, given.limit):
        found.append(one)
        print(f"growth of {one['kind']} with {one['grows']}", file=sys.stderr, flush=True)
    print("\n" + growth.markdown(found))
    if given.plot:
        from ._plot import plot

        plot(given.plot, found)
    return found


def main() -> None:
    """Command line."""
    given = options()
    with tempfile.TemporaryDirectory() as folder:
        os.environ.setdefault("NUMBA_CACHE_DIR", folder)  # nothing is compiled beforehand
        from ._table import markdown, write_json

        rows = []
        for row in comparisons(given):
            rows.append(row)
            print(f"{row.work}: {row.ours} against {row.peer}", file=sys.stderr, flush=True)
        if rows:
            print(markdown(rows))
        grown = growths(given)
        if given.json:
            write_json(given.json, rows, growth=grown)


if __name__ == "__main__":
    main()
