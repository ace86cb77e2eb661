"""`rapi fit`: identify a model from each of some recordings, or check the claim of one."""

import contextlib
import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import CycloptsError, Parameter, validators

from fitting.commands.shared._intervals import (
    POSTERIOR,
    Intervals,
    check_intervals,
    find_intervals,
    written_intervals,
)
from fitting.commands.shared._plugins import Plugins

Each = Literal["auto", "none", "lam", "lam,eta", "lam,eta,alpha"]


def fit(
    recording: Path,
    *recordings: Path,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    check: Path | None = None,
    plays: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=200))] = 10,
    order: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=9))] = 3,
    each: Each = "auto",
    operator: str = "RAPI",
    plugin: Plugins = (),
    choose: Annotated[bool, Parameter(negative="")] = False,
    weights: Literal["hysteresis", "uniform"] = "hysteresis",
    loss: Literal["squares", "huber", "student"] = "squares",
    starts: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=100))] = 6,
    history: bool = True,
    drift: Annotated[bool | None, Parameter(negative="--no-drift")] = None,
    nan: Literal["raise", "mask"] = "raise",
    intervals: Intervals | None = None,
    plots: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Identify an RA-PI model from RECORDING, and say whether to trust it.

    Writes `model.json` (readable), `model.rapi` (loadable) and pictures to the output folder. Exit
    code 0: trusted; 4: not to be trusted (everything is written all the same); 3: bad data. With
    several recordings each has a folder of its own name in the output folder, and 4 says that one
    is not to be trusted; `rapi batch` is for many.

    With `--check` nothing is fitted: RECORDING is a new measurement, of runs like those that were
    fitted or of scans made with certified drives, and is compared with the claimed error. Exit code
    0: the claim held, or none covers these scans, which are then only measured; 4: it did not; 3:
    bad data, or no run that the claim is of.

    Parameters
    ----------
    recording
        A folder with a `manifest.toml`, or a netCDF-4 file.
    recordings
        More recordings; code compiled for the first is reused for them.
    output
        Folder for the results; made if missing. Required, except with `--check`, which writes
        `check.json` there if it is given.
    check
        The result to compare RECORDING with: a folder that `rapi fit` wrote (the error of its model
        in each run, against its claim) or `rapi compensate` (how straight each scan is and how far
        it reaches, against its certificate, also where that claims nothing). Of the other options
        only `--output`, `--nan`, `--plugin` and `--json` go with it.
    plays
        Number of play operators, N1.
    order
        Order of the memoryless polynomial, N2.
    each
        What has a value for each play instead of a shared one; `auto` tries `none` and `lam`, and
        keeps what predicts held-out data better.
    operator
        Class of the hysteresis operator: of this package, or of a `--plugin` file.
    plugin
        Python file with an operator of your own; the code in it runs. May be repeated.
    choose
        Also choose the number of plays and the order on held-out data (slower).
    weights
        Weights of the runs: by hysteresis percentage (Eq. 26), or equal.
    loss
        Loss function: squares, with outliers left out and listed; or, for data that cannot be
        cleaned, huber or student (heavier tails), which leave nothing out.
    starts
        At most so many first guesses; two that end with nearly the same response are enough. Where
        the model leaves a residual that repeats, or no two agree, up to 28 more fits begin beside
        the best end.
    history
        Fit the plays' initial values in runs that do not repeat.
    drift
        Let the origin creep with the logarithm of session time; by default where a run has
        six periods or more.
    nan
        What to do with readings that are not finite: refuse, or leave those samples out.
    intervals
        Also write and show 95 % intervals: from standard errors (gauss-newton), by profile
        likelihood, or from the posterior (NUTS; needs the extra `bayes`; its draws go to
        `posterior.nc`, for ArviZ; exit code 4 where they are not to be trusted). By default none.
    plots
        Write pictures.
    json
        Print `model.json` (`check.json` with `--check`; a list with several recordings) on standard
        output, and messages on standard error.
    """
    options = dict(locals())
    if check is not None:
        _refuse_unused(options)
        from fitting.commands.shared._check_claim import check_result

        return check_result(recording, check, output, nan, plugin, json, options)
    if output is None:
        raise CycloptsError(msg="--output is missing.", command_chain=("fit",))
    check_intervals(intervals, loss)
    from fitting.batch.jobs._find import name_jobs
    from fitting.commands.shared._about import describe_recording, estimate_seconds
    from fitting.commands.shared._out import (
        check_output_folder,
        console,
        output_kept_if_written,
        print_json,
        read_json,
    )
    from fitting.commands.shared._plugins import find_operator
    from fitting.commands.shared._progress import progress
    from fitting.commands.shared.files._provenance import provenance
    from rapi_jax.io import read_recording

    from .run import BAD_DATA, DONE, UNTRUSTED, fail, failing_alone

    several = [recording, *recordings]
    usual = not _takes_another_time(options)
    kind = find_operator(operator, plugin)
    read = [read_recording(path, nan=nan) for path in several]  # all, before the first is fitted
    places = [output / name if recordings else output for name in name_jobs(several)]
    for place in places:
        check_fit_output(place, plots=plots, intervals=intervals)
    check_output_folder(output)
    about = {"provenance": provenance("rapi fit", options, ("recording", "recordings"))}
    tables: list[dict[str, Any]] = []
    notes: dict[str, Any] = {}
    out = console(json)
    trusted, failed = True, []
    for place, data, path in zip(places, read, several, strict=True):
        name = place.name
        seconds = estimate_seconds(data, "fit")
        begun = describe_recording(data, seconds, usual=usual)
        label = f"fitting {name}" if recordings else "fitting"
        _tell_faults(data, f"{name}: " if recordings else "")
        with (
            failing_alone(name, failed, alone=not recordings),
            progress(
                label, json, about=begun, expected_s=seconds if usual else None
            ) as report_step,
            output_kept_if_written(place),
        ):
            result, written = identify_into(
                data,
                place,
                kind=kind,
                plays=plays,
                order=order,
                each=each,
                choose=choose,
                weights=weights,
                loss=loss,
                starts=starts,
                history=history,
                drift=drift,
                plots=plots,
                intervals=intervals,
                report_step=report_step,
                more=about,
                source=str(path),
            )
        if failed[-1:] == [name]:
            continue
        ends, refused = (None, []) if intervals is None else written_intervals(written[0])
        for reason in refused:
            fail("no intervals", reason)
        trusted &= result.verdict.trusted and not refused
        if json:
            tables.append(read_json(written[0]))
            continue
        if recordings:
            out.rule(name)
        notes[name] = result.verdict.notes
        _print_result(out, result, ends, place, written, path, several=bool(recordings))
    if json:
        print_json(tables if recordings else tables[0])
    elif recordings and any(notes.values()):
        from fitting.report import fold_notes

        out.rule("notes")
        for line in fold_notes(notes):
            out.print(f"  - {line}", markup=False)
    return BAD_DATA if failed else DONE if trusted else UNTRUSTED


def _print_result(
    out: Any,
    result: Any,
    ends: Any,
    place: Path,
    written: Sequence[Path],
    source: Path,
    *,
    several: bool,
) -> None:
    """What a person reads first of a fit, where the rest is, and what to do next."""
    from fitting.report import render_brief
    from fitting.report.fit._next_step import describe_next
    from fitting.report.fit._page import PAGE

    verdict = result.verdict
    out.print(render_brief(result, ends, notes=not several))
    names = [one.name for one in written]
    rest = PAGE if PAGE in names else names[0]
    out.print(
        f"written to {place}: {', '.join(names)}. Each run, what was left out and predicted, the "
        f"starts and the notes in full are in {rest}.",
        markup=False,
        soft_wrap=True,
    )
    if not several or not verdict.trusted or verdict.with_gap:
        said = describe_next(
            verdict.reasons,
            with_gap=verdict.with_gap,
            source=str(source),
            folder=str(place),
            notes=verdict.notes,
        )
        out.print(said, markup=False, soft_wrap=True)


def _tell_faults(data: Any, prefix: str) -> None:
    """Say on standard error, before a fit, what is known to be wrong with its recording.

    Where no fit can be made of it the fit itself says so.
    """
    from fitting.recording_check._check import UNUSABLE, find_recording_faults
    from fitting.report._alike import fold_faults
    from rapi_jax import DataError

    from .run import fail

    with contextlib.suppress(DataError):
        faults = find_recording_faults(data)
        if any(fault.kind == UNUSABLE for fault in faults):
            return
        for line in fold_faults(faults):
            fail("known before the fit", f"{prefix}{line}")


def check_fit_output(folder: Path, *, plots: bool, intervals: Intervals | None) -> None:
    """Refuse an output folder in which a fit would write over what is not of an earlier one."""
    from fitting._result_files import check_output
    from fitting.report.fit._files import MODEL, PAGE, PICTURES, TABLE

    others = [POSTERIOR] if intervals == "posterior" else []
    check_output(folder, TABLE, [MODEL, *((*PICTURES, PAGE) if plots else ()), *others])


def identify_into(
    data: Any,
    folder: Path,
    *,
    kind: type[Any],
    each: Each,
    plots: bool,
    intervals: Intervals | None = None,
    report_step: Callable[[str], None] | None = None,
    more: Mapping[str, Any] | None = None,
    source: str | None = None,
    **settings: Any,
) -> tuple[Any, list[Path]]:
    """Identify a model by the options of the command: the result, and its files in `folder`.

    `more`: further keys of `model.json`. `source`: where the recording is.
    """
    from fitting.identification._identify import identify
    from fitting.report import write_fit

    structures = {"auto": None, "none": ()}.get(each, tuple(each.split(",")))
    result = identify(
        data, each=structures, operator=kind, throw=False, progress=report_step, **settings
    )
    found = None if intervals is None else find_intervals(result, intervals, report_step)
    more = dict(more or {}) | ({} if found is None else found.table)
    files = {} if found is None else found.files
    return result, write_fit(result, folder, plots=plots, more=more, files=files, source=source)


# Options by which a fit takes another time than those that were measured, see `_about`.
_TIMED = ("plays", "order", "each", "operator", "choose", "loss", "starts", "history", "intervals")
_CHECKING = {"recording", "recordings", "output", "check", "nan", "plugin", "json"}


def _takes_another_time(values: dict[str, Any]) -> bool:
    """Whether options were given with which no fit was timed."""
    defaults = inspect.signature(fit).parameters
    return any(values[name] != defaults[name].default for name in _TIMED)


def _refuse_unused(values: dict[str, Any]) -> None:
    """Refuse options of a fit where nothing is fitted."""
    if values["recordings"]:
        raise CycloptsError(
            msg="--check is of one recording, and several are given.", command_chain=("fit",)
        )
    defaults = inspect.signature(fit).parameters
    for name in values.keys() & defaults.keys() - _CHECKING:
        if values[name] != defaults[name].default:
            raise CycloptsError(
                msg=f"--{name} is for a fit, and with --check nothing is fitted.",
                command_chain=("fit",),
            )
