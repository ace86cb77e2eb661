"""`rapi batch`: many recordings, each as the single command does it, resumable."""

import contextlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter, validators

from ._jobs import Task, job_source, usage_error
from ._progress import batch_progress

if TYPE_CHECKING:
    from fitting.batch._record import JobRecord


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
        Processes of a cluster on this computer, one thread each. 0 runs the jobs one after another
        in this process; a job that crashes then ends the batch.
    scheduler
        Instead of `--workers`: address of a running Dask scheduler, tcp://HOST:8786. Its workers
        must see recordings and output by the same paths.
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
        raise usage_error(
            "--workers starts a cluster and --scheduler uses another: give one of them."
        )
    tabulate = _tabulator(parquet, page=watch)
    _check_output(output)
    source = job_source(jobs, do, output, retry, watch)
    with contextlib.ExitStack() as stack:
        show = stack.enter_context(batch_progress(quiet=json))
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
        show.kept()
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


def _conclude(records: Sequence["JobRecord"], output: Path, json: bool) -> int:
    from fitting.commands.run import DONE, PARTLY_FAILED
    from fitting.commands.shared._out import console, print_json

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
        fits = all(one.task == "fit" for one in records)
        if fits and untrusted and untrusted == counts["done"]:
            hint = (
                "no fit is to be trusted: where a model leaves more than noise, `rapi batch` with "
                "`--do diagnose` says which effect it lacks"
            )
            console(json).print(hint, markup=False, soft_wrap=True)
    return DONE if all(one.exit_code == 0 for one in records) else PARTLY_FAILED
