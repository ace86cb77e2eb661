"""Tables in TDMS files of LabVIEW: each channel has a clock of its own."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._safe import MAX_BYTES, cause, open_regular, printable

from ._table import Column, Table


def read_tdms_table(path: Path) -> Table:
    """The channels of numbers, by `group/channel`. Raises `DataError`, also without `nptdms`."""
    label = printable(path)
    try:
        from nptdms import TdmsFile  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise DataError(
            f"{label}: TDMS files need the package nptdms. Install it with `pip install nptdms` "
            "(the extra `tdms`), or export the file as text."
        ) from error
    columns, keys = [], []
    with open_regular(path) as file:
        try:
            content = TdmsFile.read_metadata(file)
            for group in content.groups():
                for channel in group.channels():
                    if channel.dtype.kind not in "fiu" or len(channel) < 2:
                        continue
                    about = channel.properties
                    step = about.get("wf_increment")
                    start = float(about.get("wf_start_offset", 0.0))
                    name = f"{group.name}/{channel.name}"
                    unit = about.get("unit_string")
                    unit = unit if isinstance(unit, str) and unit else None
                    step = float(step) if step else None
                    columns.append(Column(name, channel.name, unit, step, start))
                    keys.append((group.name, channel.name, len(channel)))
        except Exception as error:  # a damaged file makes the library raise almost anything
            raise DataError(
                f"{label}: damaged or cut short ({cause(error)}). Export it again, or as text."
            ) from error
    if not columns:
        raise DataError(f"{label}: no channel of numbers. Export it again, or as text.")

    def load(use: Sequence[int]) -> list[np.ndarray]:
        if 8 * sum(keys[i][2] for i in use) > MAX_BYTES:
            raise DataError(f"{label}: declares more than {MAX_BYTES} bytes. Split the recording.")
        with open_regular(path) as file:
            try:
                content = TdmsFile.read(file)
                return [np.array(content[keys[i][0]][keys[i][1]][:], dtype=np.float64) for i in use]
            except Exception as error:  # as above: the channels are read here
                raise DataError(
                    f"{label}: damaged or cut short ({cause(error)}). Export it again."
                ) from error

    return Table(label, "TDMS", tuple(columns), load)
