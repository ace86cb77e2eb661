"""`rapi compensate`: drives under which a laser scans straight."""

import shlex
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from fitting.commands.shared._plugins import Plugins

Positive = Annotated[float, Parameter(validator=lambda _, value: _check_positive(value))]


def compensate(
    model: Path,
    *,
    span: Positive,
    frequency: Annotated[list[float], Parameter(consume_multiple=True, negative="")],
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    bias: float | None = None,
    limits: Path | None = None,
    inverse: Literal["exact", "paper"] = "exact",
    extrapolate: Annotated[bool, Parameter(negative="")] = False,
    untrusted: Annotated[bool, Parameter(negative="")] = False,
    without: Annotated[tuple[str, ...], Parameter(negative="", show_default=False)] = (),
    rise: float = 0.5,
    corner: float = 0.02,
    samples: int = 8192,
    recording: Path | None = None,
    plugin: Plugins = (),
    plots: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write drives that make the response of MODEL a straight scan.

    For each rate: `drive_<HZ>Hz.csv` (`time_s,drive`, one period, from its minimum), the same as
    generator codes (`.afg`) and with its target as netCDF (`.nc`); and `certificate.json`: the
    proof that the model can be inverted and, for a trusted fit, the nonlinearity to expect. All
    drives are written, or none is. Earlier drives in the folder are replaced: those that are not
    written again are removed.

    Parameters
    ----------
    model
        A folder that `rapi fit` or `rapi diagnose` wrote, or the `model.rapi` in it.
    span
        Peak to peak of the whole scan, in the model's response unit (GHz), corners included.
    frequency
        Scan rates, Hz.
    output
        Folder for the drives; made if missing.
    bias
        Middle of the drive's range, V; by default that of the identified range.
    limits
        TOML file with `low_v`, `high_v`, `slew_v_per_s` and, if wanted, `step_v`,
        `max_frequency_hz`. By default what was seen in identification: its range and a twentieth
        more, three times its steepest slope (right after a turn a straight scan needs twice). For a
        drive in um the keys are `low_um`, `high_um`, `slew_um_per_s`, `step_um`.
    inverse
        `exact` inverts the model sample by sample; `paper` fits the paper's inverse operator.
    extrapolate
        Also make drives beyond the range, the rates and the peak-to-peak voltages identified.
    untrusted
        Also make drives from a model that is not to be trusted; without it the exit code is 4.
        With it no drive is refused for its peak-to-peak voltage; the certificate notes one that was
        not recorded.
    without
        An effect of MODEL to leave out of what is inverted, by its name in the diagnosis: for one
        that only the reading has. An etalon between laser and interferometer that sends no light
        back into the laser is in the reading alone; compensated, it would be put on the light. May
        be given several times.
    rise
        Share of the period on the way up: 0.5 is a triangle, 0.9 a sawtooth.
    corner
        Share of the period over which each turn is rounded.
    samples
        Samples in a period.
    recording
        For `--inverse paper`: what to identify the inverse on, instead of the model's own response.
    plugin
        A Python file with effects or an operator of your own, which MODEL names; its code is run.
        May be given several times.
    plots
        Write a picture.
    json
        Print `certificate.json` on standard output.
    """
    options = dict(locals())
    from fitting.commands.compensate._drives import compensate_into
    from fitting.commands.shared._out import console, print_json
    from fitting.commands.shared._progress import progress
    from fitting.commands.shared.files._drive_files import print_removed
    from fitting.commands.shared.files._provenance import provenance

    with progress("compensating", json) as report_step:
        made, report, drive_unit, removed, written = compensate_into(
            model,
            output,
            span=span,
            frequency=frequency,
            bias=bias,
            limits=limits,
            inverse=inverse,
            extrapolate=extrapolate,
            untrusted=untrusted,
            without=without,
            rise=rise,
            corner=corner,
            samples=samples,
            recording=recording,
            plugin=plugin,
            plots=plots,
            report_step=report_step,
            more={"provenance": provenance("rapi compensate", options, ("model",))},
        )
    out = console(json)
    print_removed(out, output, removed)
    if json:
        print_json(report)
        return 0
    out.print(_table(made, drive_unit, report["unit"]))
    if report["expected"] is not None:
        from fitting.report.compensation._page import describe_expected

        said = f"Expected of the device: {describe_expected(report)}"
        out.print(said, markup=False, soft_wrap=True)
    else:
        out.print(
            f"Nothing is claimed of how straight the device will scan: {report['unclaimed']}. "
            f"`rapi fit NEW-SCANS --check {shlex.quote(str(output))}` measures how straight the "
            "new scans are and how far they reach.",
            markup=False,
            soft_wrap=True,
        )
    for note in report["notes"]:
        out.print(f"note: {note}", markup=False, soft_wrap=True)
    out.print(
        "The drives are where the recording's was: behind an amplifier, divide by its gain for the "
        "generator.",
        markup=False,
        soft_wrap=True,
    )
    out.print(f"written to {output}: {', '.join(path.name for path in written)}", markup=False)
    return 0


def _check_positive(value: float) -> None:
    if not 0 < value < float("inf"):
        raise ValueError("must be a positive number.")


def _table(made: list[Any], unit: str, response_unit: str) -> Any:
    from rich.table import Table

    table = Table(title="Drives for a straight scan", title_justify="left")
    slope = f"smallest slope ({response_unit}/{unit})"
    names = ("rate (Hz)", f"drive ({unit})", f"slew ({unit}/s)", slope, "inverse")
    for name in names:
        table.add_column(name, justify="right")
    for one in made:
        row = one.to_dict()
        table.add_row(
            f"{row['excitation_hz']:g}",
            f"{row['drive_min']:.4f} to {row['drive_max']:.4f}",
            f"{row['slew_max']:.4g}",
            f"{row['certificate']['slope_min']:.4g} at {row['certificate']['slope_at']:.4g} {unit}",
            one.inverse,
        )
    return table
