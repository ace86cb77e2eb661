"""A run from columns as read: units converted, gaps refused or masked, errors with their place."""

from typing import Literal, get_args

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io import _units
from rapi_jax.io._safe import check_name, located
from rapi_jax.recording._drive import Drive, Waveform
from rapi_jax.recording._run import Run

NanPolicy = Literal["raise", "mask"]


def check_nan_policy(nan: str) -> None:
    """Refuse anything but "raise" and "mask"."""
    if nan not in get_args(NanPolicy):
        raise ValueError(f'Argument `nan` must be "raise" or "mask", but is {nan!r}.')


def _settle(response: np.ndarray, nan: NanPolicy, missing: int) -> np.ndarray:
    gaps = np.flatnonzero(~np.isfinite(response))
    if gaps.size == 0:
        return response
    if nan == "raise" and gaps.size != missing:
        known = f", but the manifest says that {missing} are missing" if missing else ""
        raise DataError(
            f"`response` has {gaps.size} value(s) that are not finite, the first "
            f"({response[gaps[0]]}) at sample {gaps[0]}{known}. Export the record again, or read "
            'it with nan="mask" (`--nan mask`) to leave them out; they are never interpolated.'
        )
    if response.size - gaps.size < 3:
        raise DataError(
            f"`response` has only {response.size - gaps.size} finite value(s) of {response.size}. "
            "Record it again, or leave this run out."
        )
    return np.where(np.isfinite(response), response, np.nan)


def build_run(
    columns: tuple[np.ndarray, np.ndarray, np.ndarray],
    *,
    label: str,
    name: str,
    drive_unit: str,
    response_unit: str,
    excitation_hz: float | None,
    waveform: Waveform,
    start_s: float,
    nan: NanPolicy,
    missing: int = 0,
) -> Run:
    """A `Run` in V or um, and GHz, um, nm or V, from (time, drive, response) in the units given.

    `label`: where the columns are from, put in front of every `DataError`. `missing`: how many
    readings are said to be missing; so many are masked, whatever `nan` is.
    """
    time, value, response = columns
    with located(label):
        check_name(name)
        value = _units.convert(value, _units.drive_unit(drive_unit)[1])
        response = _units.convert(response, _units.response_unit(response_unit)[1])
        drive = Drive(time, value, excitation_hz, waveform, start_s)
        return Run(drive, _settle(response, nan, missing), name)
