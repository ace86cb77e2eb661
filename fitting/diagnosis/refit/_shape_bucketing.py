"""Rows of few lengths, so that recordings of different shape share compiled code."""

import numpy as np

from ._thresholds import THRESHOLDS


def round_up(length: int) -> int:
    """The next of 512, 768, 1024, 1536, 2048, ...: at most half as much again."""
    size = THRESHOLDS.least_row_length
    while size < length:
        size = size * 3 // 2 if size & (size - 1) == 0 else size * 4 // 3
    return size


def repeat_rows(rows: np.ndarray, count: int) -> np.ndarray:
    """`rows` with the last one repeated, `count` in all."""
    pads = [(0, count - len(rows))] + [(0, 0)] * (rows.ndim - 1)
    return np.pad(rows, pads, mode="edge")


def pad_drives(fields: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The fields of a `DriveBatch` with rows of a rounded length and a rounded number of runs.

    A row is continued with its last value. An added run repeats the last one and shares no clock
    with it.
    """
    count = len(fields["freq"])
    more = count + -count % THRESHOLDS.run_multiple if count > 1 else count
    out = {}
    for name, value in fields.items():
        if value.ndim == 2:
            size = round_up(value.shape[1])
            value = np.pad(value, [(0, 0), (0, size - value.shape[1])], mode="edge")
        out[name] = repeat_rows(value, more)
    out["gap_s"][count:] = np.inf
    return out
