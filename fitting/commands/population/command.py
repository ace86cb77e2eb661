"""`rapi population`: many fits of one device as a population, and a new recording against it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

Covariate = Literal["time", "temperature"]


def _list_default(names: Sequence[str]) -> str:
    """A default as it would be typed."""
    return " ".join(names) or "none"


def population(
    result: Path,
    *results: Path,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    check: Path | None = None,
    drift: Literal["auto", "line", "smooth"] = "auto",
    structure: Literal["auto", "diagonal", "factor", "full"] = "auto",
    without: Annotated[tuple[str, ...], Parameter(negative="", show_default=_list_default)] = (
        "d_0",
    ),
    ignore: Annotated[
        tuple[Covariate, ...], Parameter(negative="", show_default=_list_default)
    ] = (),
    keep_outliers: Annotated[bool, Parameter(negative="")] = False,
    nan: Literal["raise", "mask"] = "raise",
    plots: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Follow one device over many recordings: means, drift and scatter of its parameters.

    Writes `population.json` and `population.png`, one panel per parameter. Recordings that do not
    fit the others are listed and left out; so are fits that are not to be trusted. When and how
    warm a recording was is read from its manifest: `recorded_at` and `temperature_c`. Exit code 0:
    done, and with `--check` nothing changed; 4: the device changed, or the new fit is not to be
    trusted; 3: bad data.

    Parameters
    ----------
    result
        A folder that `rapi fit` wrote, or one whose subfolders are such, as of `rapi batch`.
    results
        More results.
    output
        Folder for the results; made if missing.
    check
        A new recording, or a folder that `rapi fit` wrote of one: which parameter changed, and how
        sure that is. A recording is fitted first, from the model of the latest result, into the
        folder `check/NAME` of the output. A result among the others is left out there.
    drift
        `line`: a line in time for each parameter; `smooth`: a line and a smooth curve for each
        (minutes with ten parameters); `auto`: a curve for those where the recordings show one.
    structure
        Structure of the covariance between recordings: `diagonal`; `factor` (diagonal and one
        common factor); `full`; `auto`: the one with the most evidence.
    without
        Parameters that are no property of the device. May be repeated.
    ignore
        A covariate to leave out: time or temperature. May be repeated.
    keep_outliers
        Let outliers count.
    nan
        What to do with readings of a recording to check that are not finite: refuse, or leave out.
    plots
        Write the picture.
    json
        Print `population.json` on standard output, and messages on standard error.
    """
    options = dict(locals())
    from fitting._result_files import check_output
    from fitting.commands.shared._out import (
        check_output_folder,
        console,
        output_folder,
        print_json,
        read_json,
    )
    from fitting.commands.shared._progress import progress
    from fitting.commands.shared.files._provenance import provenance
    from fitting.population import check_against, fit_population
    from fitting.report.population._files import write_population

    from ..run import DONE, UNTRUSTED

    folders = _find_results([result, *results], check)
    covariates = tuple(name for name in ("time", "temperature") if name not in ignore)
    check_output(output, "population.json", ["population.png"] * plots)
    check_output_folder(output)  # nothing is left where the fits are refused
    with progress("population", json) as report_step:
        report_step(f"{len(folders)} fits")
        found = fit_population(
            folders, covariates=covariates, drift=drift, structure=structure, without=without,
            keep_outliers=keep_outliers,
        )  # fmt: skip
        change = None
        if check is not None:
            report_step("new recording")
            new = _new_result(check, folders, found, output_folder(output) / "check", nan)
            change = check_against(found, new)
    written = write_population(
        found,
        output_folder(output),
        change=change,
        plots=plots,
        more={"provenance": provenance("rapi population", options, ("result", "results"))},
    )
    if json:
        print_json(read_json(written[0]))
    else:
        from fitting.report.population._terminal import render_change, render_population

        out = console(json)
        out.print(render_population(found))
        if change is not None:
            out.print(render_change(change))
        names = ", ".join(path.name for path in written)
        out.print(f"written to {output}: {names}", markup=False, soft_wrap=True)
    return UNTRUSTED if change is not None and change.changed else DONE


def _find_results(paths: Sequence[Path], check: Path | None) -> list[Path]:
    """The folders that hold a fit, in or below `paths`, but for the one to check.

    Raises `DataError` where a path has none.
    """
    from fitting.report import TABLE
    from rapi_jax import DataError
    from rapi_jax.io import printable

    found: dict[Path, Path] = {}
    for path in paths:
        if path.name == TABLE and path.is_file():
            path = path.parent
        below = [path] if (path / TABLE).is_file() else sorted(p.parent for p in _tables(path))
        if not below:
            kind = "no such folder" if not path.exists() else f"no {TABLE} in it or in its folders"
            raise DataError(
                f"{printable(path)}: {kind}. Give folders that `rapi fit` or `rapi batch` wrote."
            )
        found |= {one.resolve(): one for one in below}
    if check is not None:
        place = check.parent if check.name == TABLE else check
        found.pop(place.resolve(), None)
    return list(found.values())


def _tables(path: Path) -> list[Path]:
    from fitting.report import TABLE

    return list(path.glob(f"*/{TABLE}")) if path.is_dir() else []


def _new_result(check: Path, folders: Sequence[Path], found: Any, output: Path, nan: Any) -> Any:
    """The result to compare with the population: as given, or of a recording that is fitted."""
    from fitting import fit
    from fitting.commands.shared._model import UntrustedModel, load_model
    from fitting.commands.shared._out import output_folder
    from fitting.diagnosis._data_checks import check_units
    from fitting.population.estimates._record import read_record
    from fitting.report import TABLE, write_fit
    from rapi_jax.io import read_recording

    if check.name == TABLE or (check / TABLE).is_file():
        new: Any = check
    else:
        recording = read_recording(check, nan=nan)
        ecdl, about = load_model(_latest(folders, found))
        check_units(about, recording)
        new = output_folder(output / _name(check))
        write_fit(fit(ecdl, recording, hold_out=False, throw=False), new, plots=False)
    record = read_record(new, 0)
    if not record.trusted:
        raise UntrustedModel(
            f"the fit of {record.label} is not to be trusted, so it says nothing of a change: "
            f"{'; '.join(record.reasons)}"
        )
    return new


def _name(recording: Path) -> str:
    """The name of a recording's folder or file."""
    path = recording.resolve()
    return path.name if path.is_dir() else path.stem


def _latest(folders: Sequence[Path], found: Any) -> Path:
    """The folder of the latest recording of the population."""
    from fitting.population.estimates._record import read_record

    last = next(one for one in reversed(found.recordings) if not one.outlier)
    return next(one for one in folders if read_record(one, 0).sha256 == last.sha256)
