"""Break ten laws on purpose, one at a time, and tell which short test notices.

Each mutation is one text of one file and what stands in its place, in a copy of the tree; then the
short tests nearest to it run until one fails. Exits with 1 where fewer than nine are noticed.
Not a test.
"""

import argparse
import dataclasses
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fitting.compile_cache import machine_folder, variables

ROOT = Path(__file__).resolve().parents[2]
ENOUGH = 9
SHORT = "not slow and not bank and not notebook and not process"
# What a mutation leaves as it was is compiled already; a program that it changes has another key.
ENVIRONMENT = {
    **variables(machine_folder(ROOT / ".pytest_cache/d/compiled")),
    "PYTHONDONTWRITEBYTECODE": "1",
}
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", ".*_cache", "__pycache__", "rapi-demo", "dist")


@dataclasses.dataclass(frozen=True)
class Mutation:
    """What is broken, where, and the part of the short tier that runs."""

    law: str
    file: str
    old: str
    new: str
    tests: str


MUTATIONS = (
    Mutation(
        "Eq. 9: the play's upper bound taken for its lower one",
        "rapi_jax/plays/_play.py",
        "    value = jnp.maximum(lower, jnp.minimum(upper, value))  # Eq. (9)",
        "    value = jnp.maximum(upper, jnp.minimum(lower, value))  # Eq. (9)",
        "tests/rapi_jax/plays",
    ),
    Mutation(
        "Eq. 14: the weights of the plays lost",
        "rapi_jax/plays/_play.py",
        "    return _values(*_bands(u, r, lam, eta, bow, u_0), start) @ p",
        "    return _values(*_bands(u, r, lam, eta, bow, u_0), start) @ jnp.ones_like(p)",
        "tests/rapi_jax/plays tests/rapi_jax/operators",
    ),
    Mutation(
        "Eq. 11: a threshold that falls with the rate",
        "rapi_jax/operators/_rapi.py",
        "* self.rank * u_pp / 2.0 + self.zeta * freq  # Eq. (11)",
        "* self.rank * u_pp / 2.0 - self.zeta * freq  # Eq. (11)",
        "tests/rapi_jax/operators",
    ),
    Mutation(
        "DriveLimits: the first step is not looked at",
        "rapi_jax/_limits.py",
        "        step = np.diff(value)\n",
        "        step = np.diff(value)[1:]\n",
        "tests/rapi_jax/inversion/test_compensate.py",
    ),
    Mutation(
        "certificate: the slope of the wrong direction",
        "rapi_jax/inversion/_certificate.py",
        '    reached = key >= pieces.low if direction == "up" else key <= pieces.high',
        '    reached = key <= pieces.low if direction == "up" else key >= pieces.high',
        "tests/rapi_jax/inversion/test_certificate.py",
    ),
    Mutation(
        "whitening: the other half of the spectrum is called synchronous",
        "fitting/diagnosis/noise/_lines.py",
        "        synchronous = k % block.periods == 0",
        "        synchronous = k % block.periods != 0",
        "tests/fitting/diagnosis/noise tests/fitting/diagnosis/where",
    ),
    Mutation(
        "io: MHz read as GHz",
        "rapi_jax/io/_units.py",
        '"MHz": ("GHz", 1e3)',
        '"MHz": ("GHz", 1.0)',
        "tests/rapi_jax/io",
    ),
    Mutation(
        "metrics: rising and falling branch exchanged",
        "rapi_jax/_metrics.py",
        "return Linearity(sides[0][0], sides[1][0], sides[0][1], sides[1][1], (low, high))",
        "return Linearity(sides[1][0], sides[0][0], sides[1][1], sides[0][1], (low, high))",
        "tests/rapi_jax/test_metrics.py",
    ),
    Mutation(
        "cross-validation: one period more is held out",
        "fitting/identification/assessment/_cross_validation.py",
        "            first = periods - max(1, round(periods / 3))",
        "            first = periods - max(1, round(periods / 3)) - 1",
        "tests/fitting/identification/test_cross_validation.py",
    ),
    Mutation(
        "credible set: ends one hypothesis too early",
        "fitting/diagnosis/which/evidence/_conformal.py",
        "        names.append(name)\n        total += probability\n"
        "        if total >= THRESHOLDS.credible_level:\n            break\n",
        "        total += probability\n"
        "        if total >= THRESHOLDS.credible_level and names:\n            break\n"
        "        names.append(name)\n",
        "tests/fitting/diagnosis/which",
    ),
)


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
    parser.add_argument("--only", default="", help="laws whose name contains this")
    arguments = parser.parse_args()
    mutations = tuple(one for one in MUTATIONS if arguments.only in one.law)
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
    return found < min(ENOUGH, len(mutations))


if __name__ == "__main__":
    sys.exit(main())
