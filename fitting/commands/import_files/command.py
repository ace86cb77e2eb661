"""`rapi import`: files of oscilloscopes and other programs as a recording."""

import glob
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter, validators

from ._option_checks import check_drive_and_skips, check_fringes, made_drive, refuse

Positive = Annotated[float | None, Parameter(validator=validators.Number(gt=0))]
Count = Annotated[int | None, Parameter(validator=validators.Number(gte=1))]


def import_files(
    file: Path,
    *files: Path,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    time: str | None = None,
    drive: str | None = None,
    response: str | None = None,
    fringes: str | None = None,
    interferometer: str | None = None,
    cavity: str | None = None,
    cavity_spacing: str | None = None,
    drive_file: Path | None = None,
    time_unit: str | None = None,
    drive_unit: str | None = None,
    response_unit: str | None = None,
    drive_scale: float = 1.0,
    response_scale: float = 1.0,
    sample_rate: Positive = None,
    drive_amplitude: Positive = None,
    drive_offset: float = 0.0,
    drive_rate: Positive = None,
    drive_phase: float = 0.0,
    drive_waveform: Literal["triangle", "sine"] = "triangle",
    drive_as: Literal["measured", "averaged", "fitted"] = "measured",
    table: Annotated[tuple[int, ...], Parameter(negative="", show_default=False)] = (),
    rate: Annotated[tuple[float, ...], Parameter(negative="", show_default=False)] = (),
    waveform: Literal["triangle", "sine", "multisine", "step", "other"] | None = None,
    cut: bool = True,
    skip_periods: Annotated[int, Parameter(validator=validators.Number(gte=0))] = 0,
    skip_seconds: Annotated[float, Parameter(validator=validators.Number(gte=0))] = 0.0,
    decimate: Count = None,
    max_samples: Annotated[int, Parameter(validator=validators.Number(gte=1000))] = 400_000,
    nan: Literal["raise", "mask"] = "raise",
    response_origin: Literal["session", "run"] = "session",
    response_lag: Annotated[float, Parameter(validator=validators.Number(gte=0))] = 0.0,
    recorded_at: str | None = None,
    temperature: str | None = None,
    units_checked: Annotated[bool, Parameter(negative="")] = False,
    picture: bool = True,
    dry_run: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Make a recording from FILE, a table that an oscilloscope or another program wrote.

    FILE may be text (separated by commas, semicolons, tabs or spaces, also with decimal commas;
    with the headers of Tektronix, Keysight, Rigol, Siglent, Rohde & Schwarz, LeCroy, PicoScope and
    aixACCT), .mat, .npy, .npz, HDF5, netCDF-4, TDMS, or a force curve of JPK or Igor.

    A record of several scan rates or swings is cut into one run for each. Everything that was
    found, done and assumed is printed and written into the manifest. After it stands what
    `rapi check` says of the recording, and the next command.

    Parameters
    ----------
    file
        A table with columns of time, drive and response. Or an earlier import, to be joined with
        others whose columns or sampling rates are different.
    files
        More files of the same session and device; their runs follow in the order given.
    output
        Folder for the recording, or a file whose name ends in .nc. An earlier import there is
        replaced, and this is reported; anything else there is refused. Without this option nothing
        is written.
    time
        Column of the time: its name, or its number, counted from 0. Default: the column whose name
        is that of a time.
    drive
        Column of the drive, by name or number. Default: the column called `drive`. Required where
        there is none, unless `--drive-amplitude` and `--drive-rate` describe the drive.
    response
        Column of the response, by name or number. Default: the column called `response`. Required
        where there is none, unless `--fringes` is given.
    fringes
        Column of an interferometer's signal, by name or number. The optical frequency is read from
        its fringes, so no response is needed. Sampling must be even, four samples or more a fringe.
    interferometer
        What one fringe is, with its unit: the free spectral range ("40.8 MHz"), the delay
        ("24.5 ns") or the optical path difference ("7.34 m"). In a fibre that is its length times
        its group index; in a Michelson interferometer it counts there and back.
    cavity
        Column of the transmission of a Fabry-Perot cavity, if there is one. It calibrates the
        fringes and shows where the laser turns.
    cavity_spacing
        Free spectral range of the cavity, with its unit ("1.5 GHz").
    drive_file
        File that holds the drive, where each channel has a file of its own.
    time_unit
        s, ms, us, ns, min or h. Default: the file's unit; s if it names none.
    drive_unit
        V, mV, uV, kV, m, mm, um, nm, pm, A, mA, uA, T, mT, uT, rad, mrad, urad, deg, N, mN, uN or
        nN. Default: the file's unit.
    response_unit
        GHz, MHz, kHz, Hz, THz, V, mV, uV, kV, m, mm, um, nm, pm, C, mC, uC, nC, pC, rad, mrad,
        urad, deg, N, mN, uN, nN, A, mA, uA, T, mT, uT, C/m2 or uC/cm2. Default: the file's unit.
    drive_scale
        Factor by which the drive is multiplied, such as the gain of an amplifier. Give
        `--drive-unit` with it: the unit after the multiplication.
    response_scale
        Factor by which the response is multiplied, such as a sensor's um per V. Give
        `--response-unit` with it: the unit after the multiplication. With fringes: -1 where the
        optical frequency falls as the drive rises.
    sample_rate
        Sampling rate in Hz, where the file has no times.
    drive_amplitude
        Amplitude, peak to peak and in `--drive-unit`, of a drive that was sent but not recorded.
    drive_offset
        Middle of that drive, in `--drive-unit`.
    drive_rate
        Rate of that drive, Hz.
    drive_phase
        How long before the first sample that drive was at its minimum, in periods.
    drive_waveform
        Waveform of that drive.
    drive_as
        What to write as the drive where it repeats. `measured`: its readings. `averaged`: the mean
        of its periods at equal phases. `fitted`: the triangle or sine nearest to the readings. The
        response always stays as it was read. An oscilloscope adds noise to the drive that the laser
        never saw; a fit refuses such a drive, and the last two choices remove the noise.
    table
        Of a FILE that holds several tables, the number of one to take, counted from 1; may be given
        several times. Default: all.
    rate
        Scan rate in Hz; may be given several times. Default: found in the drive.
    waveform
        Waveform of the drive. Default: found in the drive.
    cut
        Cut the record into one run for each rate and swing.
    skip_periods
        Leave out this many periods at the beginning of each run, in which the device had not yet
        settled.
    skip_seconds
        Leave out this many seconds at the beginning of each run.
    decimate
        Replace this many samples by their average. By default none, unless `--max-samples` is
        exceeded. It rounds the turns of the drive, so that fast runs seem to swing by less.
    max_samples
        Recordings with more samples than this are averaged down to it, and a line says so.
    nan
        What to do about missing readings. `raise`: refuse the file. `mask`: keep them as gaps.
    response_origin
        `session`: all runs share one zero of the response. `run`: each run has a zero of its own.
    response_lag
        Known delay of the response's reading, s.
    recorded_at
        Date and time of the recording, such as 2026-11-24T10:00:00Z.
    temperature
        Temperature of the device in deg C: a number, or a column.
    units_checked
        The units are right even where the numbers suggest otherwise, such as those of a laser of
        less than 10 MHz/V. Kept in the manifest.
    picture
        Write a picture of all runs beside the recording.
    dry_run
        Write nothing; show what would be written.
    json
        Print one JSON object on standard output.
    """
    check_drive_and_skips(drive_as, drive_amplitude, skip_periods, skip_seconds)
    made = made_drive(
        drive_amplitude, drive_offset, drive_rate, drive_phase, drive_waveform,
        column=drive is not None or drive_file is not None,
    )  # fmt: skip
    numbers = [path.name for path in files if _is_number(path)]
    for option, given in (("--rate", rate), ("--table", table)):
        if numbers and given:
            several = " ".join(f"{option} {one}" for one in (*(f"{x:g}" for x in given), *numbers))
            refuse(f"{option} takes one number; for several say `{several}`.")
    paths = _expand([file, *files])
    if drive_file is not None and len(paths) > 1:
        refuse("--drive-file can be given with one FILE only. Import the others apart.")
    check_fringes(
        fringes, interferometer, response, response_unit, response_scale, cavity, cavity_spacing
    )
    from fitting.commands.shared._out import console, print_json
    from fitting.commands.shared._progress import progress

    with progress("importing", json) as report_step:  # what follows loads for two or three seconds
        report_step(", ".join(path.name for path in paths[:3]) + (", ..." if paths[3:] else ""))
        from fitting._json import replace_nonfinite
        from fitting.recording_check._check import check_recording
        from fitting.report._alike import fold_notes
        from fitting.report.recording_check._next_step import describe_next
        from fitting.report.recording_check._terminal import render_recording_check
        from rapi_jax.internal import import_command
        from rapi_jax.io import (
            ImportOptions,
            check_output,
            import_recording,
            printable,
            write_import,
        )

        options = ImportOptions(
            time=time, drive=drive, response=response,
            drive_file=None if drive_file is None else str(drive_file),
            time_unit=time_unit, drive_unit=drive_unit, response_unit=response_unit,
            drive_scale=drive_scale, response_scale=response_scale,
            sample_rate=sample_rate, made=made, drive_as=drive_as, tables=table, rates=rate,
            waveform=waveform,
            cut=cut, skip_periods=skip_periods, skip_seconds=skip_seconds,
            decimate=decimate, max_samples=max_samples, nan=nan, response_origin=response_origin,
            response_lag_s=response_lag, recorded_at=recorded_at, temperature_c=temperature,
            fringes=fringes, interferometer=interferometer,
            cavity=cavity, cavity_spacing=cavity_spacing, units_checked=units_checked,
        )  # fmt: skip
        replaced = output is not None and check_output(output)  # before a long file is read
        imported = import_recording(paths, options)
        checked = check_recording(imported.recording)
        written: list[Path] = []
        if output is not None and not dry_run:
            shown = _picture(imported) if picture else None
            written = write_import(imported, output, picture=shown)
    label = None if output is None else printable(output)
    step = describe_next(
        checked,
        source=str(output) if written else None,
        again=import_command([file, *files], options),
        output="my-recording" if output is None else str(output),
    )
    if json:
        content: dict[str, Any] = {
            "schema": "rapi.import/1",
            "recording": None if output is None else str(output),
            "written": [str(path) for path in written],
            "replaced": replaced and not dry_run,
            "notes": list(imported.notes),
            "check": replace_nonfinite(checked.to_dict()),
            "next_step": step,
        }
        print_json(content)
        return 0
    out = console(json)
    for note in fold_notes(imported.notes):
        out.print(f"  - {note}", markup=False, soft_wrap=True)
    out.print(render_recording_check(checked, label or printable(paths[0].name)))
    if label is None:
        done = "nothing was written: add `-o my-recording` to write it"
    elif dry_run:
        instead = ", in place of the earlier import that is there" if replaced else ""
        done = f"nothing was written (--dry-run); this would be: {label}{instead}"
    else:
        named = ", ".join(path.name for path in written[1:])
        done = f"written to {label}" + (f", with {named}" if named else "")
        done += "; the earlier import that was there is replaced" if replaced else ""
    out.print(done, markup=False, soft_wrap=True)
    out.print(step, markup=False, soft_wrap=True)
    return 0


def _expand(paths: list[Path]) -> list[Path]:
    """Paths as they are, and those that a pattern names, for shells that leave it as it is."""
    found: list[Path] = []
    for path in paths:
        pattern = any(sign in str(path) for sign in "*?[") and not path.exists()
        names = sorted(glob.glob(str(path))) if pattern else []
        found += [Path(name) for name in names] or [path]
    return found


def _is_number(path: Path) -> bool:
    """Whether what was taken for a file is a number, and no file."""
    try:
        float(str(path))
    except ValueError:
        return False
    return not path.exists()


def _picture(imported: Any) -> bytes:
    from rapi_jax.plot import overview, png

    return png(overview(imported.recording))
