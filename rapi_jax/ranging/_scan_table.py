"""Apparent distances scan by scan, as records are read."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from rapi_jax._metrics import SPEED_OF_LIGHT as C

from ._records import FringeRecords
from ._reflectors import find_other
from .distance._estimates import Estimates
from .distance._estimators import BEST, estimator
from .distance._scale import NO_COMB, CombReading, ScaleSums, read_comb
from .distance._thresholds import THRESHOLDS as DISTANCE
from .reading._scans import Scans, read_scans
from .reading._threads import side_by_side
from .reading._thresholds import THRESHOLDS as READING


@dataclasses.dataclass(frozen=True, eq=False)
class ScanTable:
    """Scans in the order of time.

    - `time_s`: session time of the middle of each, s. `rising`: whether its frequency rises.
    - `path`: apparent optical path to the target and back, halved, m: not divided by the index of
      air, folded to positive, as if the target stood still. `stderr`: from the scan's own noise.
    - `span_hz`: of optical frequency. `velocity_s`, `acceleration_s2`: how `path` answers to motion
      about `time_s`. `problem`: what is wrong with the scan, "" where nothing is.
    - `bend_ghz`: rms nonlinearity of the optical frequency over time in the region of interest.

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
    >>> found.table.rising.tolist(), found.table.time_s.round(3).tolist()
    ([True, False, True], [0.005, 0.015, 0.025])
    """

    time_s: np.ndarray
    rising: np.ndarray
    path: np.ndarray
    stderr: np.ndarray
    span_hz: np.ndarray
    velocity_s: np.ndarray
    acceleration_s2: np.ndarray
    bend_ghz: np.ndarray
    problem: tuple[str, ...]

    @property
    def size(self) -> int:
        """Number of scans."""
        return self.time_s.size

    def take(self, which: np.ndarray) -> "ScanTable":
        """Some of the scans, by index."""
        arrays = {
            field.name: getattr(self, field.name)[which]
            for field in dataclasses.fields(self)
            if field.name != "problem"
        }
        return ScanTable(**arrays, problem=tuple(self.problem[i] for i in which))


def join(tables: list[ScanTable]) -> ScanTable:
    """All scans of several tables, in the order of time."""
    arrays = {
        field.name: np.concatenate([getattr(t, field.name) for t in tables])
        for field in dataclasses.fields(ScanTable)
        if field.name != "problem"
    }
    whole = ScanTable(**arrays, problem=sum((t.problem for t in tables), ()))
    return whole.take(np.argsort(whole.time_s, kind="stable"))


@dataclasses.dataclass(frozen=True, eq=False)
class ScanShape:
    """Optical frequency over time of one scan: s, and Hz from the middle of its region of interest.

    `margin`: points at either end that lie outside the region.
    """

    time: np.ndarray
    nu: np.ndarray
    rising: bool
    margin: int


@dataclasses.dataclass(frozen=True, eq=False)
class ReadPart:
    """What one stretch of records gave: its scans, with the scale as known by then, and faults."""

    table: ScanTable
    faults: tuple[str, ...]
    scale_s: float
    shapes: tuple[ScanShape, ...] = ()


def read_table(
    records: FringeRecords, sums: ScaleSums, *, method: str = BEST
) -> Iterator[ReadPart]:
    """Scans as they are read, stretch by stretch. `sums` gathers the scale on the way.

    Raises `DataError` where a record cannot be read at all.
    """
    chosen = estimator(method)
    nominal = records.interferometer_path_m / C
    centre = C / records.wavelength_m
    alone = False  # whether it is known if there is one reflector
    for reading in read_scans(records):
        combs = [_combs(scans, records, nominal) for scans in reading.scans]
        for scans, comb in zip(reading.scans, combs, strict=True):
            sums.add([one for one, dark in zip(comb, _unclocked(scans), strict=True) if not dark])
        scale = sums.scale(nominal, records.cavity_spacing_hz)
        tables = side_by_side(
            lambda one, scale=scale: _table(
                one[0], chosen(one[0], one[1], scale, centre), scale.delay_s
            ),
            list(zip(reading.scans, combs, strict=True)),
        )
        if tables:
            faults = reading.faults + _comb_faults(reading.scans, combs)
            if not alone:
                other = find_other(reading.scans, scale.delay_s)
                alone = other is not False
                faults += (str(other),) if other else ()
            shapes = tuple(_shape(scans, scale.delay_s) for scans in reading.scans)
            yield ReadPart(join(tables), faults, scale.delay_s, shapes)
        elif reading.faults:
            yield ReadPart(_EMPTY, reading.faults, scale.delay_s)


def _combs(scans: Scans, records: FringeRecords, nominal: float) -> list[CombReading]:
    if records.cavity_spacing_hz is None:
        return [NO_COMB] * scans.count
    return read_comb(scans, records.cavity_spacing_hz, nominal)


def _comb_faults(groups: tuple[Scans, ...], combs: list[list[CombReading]]) -> tuple[str, ...]:
    faults = []
    for scans, comb in zip(groups, combs, strict=True):
        for k, one in enumerate(comb):
            if one.missed or one.extra:
                what = [f"{one.missed} missed"] * bool(one.missed)
                what += [f"{one.extra} beside the comb"] * bool(one.extra)
                faults.append(
                    f"scan at {scans.middle_s[k]:.4g} s: cavity peaks: {', '.join(what)}; orders "
                    "are counted by the interferometer, so the span is right"
                )
    return tuple(faults)


_POINTS = 1024  # of a scan's shape, in its region of interest


def _shape(scans: Scans, delay_s: float) -> ScanShape:
    step = (scans.last - scans.first) / _POINTS
    margin = int(min(scans.first, scans.phase.shape[1] - 1 - scans.last) / step)
    place = scans.first + step * np.arange(-margin, _POINTS + margin + 1)
    nu = np.interp(place, np.arange(scans.phase.shape[1]), scans.phase[0])
    sign = 1.0 if scans.rising else -1.0
    middle = (nu[margin] + nu[-1 - margin]) / 2
    nu = sign * (nu - middle) / (2 * np.pi * delay_s)
    return ScanShape(place / scans.hz, nu, scans.rising, margin)


def _table(scans: Scans, found: Estimates, delay_s: float) -> ScanTable:
    roi = slice(scans.first, scans.last + 1)
    nu = scans.phase[:, roi] / (2 * np.pi * delay_s * 1e9)
    problems = _problems(scans, found.problems)
    lost = np.array([bool(p) and not q for p, q in zip(problems, found.problems, strict=True)])
    x = np.linspace(-1.0, 1.0, nu.shape[1])
    nu = nu - nu.mean(axis=1, keepdims=True)
    nu -= ((nu @ x) / (x @ x))[:, None] * x[None, :]
    return ScanTable(
        scans.middle_s,
        np.full(scans.count, scans.rising),
        np.where(lost, np.nan, found.delay_s * C / 2),
        found.stderr_s * C / 2,
        found.span_hz,
        found.motion.velocity_s,
        found.motion.acceleration_s2,
        np.sqrt(np.mean(nu**2, axis=1)),
        problems,
    )


def _unclocked(scans: Scans) -> np.ndarray:
    """Which scans lost the interferometer's fringes, and with them their optical frequency."""
    return scans.reference < READING.low_light


def _problems(scans: Scans, found: tuple[str, ...]) -> tuple[str, ...]:
    """What is wrong with each scan: its light first, then what the estimator says."""
    dark = scans.light < DISTANCE.lost_light
    silent = scans.measurement_hz == 0
    return tuple(
        "the interferometer's fringes are lost for a part of the scan" if clock
        else "no target: the measurement arm shows no fringes" if silent
        else _LOST if light and not said
        else said
        for clock, light, said in zip(_unclocked(scans), dark, found, strict=True)
    )  # fmt: skip


_LOST = (
    "fringes lost for a part of the scan (is the beam blocked?), or a beat that stands still as "
    "the target moves"
)
_EMPTY = ScanTable(*(np.zeros(0),) * 8, problem=())
