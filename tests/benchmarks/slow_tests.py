"""Write `tests/slow.txt`, the tests that the short tier leaves to the others, from a timed run.

`python tests/benchmarks/slow_tests.py REPORT.xml`, of `pytest --junitxml=REPORT.xml` on an empty
compile cache. A function counts with its slowest case; those under `KEPT` stay in the short tier,
so that it tries each of the main paths from end to end.
"""

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

LEAST_S = 2.0  # two processors then end in 8 minutes; halved a third more go, doubled it takes 13
KEPT = (
    "tests/test_readme.py",
    "tests/fitting/commands/test_diagnose_command.py::test_one_recording",
)
HERE = Path(__file__).resolve().parents[1]


def main(report: str) -> None:
    """Add to the list what took long, and drop what is gone."""
    slow = {line for line in (HERE / "slow.txt").read_text(encoding="utf-8").splitlines() if line}
    for case in ET.parse(report).getroot().iter("testcase"):
        module, name = case.attrib["classname"].replace(".", "/"), case.attrib["name"]
        if float(case.attrib["time"]) >= LEAST_S:
            slow.add(f"{module}.py::{name.split('[')[0]}")
    kept = sorted(one for one in slow if not one.startswith(KEPT) and _exists(one))
    (HERE / "slow.txt").write_text("\n".join(kept) + "\n", encoding="utf-8")


def _exists(one: str) -> bool:
    file, name = one.split("::")
    path = HERE.parent / file
    return path.is_file() and f"def {name}(" in path.read_text(encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
