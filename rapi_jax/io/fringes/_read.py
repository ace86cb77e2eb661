"""Fringe records from a folder."""

import os
from pathlib import Path

from rapi_jax._errors import DataError
from rapi_jax.io._safe import StrPath, inside, located, printable
from rapi_jax.io._toml import MANIFEST, load_manifest
from rapi_jax.ranging import FringeRecord, FringeRecords

from ._array import map_array


def read_fringe_records(folder: StrPath) -> FringeRecords:
    """Read a folder of fringe records (`rapi.fringes/1`), or its `manifest.toml`.

    Columns are views into the files, read when they are used. Channels stand in the order that the
    manifest gives; those that are not known are left out. A record without `start_s` follows the
    one before it. `notes` says what was assumed or left out.

    Raises `DataError`, in one line, where something is missing, damaged, hostile or not finite.

    >>> import numpy as np
    >>> from rapi_jax.io import read_fringe_records, write_fringe_records
    >>> from rapi_jax.ranging import FringeRecord, FringeRecords
    >>> record = FringeRecord(
    ...     np.zeros(300, np.int16), np.ones(300, np.int16), rising_at_start=True
    ... )
    >>> records = FringeRecords(
    ...     (record,), sample_hz=1e6, excitation_hz=10.0, interferometer_path_m=7.34
    ... )
    >>> write_fringe_records(records, "fringes")
    >>> again = read_fringe_records("fringes")
    >>> again.sample_hz, again.records[0].size
    (1000000.0, 300)
    """
    from ._manifest import WAVELENGTH_M, parse_manifest

    folder = Path(folder)
    folder = folder.parent if folder.name == MANIFEST else folder
    label = printable(folder / MANIFEST)
    if not os.path.lexists(folder / MANIFEST):
        raise DataError(
            f"{printable(folder)}: no {MANIFEST} in this folder, so it holds no fringe records."
        )
    table = load_manifest(folder, label)
    with located(label):
        manifest = parse_manifest(table)
        columns = manifest.columns()
        notes = manifest.own_notes()
        air = manifest.air(notes)
        paths = [inside(folder, entry.file) for entry in manifest.record]
        names = manifest.names()
    records, next_s = [], 0.0
    for entry, path, name in zip(manifest.record, paths, names, strict=True):
        array = map_array(path, manifest.channels, notes)
        start_s = next_s if entry.start_s is None else entry.start_s
        if entry.start_s is None and records:
            notes.append(f"{name}: `start_s` is missing: taken to follow the record before it.")
        next_s = start_s + array.shape[0] / manifest.sample_hz
        with located(printable(path)):
            record = FringeRecord(
                **{channel: array[:, at] for channel, at in columns.items()},
                start_s=start_s,
                rising_at_start=entry.rising_at_start,
                name=name,
            )
        if manifest.volts_per_code is None and record.measurement.dtype.kind == "i" and not records:
            notes.append("`volts_per_code` is missing: records are in codes.")
        records.append(record)
    with located(label):
        return FringeRecords(
            records=tuple(records),
            sample_hz=float(manifest.sample_hz),
            excitation_hz=float(manifest.excitation_hz),
            interferometer_path_m=float(manifest.interferometer_path_m),
            cavity_spacing_hz=manifest.cavity_spacing_hz,
            waveform=manifest.waveform if manifest.waveform in ("triangle", "sine") else "other",
            wavelength_m=float(manifest.wavelength_m or WAVELENGTH_M),
            air=air,
            volts_per_code=float(manifest.volts_per_code or 1.0),
            full_scale=manifest.range(),
            notes=tuple(notes),
        )
