"""`range_records`: from fringe records to distance and velocity."""

import dataclasses
from collections.abc import Callable

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax._metrics import SPEED_OF_LIGHT as C
from rapi_jax._precision import float64

from ._ranging import Ranging, Target
from ._records import FringeRecords
from ._scan_table import ReadPart, ScanShape, ScanTable, join, read_table
from ._thresholds import THRESHOLDS
from .air import AirIndex, group_index
from .distance._estimators import BEST, estimator
from .distance._scale import Scale, ScaleSums


@float64
def range_records(
    records: FringeRecords,
    *,
    method: str = BEST,
    kalman: bool | None = None,
    expected_m: tuple[float, float] | None = None,
    on_part: Callable[[ScanTable], None] = lambda part: None,
) -> Ranging:
    """Distance of every scan, and distance and velocity over time (Eqs. 1, 2 and 4).

    **Arguments:**

    - `method`: `"resample-phase"` (least sensitive to noise), `"resample-fft"`, `"counting"` from
      one peak of the cavity to another (Eqs. 2 and 4), or `"counting-region"` with orders
      interpolated, as the paper's spread suggests.
    - `kalman`: whether to follow the target by a Kalman filter; by default where there are at least
      four scans, of both directions. Without it every scan is taken as of a target at rest.
    - `expected_m`: lowest and highest possible distance, m; any positive one by default. It decides
      between two solutions where a short record and fast motion leave two.
    - `on_part`: called with the scans of each stretch as soon as it is read.

    Raises `DataError` where a record shows no fringes of the interferometer or no turns, or no scan
    is complete.

    >>> import numpy as np
    >>> from rapi_jax.ranging import FringeRecord, FringeRecords, range_records
    >>> light, rate, path = 299792458.0, 1e6, 7.34  # m/s, Hz, m
    >>> time = np.arange(30000) / rate
    >>> phase = np.mod(time * 50.0, 1.0)
    >>> hertz = 75e9 * np.where(phase < 0.5, 2 * phase, 2 - 2 * phase)
    >>> fringe = lambda metres: np.cos(2 * np.pi * (hertz + 3.84e14) * metres / light)
    >>> record = FringeRecord(fringe(2 * 0.7), fringe(path), rising_at_start=True)
    >>> records = FringeRecords((record,), rate, 50.0, path)
    >>> found = range_records(records)
    >>> round(float(found.summary.distance), 4)  # m
    0.7
    """
    sums = ScaleSums()
    parts: list[ReadPart] = []
    for part in read_table(records, sums, method=method):
        parts.append(part)
        on_part(part.table)
    nominal = records.interferometer_path_m / C
    scale = sums.scale(nominal, records.cavity_spacing_hz)
    tables = [_rescaled(part, scale, method) for part in parts if part.table.size]
    if not tables:
        raise DataError(
            "No scan is complete: each record needs at least one whole branch between two turns."
        )
    table = join(tables)
    faults = [line for part in parts for line in part.faults]
    faults += _scan_faults(table)
    faults += list(records.notes) + _scale_faults(
        scale, nominal, cavity=any(record.cavity is not None for record in records)
    )
    index, more = _index(records)
    faults += more
    target = Target.of(
        table,
        index,
        scale,
        wavelength=records.wavelength_stderr_m / records.wavelength_m,
        kalman=kalman,
        expected_m=expected_m,
    )
    return Ranging(
        method=method,
        table=table,
        air_index=index,
        scale=scale,
        target=target,
        shapes=_shapes(parts),
        records=records,
        faults=tuple(dict.fromkeys([*faults, *target.notes])),
    )


def _shapes(parts: list[ReadPart]) -> tuple[ScanShape, ...]:
    """One of each direction."""
    every = [shape for part in parts for shape in part.shapes]
    sides = [next((s for s in every if s.rising is side), None) for side in (True, False)]
    return tuple(shape for shape in sides if shape is not None)


def _rescaled(part: ReadPart, scale: Scale, method: str) -> ScanTable:
    """Distances in proportion to the interferometer's delay, as it is known in the end."""
    if not estimator(method).proportional:
        return part.table
    factor = scale.delay_s / part.scale_s
    table = part.table
    return dataclasses.replace(
        table,
        path=table.path * factor,
        stderr=table.stderr * factor,
        span_hz=table.span_hz / factor,
        velocity_s=table.velocity_s * factor,
        acceleration_s2=table.acceleration_s2 * factor,
    )


def _index(records: FringeRecords) -> tuple[AirIndex, list[str]]:
    if records.air is None:
        line = (
            "the state of the air is not given: its index is taken as 1, which makes distances in "
            "ordinary air 0.027 % too long"
        )
        return AirIndex(1.0, {}), [line]
    return group_index(records.air, records.wavelength_m), []


def _scale_faults(scale: Scale, nominal: float, *, cavity: bool) -> list[str]:
    if not np.isfinite(scale.stderr_s):
        why = "no cavity tells the scale of optical frequency"
        if scale.spacing_hz is not None and cavity:
            why = (
                "the cavity's channel shows no even comb, so nothing tells the scale of optical "
                "frequency (are channels exchanged, or path or spacing wrong?)"
            )
        return [f"{why}: distances are as right as `interferometer_path_m`"]
    off = scale.delay_s / nominal - 1.0
    if abs(off) > THRESHOLDS.path_off:
        return [
            f"the interferometer's path by the cavity differs by {100 * off:+.2f} % from "
            "`interferometer_path_m`; the cavity's value is used. Is `interferometer_path_m` or "
            "`cavity_spacing_hz` wrong?"
        ]
    return []


def _scan_faults(table: ScanTable) -> list[str]:
    lines: dict[str, list[float]] = {}
    for time, problem in zip(table.time_s, table.problem, strict=True):
        if problem:
            lines.setdefault(problem, []).append(float(time))
    return [
        f"{len(times)} of {table.size} scans (first at {times[0]:.4g} s): {problem}"
        for problem, times in lines.items()
    ]
