"""What `rapi batch` tells while it runs."""

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fitting.batch._record import JobRecord


class BatchProgress:
    """Failures as lines on standard error, and on a terminal a bar with the time to come."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar
        self._task = bar.add_task("", total=0, start=False)
        self._total = 0

    def more(self, count: int) -> None:
        """So many jobs were added."""
        self._total += count
        if count:
            self._bar.update(self._task, total=self._total)
            self._bar.start_task(self._task)

    def ended(self, record: "JobRecord", earlier: bool) -> None:
        """A job has ended; `earlier`: in a batch before this one."""
        from fitting.commands.run import fail

        if not earlier:
            self._bar.update(self._task, advance=1)
        if record.exit_code:
            label = "not trusted" if record.status == "done" else record.status
            fail(label, f"{record.name}: {record.message}", self._bar.console)


@contextlib.contextmanager
def batch_progress() -> Iterator[BatchProgress]:
    """The progress of one batch, on standard error."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    target = Console(stderr=True, soft_wrap=True, highlight=False)
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=target, transient=True, disable=not target.is_terminal) as bar:
        yield BatchProgress(bar)
