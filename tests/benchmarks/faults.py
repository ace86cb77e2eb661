"""The table of faults: what is done to the program, what must come of it, and what came.

    python tests/benchmarks/faults.py [PATHS] [-- PYTEST OPTIONS]

Runs the tests that are marked `fault`, of every tier but those by hand, and writes a Markdown table
to standard output; what pytest says goes to standard error. Exits with 1 where a promise was
broken. Not a test.
"""

import contextlib
import dataclasses
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
PATHS = ("tests/hardware", "tests/rapi_jax/io", "tests/fitting")
HEAD = ("fault", "injector", "trials", "promise", "seen", "seed")


@dataclasses.dataclass
class Row:
    """One fault of one test, over all its parameters."""

    fault: str
    injector: str
    promise: str
    seed: str
    trials: int = 0
    outcomes: list[tuple[str, str]] = dataclasses.field(default_factory=list)

    def seen(self) -> str:
        """What came of it: all held, or what did not."""
        broken = [name for outcome, name in self.outcomes if outcome == "failed"]
        skipped = [reason for outcome, reason in self.outcomes if outcome == "skipped"]
        if broken:
            return f"BROKEN: {len(broken)} of {len(self.outcomes)}, {broken[0]}"
        if skipped and len(skipped) == len(self.outcomes):
            return f"not tried: {skipped[0]}"
        return (
            f"held, {len(skipped)} not tried" if skipped else "held" if self.outcomes else "not run"
        )

    def cells(self) -> tuple[str, ...]:
        """As Markdown."""
        cells = (self.fault, self.injector, str(self.trials), self.promise, self.seen(), self.seed)
        return tuple(" ".join(cell.split()).replace("|", "\\|") for cell in cells)


class FaultTable:
    """Keeps the tests that declare a fault, and what comes of them."""

    def __init__(self) -> None:
        self.rows: dict[tuple[str, str], Row] = {}
        self._of: dict[str, Row] = {}

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Leave all others out."""
        items[:] = [one for one in items if self._add(one)]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """One outcome a test: its call, or whatever ended it before or after."""
        if report.when != "call" and report.passed:
            return
        reason = report.nodeid.rpartition("/")[2]
        if report.skipped and isinstance(report.longrepr, tuple):
            reason = report.longrepr[2].removeprefix("Skipped: ")
        self._of[report.nodeid].outcomes.append((report.outcome, reason))

    def _add(self, item: pytest.Item) -> bool:
        mark = item.get_closest_marker("fault")
        if mark is None or item.get_closest_marker("calibration"):
            return False
        params = item.callspec.params if hasattr(item, "callspec") else {}  # pyright: ignore
        fault = _text(mark.kwargs["name"], params)
        file = Path(str(item.path)).relative_to(ROOT / "tests").as_posix()
        injector = mark.kwargs.get("injector", f"{file}::{item.name.partition('[')[0]}")
        row = Row(
            fault,
            f"`{_text(injector, params)}`",
            _text(mark.kwargs["promise"], params),
            str(mark.kwargs.get("seed", "-")),
        )
        row = self.rows.setdefault((row.fault, row.injector), row)
        trials = mark.kwargs.get("trials", 1)
        row.trials += trials if isinstance(trials, int) else _filled(trials, params)
        self._of[item.nodeid] = row
        return True


def _text(value: str | Callable[..., str], params: dict[str, Any]) -> str:
    """A text, or what a function of the test's parameters makes of them."""
    return value if isinstance(value, str) else _filled(value, params)


def _filled(value: Callable[..., Any], params: dict[str, Any]) -> Any:
    return value(**{name: params[name] for name in inspect.signature(value).parameters})


def main(arguments: list[str]) -> int:
    """Run the tests and write the table."""
    at = arguments.index("--") if "--" in arguments else len(arguments)
    paths, options = arguments[:at], arguments[at + 1 :]
    table = FaultTable()
    with contextlib.redirect_stdout(sys.stderr):
        pytest.main([*(paths or PATHS), "-q", "--rootdir", str(ROOT), *options], plugins=[table])
    print("| " + " | ".join(HEAD) + " |")
    print("|" + "---|" * len(HEAD))
    for row in sorted(table.rows.values(), key=lambda row: (row.injector, row.fault)):
        print("| " + " | ".join(row.cells()) + " |")
    broken = [row for row in table.rows.values() if row.seen().startswith("BROKEN")]
    return int(bool(broken) or not table.rows)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
