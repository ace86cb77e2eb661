"""What `rapi batch` tells while it runs."""

import contextlib
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fitting.batch._record import JobRecord

_PAUSE_S = 10.0  # between lines where there is no bar


class BatchProgress:
    """Failures as lines on standard error; a bar on a terminal, elsewhere a line now and then."""

    def __init__(self, bar: Any, *, quiet: bool = False) -> None:
        self._bar, self._quiet = bar, quiet
        self._task = bar.add_task("", total=0, start=False)
        self._total = self._ended = self._kept = 0
        self._said = time.monotonic()

    def more(self, count: int) -> None:
        """So many jobs were added."""
        self._total += count
        if count:
            self._bar.update(self._task, total=self._total)
            self._bar.start_task(self._task)
            self._say(f"{count} job{'s' * (count > 1)} to do")

    def ended(self, record: "JobRecord", earlier: bool) -> None:
        """A job has ended; `earlier`: in a batch before this one."""
        from fitting.commands.run import fail

        if earlier:
            self._kept += 1
        else:
            self._bar.update(self._task, advance=1)
            self._ended += 1
            if self._ended < self._total and time.monotonic() - self._said >= _PAUSE_S:
                self._say(f"{self._ended} of {self._total} done")
        if record.exit_code:
            label = "not trusted" if record.status == "done" else record.status
            fail(label, f"{record.name}: {record.message}", self._bar.console)

    def kept(self) -> None:
        """Say how many results are of an earlier batch, and were not made again."""
        if self._kept:
            one = self._kept == 1
            self._say(
                f"{self._kept} result{'' if one else 's'} of an earlier run "
                f"{'was' if one else 'were'} kept",
                always=True,
            )

    def _say(self, line: str, *, always: bool = False) -> None:
        self._said = time.monotonic()
        if not self._quiet and (always or self._bar.disable):
            self._bar.console.print(line, markup=False)


@contextlib.contextmanager
def batch_progress(*, quiet: bool = False) -> Iterator[BatchProgress]:
    """The progress of one batch, on standard error; `quiet`: failures alone."""
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
        yield BatchProgress(bar, quiet=quiet)
