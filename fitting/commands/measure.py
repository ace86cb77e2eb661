"""`rapi measure`: run drives on a bench of instruments, real or simulated."""

import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter, validators

from fitting.commands.shared._plugins import Plugins

if TYPE_CHECKING:
    from hardware import LabBench
    from rapi_jax import Drive

_LISTS = ("certificate.json", "drives.json")  # of drives, beside them
Periods = Annotated[int, Parameter(validator=validators.Number(gte=1, lte=1000))]


def measure(
    bench: Path,
    drive: Path,
    *drives: Path,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    periods: Periods = 3,
    waveform: Literal["triangle", "sine", "multisine"] = "triangle",
    raw: Path | None = None,
    plugin: Plugins = (),
    dry_run: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Play each DRIVE on the bench of BENCH and record the laser's frequency.

    Every drive is checked against the bench's limits before the first byte is sent. The output is
    parked and switched off at the end, however it ends; what was recorded until then is written.

    Parameters
    ----------
    bench
        `bench.toml`: addresses, limits, digitizer, optics.
    drive
        One period as CSV (`time_s,drive`), as `rapi compensate` writes it; or the folder of
        `rapi compensate` or `rapi drive`, for all of its drives.
    drives
        More drives or folders, played one after the other.
    output
        Folder for the recording, or a file that ends in .nc; with `--dry-run`, for the bytes.
    periods
        How many periods are recorded of each drive; with fewer than three a fit and a check cannot
        tell noise from what repeats.
    waveform
        Waveform of the drives.
    raw
        Empty folder for the digitizer's records, so that they can be read again.
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
        check_recording_output,
        check_sent_output,
    )
    from hardware import (
        AbstractDriver,
        check_against_bench,
        check_raw_folder,
        exit_on_signals,
        open_bench,
        read_bench,
    )
    from hardware import dry_run as dry
    from rapi_jax import LimitError, repeated
    from rapi_jax.internal import join_refusals, located
    from rapi_jax.io import printable, read_drive, write_recording

    drivers = plugin_classes(load_plugins(plugin), AbstractDriver)
    file = read_bench(bench, drivers=drivers)
    several, refused = [], []
    named = _expand((drive, *drives))
    for path in named:
        check_belongs(path)
        check_drive_unit(path)
        one = repeated(read_drive(path, waveform=waveform), periods)
        with located(printable(path)):
            try:
                several += check_against_bench(one, file)
            except LimitError as error:
                refused.append((printable(path), error))
    if refused:
        raise join_refusals(refused)
    unlisted = [path for path in named if not _is_listed(path)]
    out = console(json)
    if dry_run:
        check_sent_output(output)
        rehearsed = dry(file, drivers=drivers)
        with rehearsed.bench as simulated:
            simulated.measure(several)
        for line in _describe_scans(several, periods):
            out.print(line, markup=False, soft_wrap=True)
        write_sent(rehearsed.sent(), output, out)
        return 0
    check_recording_output(output)
    output_folder(output.parent)  # now, not after a long measurement
    folder = None if raw is None else output_folder(raw)
    if folder is not None:
        check_raw_folder(folder)  # now, with nothing connected
    with (
        exit_on_signals(),
        progress("measuring", json) as say,
        open_bench(file, drivers=drivers) as opened,
    ):
        try:
            recording = opened.measure(
                several,
                progress=lambda done, total, what: say(
                    f"run {done + 1} of {total}, {what}" if what else f"{total} run(s) done"
                ),
                raw=folder,
            )
            write_recording(recording, output)
        except BaseException:  # an error, an interrupt, a request to stop
            out.print(_save_incomplete(opened, output), markup=False, soft_wrap=True)
            raise
    faults = {k: v for k, v in recording.provenance.items() if k.endswith("_faults")}
    if json:
        print_json(
            {
                "schema": "rapi.measured/1",
                "recording": str(output),
                "runs": [run.name for run in recording.runs],
                "faults": faults,
                "unlisted": [str(path) for path in unlisted],
                "data_sha256": recording.sha256(),
            }
        )
        return 0
    for line in _readout_lines(faults):
        out.print(line, markup=False, soft_wrap=True)
    if unlisted:
        out.print(_describe_unlisted(unlisted), markup=False, soft_wrap=True)
    out.print(f"{len(recording.runs)} run(s) written to {output}", markup=False, soft_wrap=True)
    out.print(_describe_next([] if unlisted else named, output), markup=False, soft_wrap=True)
    return 0


