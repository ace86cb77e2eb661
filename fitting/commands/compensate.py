"""`rapi compensate`: drives under which a laser scans straight."""

from collections.abc import Callable, Mapping
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
    generator codes (`.afg`) and with its target as netCDF (`.nc`); `certificate.json`, what was
    proved about the model before a drive was made. All drives are written, or none is.

    Parameters
    ----------
    model
        A folder that `rapi fit` wrote, or the `model.rapi` in it.
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
        Also make drives beyond the range, the rates and the swings that were identified.
    untrusted
        Also make drives from a model that is not to be trusted; without it the exit code is 4. Its
        swings are then not looked at either.
    rise
        Share of the period on the way up: 0.5 is a triangle, 0.9 a sawtooth.
    corner
        Share of the period over which each turn is rounded.
    samples
        Samples in a period.
    recording
        For `--inverse paper`: what to identify the inverse on, instead of the model's own response.
    plugin
        A Python file with effects of your own, which MODEL names; its code is run. May be given
        several times.
    plots
        Write a picture.
    json
        Print `certificate.json` on standard output.
    """
    options = dict(locals())
    from fitting.commands.shared._out import console, print_json
    from fitting.commands.shared._progress import progress
    from fitting.commands.shared.files._provenance import provenance

    with progress("compensating", json) as report_step:
        made, report, drive_unit, written = compensate_into(
            model,
            output,
            span=span,
            frequency=frequency,
            bias=bias,
            limits=limits,
            inverse=inverse,
            extrapolate=extrapolate,
            untrusted=untrusted,
            rise=rise,
            corner=corner,
            samples=samples,
            recording=recording,
            plugin=plugin,
            plots=plots,
            report_step=report_step,
            more={"provenance": provenance("rapi compensate", options, ("model",))},
        )
    if json:
        print_json(report)
        return 0
    out = console(json)
    out.print(_table(made, drive_unit))
    expected = report["expected"]
    if expected is not None:
        from fitting._units import quantity

        out.print(
            f"Expected of the device: at most {quantity(expected['high'], expected['unit'])} rms "
            "off a straight line on either branch (97.5 %), from runs that were left out.",
            markup=False,
        )
    else:
        out.print(
            "Nothing is claimed of how straight the device will scan; measure it.", markup=False
        )
    for note in report["notes"]:
        out.print(f"note: {note}", markup=False)
    out.print(f"written to {output}: {', '.join(path.name for path in written)}", markup=False)
    return 0


def compensate_into(
    model: Path,
    output: Path,
    *,
    span: float,
    frequency: list[float],
    bias: float | None,
    limits: Path | None,
    inverse: str,
    extrapolate: bool,
    untrusted: bool,
    rise: float,
    corner: float,
    samples: int,
    recording: Path | None,
    plugin: Plugins,
    plots: bool,
    report_step: Callable[[str], None] = lambda line: None,
    more: Mapping[str, Any] | None = None,
) -> tuple[list[Any], dict[str, Any], str, list[Path]]:
    """Drives by the options of the command: each, the certificate, their unit, the files written.

    `more`: further keys of `certificate.json`. Raises `UntrustedModel` where the model makes no
    drive.
    """
    import dataclasses

    import numpy as np

    from fitting._result_files import check_output
    from fitting.commands.shared._limits import check_limits_unit
    from fitting.commands.shared._model import check_trusted, load_model
    from fitting.commands.shared._nonlinearity_band import scan_bands
    from fitting.commands.shared._out import output_folder
    from fitting.commands.shared._plugins import plugin_effects, plugin_operators
    from fitting.commands.shared.files._certificate_report import certificate_report
    from fitting.commands.shared.files._drive_files import (
        CERTIFICATE,
        check_no_other_drives,
        check_rates,
        drive_files,
        generator_waveforms,
        write_drives,
    )
    from fitting.diagnosis._data_checks import check_units
    from rapi_jax import Identified, LimitError, ModelError, linear_scan
    from rapi_jax import compensate as compensated
    from rapi_jax.io import read_limits, read_recording

    ecdl, about = load_model(model, plugin_effects(plugin), plugin_operators(plugin))
    check_trusted(about, allowed=untrusted)
    seen = identified = Identified.from_dict(about["identified"])
    if not about.get("trusted", False):  # without a claim there are no swings that it holds for
        identified = dataclasses.replace(seen, amplitudes=())
    allowed = None if limits is None else read_limits(limits)
    if not frequency or not all(np.isfinite(f) and f > 0 for f in frequency):
        raise ModelError(f"`--frequency` must be positive rates in Hz, but is {frequency}.")
    check_limits_unit(allowed, limits, about["drive_unit"])
    check_rates(frequency)
    try:
        targets = linear_scan(
            frequency,
            span=span,
            rise=rise,
            corner=corner,
            samples=samples,
            unit=about["response_unit"],
        )
    except ValueError as error:
        raise ModelError(str(error)) from error
    names = drive_files(frequency, about["drive_unit"], inverse == "paper", plots)
    check_output(output, CERTIFICATE, names)
    check_no_other_drives(output)
    measured = None if recording is None else read_recording(recording)
    if measured is not None:
        check_units(about, measured)
    folder = output_folder(output)
    used = ecdl
    fitted = None
    if inverse == "paper":
        report_step("identifying the inverse")
        used, fitted = _identify_inverse(ecdl, about, identified, measured, report_step)
    made = []
    for target in targets:
        report_step(f"{target.excitation_hz:g} Hz")
        try:
            one = compensated(
                used,
                target,
                identified=identified,
                limits=allowed,
                bias=bias,
                extrapolate=extrapolate,
            )
        except LimitError as error:
            raise LimitError(_say_which(target.excitation_hz, allowed is None, error)) from error
        made.append(one)
    report_step("band on the nonlinearity")
    bands, note = scan_bands(model, ecdl, made)
    report = certificate_report(made, about, seen, allowed, fitted, ecdl)
    for drive, band in zip(report["drives"], bands, strict=True):
        drive["nonlinearity_band"] = band
    report["notes"] += [] if note is None else [note]
    report |= dict(more or {})
    bounds = identified.limits() if allowed is None else allowed
    waves = generator_waveforms([one.drive for one in made], about["drive_unit"], bounds)
    if not waves:
        report["notes"].append(f"no generator file: the drive is in {about['drive_unit']}, not V.")
    written = write_drives(
        folder, made, about, report, used if inverse == "paper" else None, plots, waves
    )
    return made, report, about["drive_unit"], written


def _check_positive(value: float) -> None:
    if not 0 < value < float("inf"):
        raise ValueError("must be a positive number.")


def _say_which(hertz: float, of_recording: bool, error: Exception) -> str:
    """Which scan a limit refuses, and whose limit it is."""
    text = f"the scan at {hertz:g} Hz: {error}"
    if of_recording:
        text += (
            " These limits are the recording's own range, with three times its steepest slope: "
            "give the device's with `--limits`."
        )
    return text


def _identify_inverse(
    ecdl: Any, about: dict[str, Any], identified: Any, data: Any, report_step: Any
) -> Any:
    """The paper's inverse operator, identified on a recording or on the model's own response."""
    from fitting.identification.inverse._identify_inverse import (
        fit_inverse,
        identify_inverse,
        swapped_model,
    )

    if data is None:
        swapped = swapped_model(ecdl, identified, about["response_unit"], about["drive_unit"])
        result = fit_inverse(swapped, ecdl.operator, throw=False, progress=report_step)
    else:
        from fitting import fit

        forward = fit(
            ecdl, data, starts=1, guess=False, hold_out=False, throw=False, progress=report_step
        )
        result = identify_inverse(data, forward, throw=False, progress=report_step)
    return result.ecdl, result


def _table(made: list[Any], unit: str) -> Any:
    from rich.table import Table

    table = Table(title="Drives for a straight scan", title_justify="left")
    names = ("rate (Hz)", f"drive ({unit})", f"slew ({unit}/s)", "smallest slope", "inverse")
    for name in names:
        table.add_column(name, justify="right")
    for one in made:
        row = one.to_dict()
        table.add_row(
            f"{row['excitation_hz']:g}",
            f"{row['drive_min']:.4f} to {row['drive_max']:.4f}",
            f"{row['slew_max']:.4g}",
            f"{row['certificate']['slope_min']:.4g} at {row['certificate']['slope_at']:.4g}",
            one.inverse,
        )
    return table
