"""The beginning of a run left out, in which a device had not settled."""

import dataclasses

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io.imports._options import ImportOptions
from rapi_jax.recording._drive import Drive


def skip_start(drive: Drive, name: str, options: ImportOptions) -> tuple[Drive, int, list[str]]:
    """The drive without its first periods or seconds, how many samples that are, and a note.

    A broken period before the first whole one goes with it. Raises `DataError` where no whole
    period would be left, or fewer than three samples.

    >>> from rapi_jax import triangle
    >>> from rapi_jax.io import ImportOptions
    >>> from rapi_jax.io.imports.runs._skip import skip_start
    >>> (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=300, periods=3)
    >>> later, samples, _ = skip_start(drive, "run00", ImportOptions(skip_periods=1))
    >>> later.periods, samples, later.start_s  # s
    (2, 100, 0.1)
    """
    if not options.skip_periods and not options.skip_seconds:
        return drive, 0, []
    if options.skip_periods:
        asked = f"{options.skip_periods} period(s)"
        first = _first_of_period(drive, name, options.skip_periods)
    else:
        asked = f"{options.skip_seconds:g} s"
        first = int(np.searchsorted(drive.time, options.skip_seconds * (1.0 - 1e-12)))
    if drive.size - first < 3:
        raise DataError(
            f"{name}: {asked} are to be left out at its beginning, but it lasts only "
            f"{drive.size * drive.step_s:.4g} s. Leave out less, or record longer."
        )
    later = dataclasses.replace(
        drive,
        time=drive.time[first:] - drive.time[first],
        value=drive.value[first:],
        start_s=drive.start_s + float(drive.time[first]),
    )
    if drive.periods and not later.periods:
        raise DataError(
            f"{name}: {asked} are to be left out at its beginning, but of its {drive.periods} "
            "whole period(s) none would be left. Leave out less, or record longer."
        )
    note = f"{name}: the first {asked} are left out, as asked: {first} samples"
    return later, first, [note]


def _first_of_period(drive: Drive, name: str, number: int) -> int:
    """The sample at which a period begins, counted from 0."""
    if not drive.repeats:
        raise DataError(
            f"{name}: {number} period(s) are to be left out at its beginning, but its drive does "
            "not repeat. Give a time instead: `--skip-seconds`."
        )
    there = np.flatnonzero(drive.period == number)
    if there.size:
        return int(there[0])
    raise DataError(
        f"{name}: {number} period(s) are to be left out at its beginning, but it has only "
        f"{drive.periods} whole one(s). Leave out less, or record longer."
    )