def _expand(paths: Sequence[Path]) -> list[Path]:
    """The drives that are named, and of a folder those in its list, slow ones first.

    Raises `DataError` for a folder without a list of drives.
    """
    from fitting._result_files import listed_files
    from rapi_jax import DataError
    from rapi_jax.io import printable

    found: list[Path] = []
    for path in paths:
        if not path.is_dir():
            found.append(path)
            continue
        names = {name for one in _LISTS for name in listed_files(path / one)}
        drives = [name for name in names if name.endswith(".csv")]
        if not drives:
            raise DataError(
                f"{printable(path)}: a folder without drives of `rapi compensate` or `rapi drive` "
                f"({' or '.join(_LISTS)} would list them). Name the CSV files in it."
            )
        found += [path / name for name in sorted(drives, key=_by_number)]
    return found


def _by_number(name: str) -> tuple[float, str]:
    """The key by which drive_5Hz.csv comes before drive_10Hz.csv."""
    number = re.search(r"\d+(?:\.\d+)?", name)
    return (float(number[0]) if number else 0.0, name)


def _readout_lines(faults: Mapping[str, str]) -> list[str]:
    """What was doubtful in reading each run, two lines of each, and what to do about it."""
    from fitting.identification.data_checks.readings._doubtful import shorten

    return [
        f"{name.removesuffix('_faults')}: its reading was doubtful: {shorten(text)}. Record that "
        "drive again before a fit."
        for name, text in faults.items()
    ]


def _describe_scans(drives: Sequence["Drive"], periods: int) -> list[str]:
    """What would be played, a line a scan, and how long it takes at least."""
    import numpy as np

    lines = []
    for drive in drives:
        low, high = float(drive.value.min()), float(drive.value.max())
        slope = float(np.abs(np.diff(drive.value)).max()) / drive.step_s
        lines.append(
            f"{drive.rate:.6g} Hz: {low:.4g} to {high:.4g} V, at most {slope:.4g} V/s: within the "
            "limits of the bench"
        )
    seconds = sum(periods / drive.rate for drive in drives)
    lines.append(
        f"{len(drives)} scan(s), of which {periods} period(s) each are recorded: "
        f"{seconds:.3g} s, without the time to settle and to read out"
    )
    return lines


def _describe_next(drives: Sequence[Path], output: Path) -> str:
    """The command that comes next: a check against the certificate of `drives`, or a fit.

    `drives`: none where a list beside them does not name all.
    """
    folders = {path.parent for path in drives}
    scan = shlex.quote(str(output))
    if len(folders) == 1 and (listed := folders.pop() / "certificate.json").exists():
        return f"Next: `rapi fit {scan} --check {shlex.quote(str(listed.parent))}`"
    return f"Next: `rapi fit {scan} -o result`"


def _is_listed(drive: Path) -> bool:
    """Whether a list beside a drive, of `rapi compensate` or `rapi drive`, names it."""
    from fitting._result_files import listed_files

    return any(drive.name in listed_files(drive.with_name(name)) for name in _LISTS)


def _describe_unlisted(drives: Sequence[Path]) -> str:
    """What could not be checked of drives that no list beside them names."""
    from rapi_jax.io import printable

    named = ", ".join(printable(path, 80) for path in drives[:3])
    named += f" and {len(drives) - 3} more" if len(drives) > 3 else ""
    one = len(drives) == 1
    return (
        f"no certificate.json or drives.json beside {named} lists {'it' if one else 'them'}: the "
        "bench's limits were checked, but not whether "
        f"{'it is' if one else 'they are'} complete, as written and in V, nor how straight "
        f"{'its scan' if one else 'their scans'} should be."
    )


def _save_incomplete(opened: "LabBench", output: Path) -> str:
    """Write what was recorded before the failure, and report it; no instrument is queried any more.

    A recording that cannot be written is reported, not raised: the failure itself must be seen.
    """
    from rapi_jax import DataError
    from rapi_jax.io import OutputError, write_recording

    if not opened.so_far:
        return "nothing was recorded"
    try:
        write_recording(opened.incomplete(), output)
    except (OutputError, DataError) as error:
        return f"what was recorded could not be written: {error}"
    return f"{len(opened.so_far)} finished run(s) written to {output}"
