"""Fringe records to a folder, one after the other, whole or not at all."""

import contextlib
import dataclasses
import errno
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._atomic import output_error, sync, sync_folder, write_atomic
from rapi_jax.io._leftovers import remove_leftovers, temporary_name
from rapi_jax.io._replacement import replacing
from rapi_jax.io._safe import StrPath, check_name
from rapi_jax.io._toml import MANIFEST
from rapi_jax.io._unfinished import fresh_names
from rapi_jax.ranging import FringeRecord, FringeRecords

from ._array import CHANNELS

_ROWS = 1 << 18  # samples at once


class FringeWriter:
    """Writes records that need not be in memory together; a context manager.

    `append` writes each record at once to a folder beside `folder`; at the end of the block the
    manifest is written and the folder takes its place. On an exception nothing is left of it, and
    what was there stays; with `keep_partial`, the records appended so far are kept, and the notes
    say that there were to be more. Raises `OutputError` for every `OSError`.

    >>> import numpy as np
    >>> from rapi_jax.io import FringeWriter, read_fringe_records
    >>> from rapi_jax.ranging import FringeRecord, FringeRecords
    >>> record = FringeRecord(
    ...     np.zeros(300, np.int16), np.ones(300, np.int16), rising_at_start=True
    ... )
    >>> records = FringeRecords(
    ...     (record,), sample_hz=1e6, excitation_hz=10.0, interferometer_path_m=7.34
    ... )
    >>> with FringeWriter("fringes") as writer:
    ...     writer.append(records)
    >>> read_fringe_records("fringes").records[0].name
    'record00'
    """

    def __init__(self, folder: StrPath, *, keep_partial: bool = False) -> None:
        self._folder, self._target = folder, Path(os.path.realpath(folder))
        self._keep = keep_partial
        remove_leftovers(self._target.parent)
        self._staging = self._target.with_name(temporary_name())
        self._about: FringeRecords | None = None
        self._channels: list[str] = []
        self._entries: list[dict[str, Any]] = []
        self._notes: list[str] = []

    @property
    def written(self) -> int:
        """Number of records so far."""
        return len(self._entries)

    def __enter__(self) -> "FringeWriter":
        """Make the folder beside the target."""
        with self._reported():
            if self._target.exists() and not self._target.is_dir():
                raise NotADirectoryError(errno.ENOTDIR, "it is there and is not a folder")
            self._staging.mkdir()
        return self

    def append(self, records: FringeRecords) -> None:
        """Write these records; all that is known of the set-up must be as in the first ones.

        float64 is rounded to float32. Raises `DataError`, `OutputError`.
        """
        if self._about is None:
            self._about = records
            self._channels = _channels(records.records[0])
        self._check(records)
        self._notes += [note for note in records.notes if note not in self._notes]
        for record in records:
            name = check_name(record.name)
            if any(entry["name"] == name for entry in self._entries):
                raise DataError(f"There are two records called '{name}'.")
            if _channels(record) != self._channels:
                raise DataError(
                    f"{name} has the channels {', '.join(_channels(record))}, but the first record "
                    f"has {', '.join(self._channels)}. Write them to two folders."
                )
            with self._reported():
                _write_array(record, self._channels, self._staging / f"{name}.npy")
            entry = {
                "file": f"{name}.npy",
                "name": name,
                "start_s": float(record.start_s),
                "rising_at_start": record.rising_at_start,
            }
            self._entries.append(entry)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Put the folder in its place, or remove it."""
        try:
            if kind is None and self._about is None:
                raise DataError("No fringe record was written.")
            if kind is None or (self._keep and self._entries):
                with self._reported():
                    self._finish(incomplete=kind is not None)
        finally:
            shutil.rmtree(self._staging, ignore_errors=True)

    def _check(self, records: FringeRecords) -> None:
        assert self._about is not None  # noqa: S101
        for field in dataclasses.fields(FringeRecords):
            if field.name in ("records", "notes"):
                continue
            one, other = getattr(self._about, field.name), getattr(records, field.name)
            if one != other:
                raise DataError(
                    f"`{field.name}` is {other}, but {one} in the first record. Records of one "
                    "folder have one set-up: write them to two."
                )

    @contextlib.contextmanager
    def _reported(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise output_error(self._folder, error) from error

    def _text(self, files: list[str]) -> str:
        from ._manifest import manifest_text

        assert self._about is not None  # noqa: S101
        entries = [e | {"file": file} for e, file in zip(self._entries, files, strict=True)]
        return manifest_text(self._about, self._channels, entries, self._notes)

    def _finish(self, *, incomplete: bool) -> None:
        if incomplete:
            self._notes.append("Interrupted: there were to be more records.")
        files, target = [entry["file"] for entry in self._entries], self._target
        if not target.exists() or not any(target.iterdir()):
            write_atomic(self._staging / MANIFEST, self._text(files))
            sync_folder(self._staging)
            try:
                os.rename(self._staging, target)
                sync_folder(target.parent)
                return
            except OSError as error:  # another process made it meanwhile: go on as if it had been
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
        fresh = fresh_names(files)
        with replacing(target, "record", fresh):
            for file, new in zip(files, fresh, strict=True):
                os.rename(self._staging / file, target / new)
            sync_folder(target)
            write_atomic(target / MANIFEST, self._text(fresh))


def write_fringe_records(records: FringeRecords, folder: StrPath) -> None:
    """Write records to a folder (`rapi.fringes/1`), whole or not at all.

    Raises `OutputError`, and `DataError` where a record cannot be named.

    >>> import os
    >>> import numpy as np
    >>> from rapi_jax.io import write_fringe_records
    >>> from rapi_jax.ranging import FringeRecord, FringeRecords
    >>> record = FringeRecord(
    ...     np.zeros(300, np.int16), np.ones(300, np.int16), rising_at_start=True
    ... )
    >>> records = FringeRecords(
    ...     (record,), sample_hz=1e6, excitation_hz=10.0, interferometer_path_m=7.34
    ... )
    >>> write_fringe_records(records, "fringes")
    >>> sorted(os.listdir("fringes"))
    ['manifest.toml', 'record00.npy']
    """
    with FringeWriter(folder) as writer:
        writer.append(records)


def _channels(record: FringeRecord) -> list[str]:
    return [name for name in CHANNELS if getattr(record, name) is not None]


def _write_array(record: FringeRecord, channels: list[str], path: Path) -> None:
    columns = [getattr(record, name) for name in channels]
    whole = all(column.dtype == np.int16 for column in columns)
    dtype = np.dtype("<i2" if whole else "<f4")
    head = {"descr": dtype.str, "fortran_order": False, "shape": (record.size, len(columns))}
    block = np.empty((_ROWS, len(columns)), dtype)
    with path.open("xb") as file:
        np.lib.format.write_array_header_1_0(file, head)
        for begin in range(0, record.size, _ROWS):
            rows = block[: min(_ROWS, record.size - begin)]
            for at, column in enumerate(columns):
                rows[:, at] = column[begin : begin + len(rows)]
            if not whole and not np.isfinite(rows).all():
                raise DataError(f"{record.name} has values that are not finite; it is not written.")
            file.write(rows.data)
    sync(path)
