"""Arrays in `.npy` files that are not trusted: header and size are checked, then mapped."""

import ast
import io
from pathlib import Path
from typing import BinaryIO

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._safe import cause, open_regular, printable

CHANNELS = ("measurement", "interferometer", "cavity", "drive")
MAX_BYTES = 2**40  # mapped, not read
_MAX_HEADER = 10_000
_BLOCK = 1 << 20  # values at once
_TYPES = ("<i2", ">i2", "<f4", ">f4", "<f8", ">f8")


def map_array(path: Path, channels: list[str], notes: list[str]) -> np.ndarray:
    """The array of a record, samples x channels, as a read-only view of its file.

    Numbers of another byte order are read into memory, which `notes` is told. Raises `DataError`
    where the file is not such an array, is cut short, or holds a number that is not finite.
    """
    label = printable(path)
    with open_regular(path, MAX_BYTES) as file:
        shape, fortran, dtype, offset = _header(file, label)
        _check_shape(shape, channels, label)
        size = file.seek(0, io.SEEK_END)
        expected = offset + shape[0] * shape[1] * dtype.itemsize
        if size != expected:
            what = "cut short" if size < expected else "longer than it says"
            raise DataError(
                f"{label}: {what}, {size} bytes instead of {expected} for {shape[0]} samples of "
                f"{shape[1]} channels. Copy or export it again."
            )
        order = "F" if fortran else "C"
        try:
            array = np.memmap(file, dtype, "r", offset=offset, shape=shape, order=order)
        except (OSError, ValueError) as error:
            raise DataError(f"{label}: cannot be mapped ({cause(error)}).") from error
    if dtype.kind == "f":
        _check_finite(array, channels, label)
    if not dtype.isnative:
        notes.append(f"{label}: of another byte order, so read into memory.")
        return np.asarray(array, dtype=dtype.newbyteorder("="))
    return np.asarray(array)


def _header(file: BinaryIO, label: str) -> tuple[tuple[int, ...], bool, np.dtype, int]:
    """Shape, whether columns are contiguous, type, and where the data begin."""
    head = file.read(12)
    if len(head) < 12 or not head.startswith(b"\x93NUMPY") or head[6] not in (1, 2):
        raise DataError(f"{label}: not a .npy file. Write it with `numpy.save`.")
    begin = 10 if head[6] == 1 else 12
    length = int.from_bytes(head[8:begin], "little")
    if length > _MAX_HEADER:
        raise DataError(
            f"{label}: its header has {length} bytes, but a plain array's has below {_MAX_HEADER}. "
            "Write one array of numbers with `numpy.save`."
        )
    file.seek(begin)
    text = file.read(length).decode("latin-1").strip()
    try:
        table = ast.literal_eval(text)
        shape, fortran, descr = table["shape"], table["fortran_order"], table["descr"]
        plain = isinstance(shape, tuple) and all(type(n) is int and n >= 0 for n in shape)
        if not plain or type(fortran) is not bool:
            raise ValueError("its shape or its order is none")
    except (ValueError, TypeError, KeyError, SyntaxError, RecursionError, MemoryError) as error:
        why = cause(error)
        raise DataError(f"{label}: its header is damaged ({why}). Copy it again.") from error
    if descr not in _TYPES:
        cure = "Subtract 32768 and save" if descr in ("<u2", ">u2") else "Save"
        raise DataError(
            f"{label}: holds {printable(descr, 40)}, but records are int16 or float32. {cure} "
            "them as one of these, with `numpy.save`."
        )
    return shape, fortran, np.dtype(descr), begin + length


def _check_shape(shape: tuple[int, ...], channels: list[str], label: str) -> None:
    count = len(channels)
    if len(shape) == 2 and shape[1] == count:
        return
    cure = "Name each column in `channels`."
    if len(shape) == 2 and shape[0] == count:
        cure = "Save the transpose: one row for each sample."
    raise DataError(
        f"{label}: has shape {printable(shape, 60)}, but `channels` asks for samples x {count}. "
        f"{cure}"
    )


def _check_finite(array: np.ndarray, channels: list[str], label: str) -> None:
    rows = max(1, _BLOCK // array.shape[1])
    for begin in range(0, array.shape[0], rows):
        good = np.isfinite(array[begin : begin + rows])
        if good.all():
            continue
        row, column = (int(x[0]) for x in np.nonzero(~good))
        raise DataError(
            f"{label}: '{printable(channels[column], 40)}' is not finite at sample {begin + row}. "
            "Fringes are not guessed: export the record again."
        )
