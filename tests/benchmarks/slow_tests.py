"""Write `tests/slow.txt` and `tests/release.txt` from a timed run: what shorter tiers leave out.

`python tests/benchmarks/slow_tests.py REPORT.xml`, of `pytest --junitxml=REPORT.xml` of all tests
on an empty compile cache. A function counts with its slowest case. `KEPT` stay in the short tier
whatever they take, and `KEPT_BY_REST` in the next, so that each tries the main paths from end to
end.
"""

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

# Seconds, idle; of 1089 in half of the short tests 256 are in functions below this, 147 below half
# of it, 476 below twice.
SHORT_S = 1.0
# Seconds, idle; of 5612 in two thirds of the others 549 are below this, 173 below half of it, 1195
# below twice.
REST_S = 4.0
KEPT = (
    "tests/test_readme.py",
    "tests/fitting/commands/test_diagnose_command.py::test_one_recording",
)
KEPT_BY_REST = (
    "tests/rapi_jax/inversion/test_bent_certificate.py",
    "tests/rapi_jax/io/test_atomic.py",
    "tests/test_wired_loop.py",
    "tests/test_table_1.py::test_the_exact_inverse_beats_every_cell",
    "tests/fitting/commands/test_diagnose_command.py::test_compare_says_what_changed",
    "tests/fitting/diagnosis/how_far/test_predicted_gain.py",
)
HERE = Path(__file__).resolve().parents[1]


def main(report: str) -> None:
    """Add to the lists what took long, and drop what is gone."""
    took: dict[str, float] = {}
    for case in ET.parse(report).getroot().iter("testcase"):
        module, name = case.attrib["classname"].replace(".", "/"), case.attrib["name"]
        one = f"{module}.py::{name.split('[')[0]}"
        took[one] = max(took.get(one, 0.0), float(case.attrib["time"]))
    lists = (("slow", SHORT_S, KEPT), ("release", REST_S, (*KEPT, *KEPT_BY_REST)))
    for tier, least_s, kept in lists:
        file = HERE / f"{tier}.txt"
        before = file.read_text(encoding="utf-8").split() if file.exists() else ()
        listed = {*before, *(one for one, seconds in took.items() if seconds >= least_s)}
        left = sorted(one for one in listed if not one.startswith(kept) and _exists(one))
        file.write_text("\n".join(left) + "\n", encoding="utf-8")


def _exists(one: str) -> bool:
    file, name = one.split("::")
    path = HERE.parent / file
    return path.is_file() and f"def {name}(" in path.read_text(encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
