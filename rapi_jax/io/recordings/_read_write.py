"""A recording from and to a path, whatever its form."""

import os
from pathlib import Path

from rapi_jax._arguments import takes
from rapi_jax._errors import DataError
from rapi_jax.io._safe import StrPath, located, open_regular, printable
from rapi_jax.io._units import check_plausible
from rapi_jax.recording._recording import Recording

from ._build import NanPolicy, check_nan_policy
from ._folder import MANIFEST, read_folder, write_folder
from ._netcdf import read_netcdf, write_netcdf

_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_recording(path: StrPath, *, nan: NanPolicy = "raise") -> Recording:
    """Read a recording: a folder with a `manifest.toml`, that manifest, or a netCDF-4 file.

    Drives in mV come back in V, responses in MHz or Hz in GHz; other units stay. Keys of the
    manifest that are not known are kept in `provenance`, as text; two of them have a meaning:
    `recorded_at = 2026-11-24T10:00:00Z`, when it was recorded, with its offset from UTC, and
    `temperature_c = 21.3`, the device's temperature.

    - `nan`: "raise" refuses a response that is not finite, but for as many samples as the run's
      `missing_readings` says; "mask" makes all such samples NaN, to be left out. A drive or clock
      that is not finite is always refused.

    Raises `DataError`, in one line, where the recording is not there, damaged, hostile, incomplete,
    or implausible in its units.

    >>> from rapi_jax.io import read_recording, write_recording
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> recording = Recording.of(drives, [predict(paper_device(), drive) for drive in drives])
    >>> write_recording(recording, "my-recording")
    >>> read_recording("my-recording").sha256() == recording.sha256()
    True
    """
    check_nan_policy(nan)
    path = Path(path)
    if path.is_dir():
        recording = read_folder(path, nan=nan)
    elif path.name == MANIFEST:
        recording = read_folder(path.parent, nan=nan)
    else:
        recording = _read_file(path, nan)
    with located(printable(path)):
        check_plausible(recording)
    return recording


def _read_file(path: Path, nan: NanPolicy) -> Recording:
    with open_regular(path) as file:
        start = file.read(len(_HDF5))
    if start == _HDF5:
        return read_netcdf(path, nan=nan)
    label = printable(path)
    if not start:
        raise DataError(f"{label}: the file is empty. Record or export it again.")
    if start.startswith(b"CDF"):
        raise DataError(f"{label}: netCDF-3. Convert it with `nccopy -k nc4`.")
    raise DataError(
        f"{label}: neither a netCDF-4 file nor a folder with a {MANIFEST}. Where another program "
        f"wrote it, `rapi import {label} -o my-recording` makes a recording; files with the "
        f"columns time_s, drive, response need a {MANIFEST} beside them: give their folder."
    )


@takes(recording=Recording)
def write_recording(recording: Recording, path: StrPath, *, masked: bool = False) -> None:
    """Write a recording to a folder or, where `path` ends in `.nc`, to a netCDF-4 file.

    - `masked`: say of each run how many readings are missing (`missing_readings`), so that it is
      read without `nan="mask"`. For those who masked them and told so.

    The old recording stays whole until the new one is. Raises `OutputError`; `DataError` where the
    recording cannot be expressed in a file.

    >>> import os
    >>> from rapi_jax.io import write_recording
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> recording = Recording.of(drives, [predict(paper_device(), drive) for drive in drives])
    >>> write_recording(recording, "my-recording")
    >>> sorted(os.listdir("my-recording"))
    ['manifest.toml', 'run00.csv', 'run01.csv']
    """
    if os.fspath(path).endswith(".nc"):
        write_netcdf(recording, path, masked=masked)
    else:
        write_folder(recording, path, masked=masked)
