"""Parts of the gap by run, direction of the drive, and nearness to turning points."""

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from rapi_jax import Recording

from ._branches import branches
from ._sums_of_squares import RunSums, sum_squares
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class Cell:
    """One part of one run; `up`: on rising branches, `edge`: near turning points.

    - `synchronous2`, `nonsynchronous2`: mean squares per reading of the cell, above noise.
    - `synchronous`, `structural`: the cell's part of the recording's mean squares, signed.
    """

    run: int
    up: bool
    edge: bool
    readings: float
    synchronous2: float
    nonsynchronous2: float
    synchronous: float
    structural: float


def cells(
    errors: list[Float[np.ndarray, "_ _"]],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    recording: Recording,
    *,
    own_origin: bool = False,
    fitted: int = 0,
) -> list[Cell]:
    """All parts of all runs; `synchronous` and `structural` sum to those of `measure_gap`."""
    parts = sum_squares(errors, blocks, spectrum, own_origin=own_origin, fitted=fitted)
    free = sum(p.freedom for p in parts)
    return list(_cells(parts, blocks, recording, free))


def _cells(
    parts: Sequence[RunSums], blocks: Sequence[PeriodBlock], recording: Recording, free: float
) -> Iterator[Cell]:
    near = THRESHOLDS.edge_fraction
    for k, (part, block) in enumerate(zip(parts, blocks, strict=True)):
        up, along = branches(recording.runs[k].drive, block)
        edge = (along <= near) | (along >= 1.0 - near)
        noise = _noise_of_mean(part)
        for rising in (True, False):
            for at_edge in (True, False):
                here = (up == rising) & (edge == at_edge)
                readings = float(part.count[here].sum())
                if readings == 0:
                    continue
                of_mean = float(part.count[here] @ part.mean[here] ** 2)
                about_mean = float(part.scatter[here].sum())
                floor = part.noise * readings * part.freedom / part.readings
                structural = of_mean + about_mean - floor
                synchronous = structural
                if part.readings > part.phases:
                    synchronous = of_mean - float(noise[here].sum())
                yield Cell(
                    k,
                    rising,
                    at_edge,
                    readings,
                    synchronous / readings,
                    (structural - synchronous) / readings,
                    synchronous / free,
                    structural / free,
                )


def _noise_of_mean(part: RunSums) -> Float[np.ndarray, " phases"]:
    """What noise adds at each phase to the sum of squares of the mean period.

    From the scatter at that phase, so that error which comes and goes at one place is not taken for
    error that repeats there; summed up it is that of the run.
    """
    own = part.scatter / np.maximum(part.count - 1.0, 1.0) * (part.count > 0)
    total = float(own.sum())
    return own * (part.synchronous_noise / total) if total > 0 else own
