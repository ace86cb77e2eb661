"""`rapi import`: files of oscilloscopes and other programs as a recording."""

import glob
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import CycloptsError, Parameter, validators

if TYPE_CHECKING:
    from rapi_jax.io import MadeDrive

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
    rate: Annotated[tuple[float, ...], Parameter(negative="", show_default=False)] = (),
    waveform: Literal["triangle", "sine", "multisine", "step", "other"] | None = None,
    cut: bool = True,
    decimate: Count = None,
    max_samples: Annotated[int, Parameter(validator=validators.Number(gte=1000))] = 400_000,
    nan: Literal["raise", "mask"] = "raise",
    response_origin: Literal["session", "run"] = "session",
    response_lag: Annotated[float, Parameter(validator=validators.Number(gte=0))] = 0.0,
    recorded_at: str | None = None,
    temperature: str | None = None,
    picture: bool = True,
    dry_run: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Make a recording from FILE: a table of an oscilloscope or another program.

    Read are text (commas, semicolons with decimal commas, tabs, spaces; headers of Tektronix,
    Keysight, Rigol, Siglent, Rohde & Schwarz, LeCroy, PicoScope, aixACCT), .mat, .npy, .npz, HDF5,
    netCDF-4, TDMS, and force curves of JPK and Igor. A record of several scan rates or swings is
    cut into runs. What was found, done and assumed is listed, and kept in the manifest; then
    follows what `rapi check` says.

    Parameters
    ----------
    file
        A table with columns of time, drive and response; or an earlier import, to be joined with
        others, where columns or sampling rates differed between them.
    files
        More of them, of the same session and device, each as runs that follow.
    output
        Folder for the recording, or a file that ends in .nc. An earlier import there is replaced,
        anything else is left and refused. Without it nothing is written, as with `--dry-run`.
    time
        Column of the time: its name, or its number from 0; by default one that is called so.
    drive
        Column of the drive.
    response
        Column of the response.
    fringes
        Column of an interferometer's fringes, in place of a response: the optical frequency is read
        from them. Their sampling must be even, with four samples or more a fringe.
    interferometer
        Of the fringes, with its unit: free spectral range ("40.8 MHz"), delay ("24.5 ns") or
        optical path difference ("7.34 m": of a fibre, its length times its group index; in a
        Michelson, there and back).
    cavity
        Column of a Fabry-Perot cavity's transmission, which calibrates the fringes and shows where
        the laser turns; may be missing.
    cavity_spacing
        Its free spectral range, with the unit ("1.5 GHz").
    drive_file
        File that holds the drive, where each channel has a file of its own.
    time_unit
        s, ms, us, ns, min or h; by default the file's, else s.
    drive_unit
        V, mV, uV, kV, m, mm, um, nm or pm; by default the file's.
    response_unit
        GHz, MHz, kHz, Hz, THz, V, mV, uV, kV, m, mm, um, nm, pm, C, mC, uC, nC or pC; by default
        the file's.
    drive_scale
        Factor on the drive, such as an amplifier's gain; its unit is then to be given.
    response_scale
        Factor on the response, such as a sensor's um per V; its unit is then to be given. Of
        fringes, -1 where the optical frequency falls with the drive.
    sample_rate
        Samples a second (Hz), where the file has no times.
    drive_amplitude
        Of a drive that was not recorded: peak to peak, in `--drive-unit`.
    drive_offset
        Its centre.
    drive_rate
        Its rate, Hz.
    drive_phase
        Where it is at the first sample, in periods after its minimum.
    drive_waveform
        What it is.
    rate
        Scan rate in Hz; by default found in the drive. May be given several times.
    waveform
        Of the drive; by default found.
    cut
        Make a run of each stretch of one rate and swing.
    decimate
        Average so many samples into one.
    max_samples
        A file with more samples than this is averaged, which is said.
    nan
        Readings that are missing: refuse the file (raise), or keep them as gaps (mask).
    response_origin
        Whether all runs share one zero of the response (session), or have one each (run).
    response_lag
        Known latency of the reading, s.
    recorded_at
        When it was recorded, such as 2026-11-24T10:00:00Z.
    temperature
        Of the device, deg C: a number, or a column.
    picture
        Write a picture of all runs beside the recording.
    dry_run
        Write nothing: show what would be written.
    json
        Print one JSON object on standard output.
    """
    made = _made_drive(
        drive_amplitude, drive_offset, drive_rate, drive_phase, drive_waveform,
        column=drive is not None or drive_file is not None,
    )  # fmt: skip
    paths = _expand([file, *files])
    if drive_file is not None and len(paths) > 1:
        _refuse("--drive-file goes with one FILE alone.")
    if fringes is not None or interferometer is not None:
        of_response = response is not None or response_unit not in (None, "GHz")
        if of_response or abs(response_scale) != 1.0:
            _refuse(
                "a response is read from --fringes: give no --response, no other --response-unit "
                "than GHz, and as --response-scale 1 or -1 alone."
            )
    elif cavity is not None or cavity_spacing is not None:
        _refuse("--cavity and --cavity-spacing go with --fringes and --interferometer.")
    from fitting._json import replace_nonfinite
    from fitting.commands.shared._out import console, print_json
    from fitting.recording_check._check import check_recording
    from fitting.report.recording_check._terminal import render_recording_check
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
        sample_rate=sample_rate, made=made, rates=rate, waveform=waveform, cut=cut,
        decimate=decimate, max_samples=max_samples, nan=nan, response_origin=response_origin,
        response_lag_s=response_lag, recorded_at=recorded_at, temperature_c=temperature,
        fringes=fringes, interferometer=interferometer,
        cavity=cavity, cavity_spacing=cavity_spacing,
    )  # fmt: skip
    if output is not None:
        check_output(output)  # now, before a long file is read
    imported = import_recording(paths, options)
    checked = check_recording(imported.recording)
    written: list[Path] = []
    if output is not None and not dry_run:
        written = write_import(imported, output, picture=_picture(imported) if picture else None)
    if json:
        table: dict[str, Any] = {
            "schema": "rapi.import/1",
            "recording": None if output is None else str(output),
            "written": [str(path) for path in written],
            "notes": list(imported.notes),
            "check": replace_nonfinite(checked.to_dict()),
        }
        print_json(table)
        return 0
    out = console(json)
    for note in imported.notes:
        out.print(f"  - {note}", markup=False, soft_wrap=True)
    out.print(
        render_recording_check(checked, printable(paths[0].name if output is None else output))
    )
    if output is None:
        done = "nothing was written: add `-o my-recording` to write it"
    elif dry_run:
        done = f"nothing was written (--dry-run); this would be: {printable(output)}"
    else:
        named = ", ".join(path.name for path in written[1:])
        done = f"written to {printable(output)}" + (f", with {named}" if named else "")
    out.print(done, markup=False, soft_wrap=True)
    return 0


def _expand(paths: list[Path]) -> list[Path]:
    """Paths as they are, and those that a pattern names, for shells that leave it as it is."""
    found: list[Path] = []
    for path in paths:
        pattern = any(sign in str(path) for sign in "*?[") and not path.exists()
        names = sorted(glob.glob(str(path))) if pattern else []
        found += [Path(name) for name in names] or [path]
    return found


def _refuse(message: str) -> None:
    raise CycloptsError(msg=message, command_chain=("import",))


def _made_drive(
    amplitude: float | None,
    offset: float,
    rate: float | None,
    phase: float,
    waveform: Literal["triangle", "sine"],
    *,
    column: bool,
) -> "MadeDrive | None":
    if amplitude is None and rate is None:
        if offset or phase:
            _refuse("--drive-offset and --drive-phase go with --drive-amplitude and --drive-rate.")
        return None
    if amplitude is None or rate is None:
        _refuse("--drive-amplitude and --drive-rate go together: a drive is made from both.")
        return None
    if column:
        _refuse("give a column of the drive, or --drive-amplitude and --drive-rate, not both.")
    from rapi_jax.io import MadeDrive

    return MadeDrive(amplitude, rate, offset, phase, waveform)


def _picture(imported: Any) -> bytes:
    from rapi_jax.plot import overview, png

    return png(overview(imported.recording))
