"""The result of ranging: scans, the target's track, scale and index."""

import dataclasses
from typing import Any

import numpy as np

from rapi_jax.display._results import ranging_dataframe, summarise_ranging
from rapi_jax.sampling._white_noise import white_noise_rms

from ._records import FringeRecords
from ._scan_table import ScanShape, ScanTable
from ._summary import RangeSummary
from ._thresholds import THRESHOLDS
from .air import AirIndex
from .distance._scale import Scale
from .tracking import Observations, Track, track


@dataclasses.dataclass(frozen=True, eq=False)
class Target:
    """Where the target is, scan by scan.

    - `distance`: m, geometric, at the middle of each scan; the target's motion is taken out where a
      track tells it. Not a number where a scan could not be read.
    - `stderr`: standard error of each, m: its own noise, scatter beyond it as the track's
      innovations show it, motion, and what all scans share (`shared`: scale and index).
    - `track`: distance and velocity over time; `None` where no filter ran.
    - `scatter`: standard error of each scan by itself, m: its noise and the scatter beyond it.
    - `motion`: part of a typical scan's error that the error of the velocity makes, m.

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
    >>> found.target.distance.round(4).tolist()  # m, scan by scan
    [0.7, 0.7, 0.7]
    """

    distance: np.ndarray
    stderr: np.ndarray
    track: Track | None
    shared: float
    scatter: np.ndarray
    notes: tuple[str, ...] = ()
    motion: float = 0.0

    @classmethod
    def of(
        cls,
        table: ScanTable,
        index: AirIndex,
        scale: Scale,
        *,
        wavelength: float,
        kalman: bool | None,
        expected_m: tuple[float, float] | None,
    ) -> "Target":
        """From apparent paths. A track that was asked for and cannot be had is a note.

        `wavelength`: relative standard error of the laser's.
        """
        n = index.value
        apparent, own = table.path / n, table.stderr / n
        good = np.flatnonzero(np.isfinite(apparent) & np.array([not p for p in table.problem]))
        relative = np.hypot(index.stderr / n if index.parts else 0.0, _relative(scale))
        both = good.size >= THRESHOLDS.fewest_scans and 0 < table.rising[good].sum() < good.size
        if kalman is False or not both:
            notes = _at_rest(table, apparent, own, good, asked=kalman is not False)
            apparent, own = apparent.copy(), own.copy()
            apparent[[bool(p) for p in table.problem]] = np.nan
            own[np.isnan(apparent)] = np.nan
            shared = float(relative * np.median(apparent[good])) if good.size else np.nan
            error = np.hypot(own, relative * apparent)
            return cls(apparent, error, None, shared, own, notes)
        own = own.copy()
        own[good] = with_scatter(apparent[good], own[good], table.rising[good])
        # The path grows with the index, and so does its answer to motion: both are divided by it.
        found = track(
            Observations(
                table.time_s[good],
                apparent[good],
                own[good],
                table.velocity_s[good],
                table.acceleration_s2[good],
            ),
            expected_m=expected_m,
        )
        # A wrong wavelength makes all answers to motion wrong alike, and so the velocity; their
        # product, which a distance is corrected by, stays as it is.
        motion = table.velocity_s[good] * found.velocity_stderr
        velocity_stderr = np.hypot(found.velocity_stderr, wavelength * found.velocity)
        shared = float(relative * np.median(found.distance))
        found = dataclasses.replace(
            found,
            velocity_stderr=np.hypot(velocity_stderr, relative * found.velocity),
            distance_stderr=np.hypot(found.distance_stderr, shared),
        )
        return cls._tracked(table, apparent, own, good, found, motion, shared)

    @classmethod
    def _tracked(cls, table, apparent, own, good, found: Track, motion, shared) -> "Target":
        distance = np.full(apparent.shape, np.nan)
        stderr = np.full(apparent.shape, np.nan)
        distance[good] = found.sign * apparent[good] - table.velocity_s[good] * found.velocity
        stderr[good] = np.sqrt((found.scale * own[good]) ** 2 + motion**2 + shared**2)
        moved = float(np.median(np.abs(motion)))
        return cls(distance, stderr, found, shared, found.scale * own, tuple(found.notes), moved)


