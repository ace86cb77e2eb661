"""`rapi range`: distance and velocity of a target from a folder of fringe records."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

Method = Literal["counting", "counting-region", "resample-fft", "resample-phase"]


def range_command(
    records: Path,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    method: Method = "resample-phase",
    kalman: Annotated[bool | None, Parameter(negative="--no-kalman")] = None,
    expected: Annotated[
        tuple[float, float] | None, Parameter(name="--expected", negative="")
    ] = None,
    plots: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Range a target: distance of every scan in RECORDS, and distance and velocity over time.

    Writes `range.json`, `range.csv` (one row per scan), `range.png` and `report.html`, a page with
    the error budget. What is wrong or doubtful about the records is listed. Exit code 0: done; 3:
    bad data; where no scan at all gave a distance, the files are written nevertheless.

    Parameters
    ----------
    records
        A folder with a `manifest.toml` (`rapi.fringes/1`), as `rapi bench range` writes it.
    output
        Folder for the results; made if missing.
    method
        Estimator of the distance: `resample-phase` (least sensitive to noise), `resample-fft`, or
        the paper's, `counting` from cavity peak to cavity peak and `counting-region` over a fixed
        region.
    kalman
        Follow the target by a Kalman filter, or take each scan as of a target at rest; by default
        it is followed where there are four scans, of both directions.
    expected
        Lowest and highest possible distance, m: it decides between two solutions where a short
        record and fast motion leave two. By default any positive distance.
    plots
        Write the picture.
    json
        Print `range.json` on standard output, and messages on standard error.
    """
    options = dict(locals())
    from fitting._result_files import check_output
    from fitting.commands.shared._out import console, output_folder, print_json, read_json
    from fitting.commands.shared.files._provenance import provenance
    from rapi_jax.io import printable, read_fringe_records

    from .run import BAD_DATA, DONE, fail

    check_expected(expected)
    read = read_fringe_records(records)
    check_output(output, "range.json", ["range.csv", "report.html"] + ["range.png"] * plots)
    folder = output_folder(output)
    with _live(read, shown=not json) as on_part:
        found, content, written = range_into(
            read,
            folder,
            printable(records.resolve().name),
            method=method,
            kalman=kalman,
            expected=expected,
            plots=plots,
            on_part=on_part,
            more={"provenance": provenance("rapi range", options, ("records",))},
        )
    if json:
        print_json(read_json(written[0]))
    else:
        from fitting.report.ranging._terminal import render_summary

        out = console(json)
        out.print(render_summary(content))
        names = ", ".join(path.name for path in written)
        out.print(f"written to {folder}: {names}", markup=False, soft_wrap=True)
    if not found.summary.counted:
        fail("bad data", why_no_distance(found))
        return BAD_DATA
    return DONE


def check_expected(expected: tuple[float, float] | None) -> None:
    """Raise `DataError` where least and largest distance are not in this order."""
    from rapi_jax import DataError

    if expected is not None and not 0 <= expected[0] < expected[1]:
        raise DataError(
            f"`--expected` {expected[0]:g} {expected[1]:g}: give the lowest possible distance "
            "in m, 0 or more, then the highest."
        )


def range_into(
    records: Any,
    folder: Path,
    name: str,
    *,
    method: Method,
    kalman: bool | None,
    expected: tuple[float, float] | None,
    plots: bool,
    on_part: Callable[[Any], None] = lambda part: None,
    more: Mapping[str, Any] | None = None,
) -> tuple[Any, dict[str, Any], list[Path]]:
    """Range a target by the options of the command: what was found, its JSON, the files written.

    `name`: of the records, as the page shows it. `more`: further keys of `range.json`.
    """
    import time

    from fitting.report.ranging._content import range_content
    from fitting.report.ranging._files import write_range
    from rapi_jax.ranging import range_records
    from rapi_jax.ranging.budget import measured_budget

    began = time.monotonic()
    found = range_records(
        records, method=method, kalman=kalman, expected_m=expected, on_part=on_part
    )
    content = range_content(
        found,
        budget=measured_budget(found),
        phase_index=_phase_index(records),
        expected_m=expected,
        seconds=time.monotonic() - began,
        name=name,
    )
    content |= dict(more or {})
    return found, content, write_range(found, content, folder, plots=plots)


def why_no_distance(found: Any) -> str:
    """Why no scan gave a distance, in one line."""
    return f"no scan gave a distance: {_why(found)}"


def _why(found: Any) -> str:
    """What is wrong with most of the scans."""
    problems = [problem for problem in found.table.problem if problem]
    return max(problems, key=problems.count) if problems else "see the faults"


def _phase_index(records: Any) -> float | None:
    """The index that a fringe at one frequency sees, where the air is known."""
    from rapi_jax.ranging.air import refractive_index

    if records.air is None:
        return None
    return refractive_index(records.air, records.wavelength_m).value


def _live(records: Any, *, shown: bool) -> Any:
    """A context with what to call for each part read: rows on a terminal, nothing elsewhere."""
    import contextlib

    from rich.live import Live

    from fitting.commands.shared._out import console
    from fitting.report.ranging._terminal import LiveRows
    from rapi_jax.ranging.air import group_index

    out = console(False)
    if not (shown and out.is_terminal):
        return contextlib.nullcontext(lambda part: None)

    @contextlib.contextmanager
    def follow() -> Any:
        index = 1.0
        if records.air is not None:
            index = group_index(records.air, records.wavelength_m).value
        rows = LiveRows(index)
        with Live(rows, console=out, transient=True, refresh_per_second=8) as live:

            def add(part: Any) -> None:
                rows.add(part)
                live.refresh()

            yield add

    return follow()
