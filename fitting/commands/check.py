"""`rapi check`: what is in a recording and what it allows, without a fit."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter


def check(
    recording: Path,
    *recordings: Path,
    nan: Literal["raise", "mask"] = "raise",
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Say what is in RECORDING, what is wrong with it, and what it allows.

    Nothing is fitted and nothing is written. The last line is the next command: a fit, or another
    import that mends the recording. Exit code 0: nothing was found that speaks against a fit. 4: a
    fit would be refused; the reasons are listed, and what to do. 3: a recording cannot be read.

    Parameters
    ----------
    recording
        A folder with a `manifest.toml`, or a netCDF-4 file.
    recordings
        More recordings. One that cannot be read is reported, and the others are still checked.
    nan
        What to do about readings that are not numbers. `raise`: refuse the recording. `mask`: leave
        those samples out.
    json
        Print one JSON object on standard output; a list of them for several recordings.
    """
    from fitting._json import replace_nonfinite
    from fitting.commands.shared._out import console, print_json
    from fitting.recording_check._check import check_recording
    from fitting.report.recording_check._next_step import describe_next
    from fitting.report.recording_check._terminal import render_recording_check
    from rapi_jax import DataError
    from rapi_jax.internal import IMPORT_COMMAND, located
    from rapi_jax.io import printable, read_recording

    from .run import BAD_DATA, DONE, UNTRUSTED, fail

    out, code = console(json), DONE
    tables: list[dict[str, Any]] = []
    for path in (recording, *recordings):
        label = printable(path)
        try:
            data = read_recording(path, nan=nan)
            with located(label):
                found = check_recording(data)
        except DataError as error:
            if not recordings:
                raise
            fail("bad data", error)
            code = BAD_DATA
            continue
        if not found.sound and code == DONE:
            code = UNTRUSTED
        again = data.provenance.get(IMPORT_COMMAND)
        step = describe_next(found, source=str(path), again=again, output=str(path))
        if json:
            table = {"recording": str(path), **replace_nonfinite(found.to_dict())}
            tables.append({**table, "next_step": step})
        else:
            out.print(render_recording_check(found, label), soft_wrap=False)
            out.print(step, markup=False, soft_wrap=True)
    if json:
        print_json(tables if recordings else tables[0])
    return code
