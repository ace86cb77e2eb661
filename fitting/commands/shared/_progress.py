"""Progress on standard error: a bar on a terminal, a plain line now and then elsewhere."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from typing import Any

from rich.console import Console
from rich.progress import Progress, ProgressColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.progress_bar import ProgressBar
from rich.text import Text

SWITCH = "RAPI_PROGRESS"
PLAIN_EVERY_S = 10.0  # between two plain lines
_NEVER_FULL = 0.97  # of the bar, before the work is done


@contextlib.contextmanager
def progress(
    title: str, as_json: bool, *, about: str = "", expected_s: float | None = None
) -> Iterator[Callable[[str], None]]:
    """Progress of some work on standard error; yields what takes a line for each step.

    `about`: a line that is written before the first step. `expected_s`: how long the work takes,
    about, for the bar; without it there is none. Where standard error is no terminal, a line is
    written every 10 s at most, so that short work is silent. With `RAPI_PROGRESS=0` in the
    environment `about` is all that is written.
    """
    del as_json  # standard error is for people either way
    target = Console(stderr=True)
    begun = spoken = time.monotonic()
    waiting = [about] if about else []

    def introduce() -> None:
        if waiting:
            target.print(f"{title}: {waiting.pop()}", markup=False, highlight=False, soft_wrap=True)

    quiet = os.environ.get(SWITCH) == "0"
    if quiet or not target.is_terminal:

        def report_plainly(line: str) -> None:
            nonlocal spoken
            introduce()
            now = time.monotonic()
            if not quiet and now - spoken >= PLAIN_EVERY_S:
                spoken = now
                text = f"{title}: {line} ({now - begun:.0f} s)"
                target.print(text, markup=False, highlight=False, soft_wrap=True)

        yield report_plainly
        return
    columns: list[Any] = [SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()]
    if expected_s is not None:
        columns.append(_Remaining(expected_s))
    with Progress(*columns, console=target, transient=True) as bar:
        task = bar.add_task(title, total=None)

        def report_step(line: str) -> None:
            introduce()
            bar.update(task, description=f"{title}: {line}")

        yield report_step


class _Remaining(ProgressColumn):
    """A bar over the time that the work takes, about, and what is left of it."""

    def __init__(self, expected_s: float):
        super().__init__()
        self.expected_s = expected_s

    def render(self, task: Any) -> Any:
        """The bar and the time left."""
        from rich.table import Table

        gone = task.elapsed or 0.0
        left = self.expected_s - gone
        share = min(_NEVER_FULL, gone / self.expected_s)
        text = f"about {left:.0f} s left" if left > 1.0 else "longer than estimated"
        row = Table.grid(padding=(0, 1))
        row.add_row(ProgressBar(total=1.0, completed=share, width=24), Text(text))
        return row
