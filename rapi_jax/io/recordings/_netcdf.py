"""A recording as one netCDF-4 file: a group a run, checksums on every variable, a hash over all."""

import hashlib
import json
import os
import subprocess  # noqa: S404
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io import _units
from rapi_jax.io._atomic import write_atomic
from rapi_jax.io._safe import StrPath, bytes_on_disk, cause, located, open_regular, printable
from rapi_jax.recording._recording import Recording

from ._build import NanPolicy, build_run
from ._csv import HEADER, Columns

_HASH = "content_sha256"
_ORDER = "run_order"
_TIMEOUT = 600.0  # s; the process limits itself to far less
_DAMAGED = "Restore it from a copy, or record again."
_KNOWN = {"name", "excitation_hz", "waveform", "start_s"}  # of a run, under the hash
_KNOWN |= {"schema", "response_unit", "drive_unit", "response_origin", "response_lag_s"}
_KNOWN |= {"provenance"}


def write_netcdf(recording: Recording, path: StrPath, *, masked: bool = False) -> None:
    """Write the recording, whole or not at all. Raises `OutputError`.

    Of one run the root holds the columns as well, so that `xarray.open_dataset` shows them.
    `masked`: see `write_recording`.
    """
    import xarray as xr

    from ._manifest import head

    whole, entries = head(recording, masked=masked)
    whole["provenance"] = json.dumps(recording.provenance)
    columns = [(run.drive.time, run.drive.value, run.response) for run in recording.runs]
    whole[_HASH] = _content_hash(whole, entries, columns)
    groups = {"/": xr.Dataset(attrs=whole)}
    encoding = {}
    units = ("s", recording.drive_unit, recording.response_unit)
    for entry, run in zip(entries, columns, strict=True):
        variables = {
            key: ("time_s", column, {"units": unit})
            for key, column, unit in zip(HEADER, run, units, strict=True)
        }
        time = {"time_s": variables.pop("time_s")}
        attributes = {**entry, _ORDER: len(encoding)}
        name = f"/{attributes.pop('name')}"
        groups[name] = xr.Dataset(variables, time, attributes)
        encoding[name] = {
            key: {"zlib": True, "complevel": 4, "fletcher32": True, "_FillValue": None}
            for key in HEADER
        }
    if len(columns) == 1:
        seen = {
            key: ("sample", column, {"units": unit})
            for key, column, unit in zip(HEADER, columns[0], units, strict=True)
        }
        groups["/"] = xr.Dataset(seen, attrs=whole)
        encoding["/"] = encoding[next(iter(encoding))]
    tree = xr.DataTree.from_dict(groups)
    # To memory first, so that a full disk is met by one plain write.
    write_atomic(path, tree.to_netcdf(None, engine="h5netcdf", encoding=encoding))


def read_netcdf(path: Path, *, nan: NanPolicy) -> Recording:
    """Read a netCDF-4 recording. Raises `DataError` where it is damaged, hostile or incomplete."""
    label = printable(path)
    with open_regular(path) as file, located(label):
        whole, groups = _read_apart(file)
        return _assemble(whole, groups, nan)


def _read_apart(file: BinaryIO) -> tuple[dict[str, Any], list[tuple[dict[str, Any], Columns]]]:
    """Attributes of the file and of each run, and the columns, read in a process of its own.

    A crafted or damaged file can crash the HDF5 library, or keep it for ever; see `_hdf5.py`.
    """
    script = Path(__file__).with_name("_hdf5.py")
    command = [sys.executable, "-P", str(script), str(bytes_on_disk(file))]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "HDF5_USE_FILE_LOCKING": "FALSE"}
    try:
        done = subprocess.run(  # noqa: S603 (our own script, no text of the file)
            command, stdin=file, capture_output=True, env=environment, timeout=_TIMEOUT
        )
    except subprocess.TimeoutExpired as error:
        raise DataError(f"reading did not end. {_DAMAGED}") from error
    line, _, body = done.stdout.partition(b"\n")
    if done.returncode or not line:
        if b"ModuleNotFoundError" in done.stderr:
            raise ImportError(printable(done.stderr.decode(errors="replace").strip()[-200:]))
        raise DataError(f"reading crashed the HDF5 library, or did not end. {_DAMAGED}")
    said = json.loads(line)
    if "refused" in said:
        raise DataError(printable(said["refused"], 400))
    if "damaged" in said:
        raise DataError(f"damaged or cut short ({_say(said['damaged'])}). {_DAMAGED}")
    values = np.frombuffer(body, dtype="<f8").astype(np.float64)
    ends = np.cumsum([size for run in said["runs"] for size in run["size"]])
    columns = iter(np.split(values, ends[:-1]))
    groups = [
        (run["attributes"] | {"name": run["name"]}, (next(columns), next(columns), next(columns)))
        for run in said["runs"]
    ]
    groups.sort(key=_order)
    return said["attributes"], groups


def _assemble(
    whole: dict[str, Any], groups: list[tuple[dict[str, Any], Columns]], nan: NanPolicy
) -> Recording:
    from ._manifest import parse_manifest

    entries = [entry for entry, _ in groups]
    if _HASH in whole:
        expected = whole.pop(_HASH)
        if expected != _content_hash(whole, entries, [columns for _, columns in groups]):
            raise DataError("damaged or edited: its content does not match its hash. " + _DAMAGED)
    try:
        provenance = json.loads(whole.pop("provenance", "{}"))
    except (TypeError, ValueError, RecursionError) as error:
        raise DataError(f"`provenance` is not JSON ({cause(error)}). Write it again.") from error
    table = {**whole, "provenance": provenance, "run": [{"file": "-", **e} for e in entries]}
    manifest = parse_manifest(table)
    runs = tuple(
        build_run(
            columns,
            label=f"run '{printable(entry.name)}'",
            name=str(entry.name),
            drive_unit=manifest.drive_unit,
            response_unit=manifest.response_unit,
            excitation_hz=entry.excitation_hz,
            waveform=entry.waveform,
            start_s=entry.start_s,
            nan=nan,
            missing=entry.missing_readings,
        )
        for entry, (_, columns) in zip(manifest.run, groups, strict=True)
    )
    return Recording(
        runs,
        response_unit=_units.response_unit(manifest.response_unit)[0],
        drive_unit=_units.drive_unit(manifest.drive_unit)[0],
        response_origin=manifest.response_origin,
        response_lag_s=float(manifest.response_lag_s),
        provenance=manifest.all_provenance([run.name for run in runs]),
    )


def _order(group: tuple[dict[str, Any], Columns]) -> int:
    order = group[0].pop(_ORDER, 0)
    return order if isinstance(order, int) else 0


def _content_hash(
    whole: Mapping[str, Any], entries: list[dict[str, Any]], columns: list[Columns]
) -> str:
    # Only of what we wrote: others may add keys.
    known = [{k: v for k, v in table.items() if k in _KNOWN} for table in (whole, *entries)]
    digest = hashlib.sha256(json.dumps(known, sort_keys=True, default=str).encode())
    for column in (column for run in columns for column in run):
        digest.update(np.ascontiguousarray(column, dtype="<f8").tobytes())
    return digest.hexdigest()


def _say(text: str) -> str:
    if "letcher32" in text or "checksum" in text.lower():
        return "a checksum does not match"
    return printable(text.split("\n")[0])
