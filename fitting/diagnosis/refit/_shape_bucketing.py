"""Rows of few sizes, so that recordings of different make meet code that is compiled already."""

import numpy as np

_LEAST = 512  # samples
_TOGETHER = 2  # runs


def round_up(length: int) -> int:
    """The next of 512, 768, 1024, 1536, 2048, ...: at most half as much again."""
    size = _LEAST
    while size < length:
        size = size * 3 // 2 if size & (size - 1) == 0 else size * 4 // 3
    return size


def repeat_rows(rows: np.ndarray, count: int) -> np.ndarray:
    """`rows` and its last row again and again, `count` in all."""
    pads = [(0, count - len(rows))] + [(0, 0)] * (rows.ndim - 1)
    return np.pad(rows, pads, mode="edge")


def pad_drives(fields: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The fields of a `DriveBatch` with rows of a rounded length, and runs added up to a pair.

    A row goes on with its last value; a run added is the last again, on a clock of its own.
    """
    count = len(fields["freq"])
    more = count + -count % _TOGETHER if count > 1 else count
    out = {}
    for name, value in fields.items():
        if value.ndim == 2:
            size = round_up(value.shape[1])
            value = np.pad(value, [(0, 0), (0, size - value.shape[1])], mode="edge")
        out[name] = repeat_rows(value, more)
    out["gap_s"][count:] = np.inf
    return out