def _at_rest(
    table: ScanTable, apparent: np.ndarray, own: np.ndarray, good: np.ndarray, *, asked: bool
) -> tuple[str, ...]:
    """What has to be known of distances without a track; `asked`: whether one was not refused."""
    if not good.size:
        return ()
    notes = []
    if asked:
        gain = float(np.median(np.abs(table.velocity_s[good])))
        which = "readable scans"
        if table.rising[good].all() or not table.rising[good].any():
            which = f"readable {'up' if table.rising[good[0]] else 'down'}-scans alone"
        notes.append(
            f"no track: {good.size} {which}, and a filter needs {THRESHOLDS.fewest_scans}, of both "
            "directions. The target is taken to be at rest: if it moves, each um/s puts these "
            f"distances off by {gain:.3g} um"
        )
    sides = [good[table.rising[good]], good[~table.rising[good]]]
    if all(side.size for side in sides):
        apart = abs(float(np.diff([apparent[side].mean() for side in sides])[0]))
        noise = float(np.sqrt(sum(np.mean(own[side] ** 2) / side.size for side in sides)))
        spread = [apparent[side].std(ddof=1) / side.size**0.5 for side in sides if side.size > 1]
        if apart > THRESHOLDS.sides_apart * float(np.hypot(noise, np.linalg.norm(spread))):
            notes.append(
                f"up- and down-scans differ by {1e6 * apart:.4g} um, more than their scatter: the "
                "target moves, and without a filter every distance is off by half of that"
            )
    return tuple(notes)


def with_scatter(apparent: np.ndarray, own: np.ndarray, rising: np.ndarray) -> np.ndarray:
    """Standard errors that hold the scatter from scan to scan too, m: vibration, comb, scale.

    The scatter of scans of one direction about a parabola through their neighbours: steady motion
    and outliers do not count. Where it is beyond what the scans' own noise says, the rest is added.
    """
    out = own.copy()
    for side in (rising, ~rising):
        place = np.flatnonzero(side)
        if place.size < THRESHOLDS.fewest_for_scatter:
            continue
        seen = white_noise_rms(apparent[place])
        beyond = max(seen**2 - float(np.median(own[place])) ** 2, 0.0)
        out[place] = np.sqrt(own[place] ** 2 + beyond)
    return out


def _relative(scale: Scale) -> float:
    """Relative standard error of the scale; none where no cavity told it, which is a fault."""
    return scale.stderr_s / scale.delay_s if np.isfinite(scale.stderr_s) else 0.0


@dataclasses.dataclass(frozen=True, eq=False)
class Ranging:
    """Distances of all scans, and how they came about.

    - `method`: the estimator. `table`: apparent values, scan by scan. `target`: the target's.
    - `air_index`: the group index that distances were divided by. `scale`: of optical frequency.
    - `shapes`: the optical frequency over time of one scan of each direction.
    - `records`: what was ranged. `faults`: what is wrong or doubtful, one line each.

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
    >>> found.method, found.table.path.size  # scans
    ('resample-phase', 3)
    """

    method: str
    table: ScanTable
    air_index: AirIndex
    scale: Scale
    target: Target
    shapes: tuple[ScanShape, ...]
    records: FringeRecords
    faults: tuple[str, ...]

    @property
    def distance(self) -> np.ndarray:
        """Geometric distance at the middle of each scan, m."""
        return self.target.distance

    @property
    def stderr(self) -> np.ndarray:
        """Standard error of each, m."""
        return self.target.stderr

    @property
    def time_s(self) -> np.ndarray:
        """Session time of the middle of each scan, s."""
        return self.table.time_s

    @property
    def summary(self) -> RangeSummary:
        """One distance and one velocity of all scans together."""
        target = self.target
        return RangeSummary.of(target.distance, target.stderr, target.track, target.shared)

    def __str__(self) -> str:
        return summarise_ranging(self).text()

    def _repr_html_(self) -> str:
        return summarise_ranging(self).html()

    def to_dataframe(self) -> Any:
        """A pandas `DataFrame` with a row for each scan: time, direction, distance and error."""
        return ranging_dataframe(self)
