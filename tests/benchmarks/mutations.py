"""Break laws, limits, certificates, readers and verdicts on purpose: which short test notices?

    python3 -m uv run python tests/benchmarks/mutations.py [--list] [--only TEXT ...]

Each mutation of `broken/` is one text of one file and what stands in its place, in a copy of the
tree, one at a time; then the short tests nearest to it run until one fails. Exits with 1 where less
than 80 % are noticed. Not a test.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from broken import MUTATIONS, Mutation

from fitting.compile_cache import machine_folder, variables

ROOT = Path(__file__).resolve().parents[2]
ENOUGH = 0.8
SHORT = "(not slow or slow(listed=True)) and not bank and not notebook and not process"
# What a mutation leaves as it was is compiled already; a program that it changes has another key.
ENVIRONMENT = variables(machine_folder(ROOT / ".pytest_cache/d/compiled"))
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", ".*_cache", "__pycache__", "rapi-demo", "dist")


def missing(mutations: tuple[Mutation, ...]) -> list[str]:
    """The mutations whose text does not stand in its file exactly once."""
    out = []
    for one in mutations:
        path = ROOT / one.file
        count = path.read_text().count(one.old) if path.exists() else 0
        if count != 1:
            out.append(f"{one.law}: {one.file} has its text {count} times")
    return out


def noticed(mutation: Mutation, tree: Path) -> str | None:
    """The first short test that fails on `mutation` in the copy `tree`, or `None`."""
    path = tree / mutation.file
    right = path.read_text()
    path.write_text(right.replace(mutation.old, mutation.new))
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-x", "-q", "-m", SHORT, *mutation.tests.split()],
            cwd=tree,
            env=os.environ | ENVIRONMENT | {"PYTHONPATH": str(tree)},
            capture_output=True,
            text=True,
        )
    finally:
        path.write_text(right)
    if done.returncode == 0:
        return None
    failed = [ln for ln in done.stdout.splitlines() if ln.startswith(("FAILED", "ERROR"))]
    if done.returncode != 1 or not failed:  # pytest itself came to nothing: no test noticed
        raise RuntimeError(f"{mutation.law}: pytest ended with {done.returncode}\n{done.stdout}")
    return failed[0].split(" - ")[0]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", action="store_true", help="check the texts and end")
    parser.add_argument("--only", nargs="+", default=[""], help="whose name contains one of these")
    arguments = parser.parse_args()
    mutations = tuple(m for m in MUTATIONS if any(text in m.law for text in arguments.only))
    for line in (lost := missing(mutations)):
        print(line, file=sys.stderr)
    if lost or arguments.list:
        print(f"{len(mutations) - len(lost)} of {len(mutations)} texts found once")
        return bool(lost)
    found = 0
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=LEFT_OUT, symlinks=True)
        for one in mutations:
            began = time.monotonic()
            test = noticed(one, tree)
            found += test is not None
            print(
                f"{one.law}: {test or 'NOT NOTICED'} ({time.monotonic() - began:.0f} s)", flush=True
            )
    print(f"{found} of {len(mutations)} noticed")
    return found < ENOUGH * len(mutations)


if __name__ == "__main__":
    sys.exit(main())
