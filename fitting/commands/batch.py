"""`rapi batch`: many recordings, each as the single command does it, resumable."""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import CycloptsError, Parameter, validators

if TYPE_CHECKING:
    from fitting.batch._record import JobRecord
    from fitting.batch.jobs._job import Job

Task = Literal["fit", "compensate", "diagnose", "range"]


def batch(
    *jobs: Annotated[str, Parameter(allow_leading_hyphen=True)],
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    do: Task | None = None,
    workers: Annotated[int, Parameter(validator=validators.Number(gte=0, lte=1024))] = 0,
    scheduler: str | None = None,
    retry: Annotated[bool, Parameter(negative="")] = False,
    watch: Annotated[bool, Parameter(negative="")] = False,
    parquet: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Do the same with many recordings: fit, compensate, diagnose or range each of JOBS.

    Each has a folder of its name in the output folder, with what the single command writes, and
    `job.json`; `results.csv`, `results.nc` and `report.html` are of all. Run again, it goes on
    where it was, whatever ended it: a job is done once for the same task, options, data and code.
    Options of the single command follow JOBS, as in `rapi batch recordings -o results --plays 12`.

    Exit code 0: all done, and each result to be trusted; 5: a job failed, was skipped, or its
    result is not to be trusted (its row says so); 3: another batch writes into the output folder,
    or it cannot be written to; 130: interrupted.

    Parameters
    ----------
    jobs
        A folder of recordings, a glob, several paths, or a TOML file that lists jobs; of models for
        `compensate`, of fringe records for `range`.
    output
        Folder for the results; made if missing.
    do
        What to do with each: fit (the default), compensate, diagnose or range.
    workers
        Processes of a cluster on this computer, a thread each. 0 does one job after the other in
        this process, which a job that crashes ends, too.
    scheduler
        Address of a Dask scheduler that runs already, instead: tcp://HOST:8786. Its workers must
        see recordings and output by the same paths.
    retry
        Do failed jobs again, too.
    watch
        Take recordings as they arrive, until Ctrl-C; table and page follow.
    parquet
        Write `results.parquet`, too, which needs the extra `parquet`.
    json
        Print one object with all records on standard output, and messages on standard error.
    """
    from fitting.batch._run import run_batch
    from fitting.commands.shared._out import output_folder
    from fitting.commands.shared._tasks import run_task

    if workers and scheduler is not None:
        raise _usage("--workers starts a cluster and --scheduler uses another: give one of them.")
    tabulate = _tabulator(parquet, page=watch)
    _check_output(output)
    source = _jobs_of(jobs, do, output, retry, watch)
    with contextlib.ExitStack() as stack:
        show = stack.enter_context(_progress())
        records = run_batch(
            source(),
            output_folder(output),
            run_task,
            workers=workers,
            scheduler=scheduler,
            tabulate=tabulate,
            report=show.ended,
            on_jobs=show.more,
        )
        _write_page(records, output)
    return _conclude(records, output, json)


def _check_output(folder: Path) -> None:
    """Refuse a folder whose table or page is not of a batch, before any job. Raises `OutputError`.

    Of a batch are those beside a table that begins as its own does.
    """
    from fitting.batch.table._write import CSV, NETCDF, PAGE, PARQUET
    from rapi_jax.io import OutputError, printable

    there = [folder / name for name in (CSV, NETCDF, PARQUET, PAGE) if (folder / name).exists()]
    if not there or _is_own_table(folder / CSV):
        return
    raise OutputError(
        f"the output {printable(there[0])} is there and is not of a batch. Choose another folder "
        "with `-o`, or move it away."
    )


def _is_own_table(path: Path) -> bool:
    with contextlib.suppress(OSError, ValueError):
        with path.open(encoding="utf-8") as table:
            return table.read(200).startswith("recording,status,exit_code")
    return False


def _usage(message: str) -> CycloptsError:
    return CycloptsError(msg=message, command_chain=("batch",))


def _jobs_of(
    tokens: Sequence[str], do: Task | None, output: Path, retry: bool, watched: bool
) -> Callable[[], Iterable[list["Job"]]]:
    """What makes the jobs that the command line names; options and paths are checked before."""
    from fitting.batch.jobs._find import find_recordings
    from fitting.commands.shared._tasks import parse_options

    first = next((i for i, token in enumerate(tokens) if token.startswith("-")), len(tokens))
    given, options = list(tokens[:first]), tokens[first:]
    if not given:
        raise _usage("JOBS is missing: name it before the options.")
    if len(given) == 1 and given[0].endswith(".toml") and Path(given[0]).name != "manifest.toml":
        if watched:
            raise _usage("--watch is for folders, and not for a list of jobs.")
        listed = _listed_jobs(Path(given[0]), do, options, output, retry)
        return lambda: [listed]
    task = do or "fit"
    made = _Maker(task, parse_options(task, options, Path()), output, retry)
    if watched:
        from fitting.batch.jobs._watch import watch

        return lambda: (made.jobs(paths) for paths in watch(task, given))
    found = made.jobs(find_recordings(task, given))
    return lambda: [found]


class _Maker:
    """Makes jobs of paths; each has a name of its own."""

    def __init__(self, task: Task, options: dict[str, Any], output: Path, retry: bool) -> None:
        from fitting.commands.shared._tasks import complete_options

        self._task, self._output, self._retry = task, output, retry
        self._options = complete_options(task, options)
        self._names: dict[str, str] = {}

    def jobs(self, paths: Sequence[str]) -> list["Job"]:
        from fitting.batch.jobs._find import name_jobs

        new = [path for path in paths if path not in self._names]
        names = name_jobs(new, self._names.values())
        self._names |= dict(zip(new, names, strict=True))
        return [self.job(path, self._names[path], self._options) for path in paths]

    def job(self, path: str, name: str, options: dict[str, Any]) -> "Job":
        from fitting.batch.jobs._job import Job
        from rapi_jax import DataError
        from rapi_jax.io import printable

        whole = Path(path).resolve()
        if (self._output / name).resolve() in (whole, *whole.parents):
            raise DataError(
                f"{printable(path)}: its results would be written into it. Choose another output "
                "folder with `-o`."
            )
        return Job(name, path, whole, self._task, options, redo=self._retry)


def _listed_jobs(
    path: Path, do: Task | None, tokens: Sequence[str], output: Path, retry: bool
) -> list["Job"]:
    """The jobs of a TOML file. A job's own options count most, then those of the command line."""
    from fitting.batch.jobs._find import name_jobs
    from fitting.batch.jobs._jobs_file import option_tokens, read_jobs_file
    from fitting.commands.shared._tasks import complete_options, parse_options

    table = read_jobs_file(path)
    task = do or table.do or "fit"
    folder = path.parent
    common = parse_options(task, option_tokens(table.options), folder)
    common |= parse_options(task, tokens, Path())
    maker = _Maker(task, common, output, retry)
    recordings = [str(folder / one.recording) for one in table.job]
    unnamed = [r for r, one in zip(recordings, table.job, strict=True) if one.name is None]
    named = [one.name for one in table.job if one.name is not None]
    rest = iter(name_jobs(unnamed, named))
    return [
        maker.job(
            recording,
            one.name or next(rest),
            complete_options(
                task, common | parse_options(task, option_tokens(one.options), folder)
            ),
        )
        for recording, one in zip(recordings, table.job, strict=True)
    ]


def _tabulator(parquet: bool, *, page: bool) -> Callable[[Sequence["JobRecord"], Path], None]:
    """What writes the table while the batch runs; `page`: and the page.

    Raises `DataError` where Parquet is asked for and cannot be written.
    """
    from fitting.batch.table import write_table
    from fitting.batch.table._parquet import import_pyarrow

    if parquet:
        import_pyarrow()

    def tabulate(records: Sequence["JobRecord"], folder: Path) -> None:
        write_table(records, folder, parquet=parquet)
        if page:
            _write_page(records, folder)

    return tabulate


def _write_page(records: Sequence["JobRecord"], folder: Path) -> None:
    from fitting.batch.table import write_page

    write_page(records, folder)


class _Progress:
    """Failures as lines on standard error, and on a terminal a bar with the time to come."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar
        self._task = bar.add_task("", total=0, start=False)
        self._total = 0

    def more(self, count: int) -> None:
        self._total += count
        if count:
            self._bar.update(self._task, total=self._total)
            self._bar.start_task(self._task)

    def ended(self, record: "JobRecord", earlier: bool) -> None:
        from .run import fail

        if not earlier:
            self._bar.update(self._task, advance=1)
        if record.exit_code:
            label = "not trusted" if record.status == "done" else record.status
            fail(label, f"{record.name}: {record.message}", self._bar.console)


@contextlib.contextmanager
def _progress() -> Iterator[_Progress]:
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
        yield _Progress(bar)


def _conclude(records: Sequence["JobRecord"], output: Path, json: bool) -> int:
    from fitting.commands.shared._out import console, print_json

    from .run import DONE, PARTLY_FAILED

    counts = {
        status: sum(one.status == status for one in records)
        for status in ("done", "failed", "skipped")
    }
    untrusted = sum(one.status == "done" and one.exit_code != 0 for one in records)
    if json:
        rows = [one.to_dict() for one in records]
        print_json({"schema": "rapi.batch/1", **counts, "untrusted": untrusted, "jobs": rows})
    else:
        line = ", ".join(f"{count} {status}" for status, count in counts.items() if count)
        if untrusted:
            line += f" ({untrusted} not to be trusted)"
        console(json).print(f"{line}; written to {output}", markup=False, soft_wrap=True)
    return DONE if all(one.exit_code == 0 for one in records) else PARTLY_FAILED
