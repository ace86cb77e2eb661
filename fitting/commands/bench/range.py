"""`rapi bench range`: play a drive before a target, and keep the fringes of all three channels."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter, validators

from fitting.commands.shared._plugins import Plugins

Count = Annotated[int, Parameter(validator=validators.Number(gte=1, lte=100_000))]


def bench_range(
    bench: Path,
    drive: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    periods: Count = 1,
    records: Count = 1,
    waveform: Literal["triangle", "sine", "multisine"] = "triangle",
    plugin: Plugins = (),
    dry_run: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Play DRIVE on the bench of BENCH with a target, and write the fringes for `rapi range`.

    BENCH names the measurement arm's input beside those of interferometer and cavity. The drive is
    checked against the limits before the first byte is sent; the output is parked and switched off
    at the end, however it ends; records that were taken until then are written. How long a record
    can be is limited by the digitizer's memory at the rate that BENCH asks for.

    Parameters
    ----------
    bench
        `bench.toml`: addresses, limits, digitizer, optics, air.
    drive
        One period as CSV (`time_s,drive`), as `rapi compensate` writes it.
    output
        Folder for the fringe records; with `--dry-run`, for the bytes.
    periods
        How many periods a record holds.
    records
        How many records are taken, one for each trigger.
    waveform
        Waveform of the drive.
    plugin
        A Python file with drivers that BENCH names by their `kind`; its code is run. May be given
        several times.
    dry_run
        Connect to nothing: write what each instrument would be sent, byte by byte.
    json
        Print one JSON object on standard output.
    """
    from fitting._result_files import check_belongs, check_drive_unit
    from fitting.commands.shared._out import console, output_folder, print_json, write_sent
    from fitting.commands.shared._plugins import load_plugins, plugin_classes
    from fitting.commands.shared._progress import progress
    from fitting.commands.shared.files._measured_output import (
        check_fringes_output,
        check_sent_output,
    )
    from hardware import (
        AbstractDriver,
        check_against_bench,
        exit_on_signals,
        open_bench,
        read_bench,
    )
    from hardware import dry_run as dry
    from rapi_jax.internal import located
    from rapi_jax.io import FringeWriter, printable, read_drive, write_atomic

    drivers = plugin_classes(load_plugins(plugin), AbstractDriver)
    file = read_bench(bench, drivers=drivers)
    with located(printable(bench)):
        file.digitizer.range_inputs()
    check_belongs(drive)
    check_drive_unit(drive)
    with located(printable(drive)):
        (played,) = check_against_bench(read_drive(drive, waveform=waveform), file)
    out = console(json)
    if dry_run:
        check_sent_output(output)
        rehearsed = dry(file, drivers=drivers)
        with rehearsed.bench as simulated:
            simulated.record_fringes(played, periods=periods, records=records, store=_drop)
        write_sent(rehearsed.sent(), output, out)
        return 0
    check_fringes_output(output)
    output_folder(output.parent)  # now, not after a long measurement
    writer = FringeWriter(output, keep_partial=True)
    try:
        with (
            exit_on_signals(),
            progress("ranging", json) as say,
            writer,
            open_bench(file, drivers=drivers) as opened,
        ):
            last = opened.record_fringes(
                played,
                periods=periods,
                records=records,
                progress=lambda done, total, what: say(
                    f"record {done + 1} of {total}, {what}" if what else f"{total} record(s) done"
                ),
                store=writer.append,
            )
        write_atomic(output / "settings.json", opened.settings + "\n")
    except BaseException:  # an error, an interrupt, a request to stop
        kept = f"{writer.written} record(s) written to {output}" if writer.written else ""
        out.print(kept or "nothing was recorded", markup=False, soft_wrap=True)
        raise
    if json:
        print_json(
            {
                "schema": "rapi.fringes-taken/1",
                "records": str(output),
                "count": writer.written,
                "sample_hz": last.sample_hz,
                "samples": last.records[0].size,
            }
        )
        return 0
    out.print(
        f"{writer.written} record(s) of {last.records[0].size} samples at {last.sample_hz:g} Hz "
        f"written to {output}",
        markup=False,
        soft_wrap=True,
    )
    return 0


def _drop(records: object) -> None:
    """In a dry run nothing is kept."""
