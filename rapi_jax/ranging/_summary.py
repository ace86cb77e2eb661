"""One distance and one velocity of all scans together."""

import dataclasses

import numpy as np

from .tracking import Track


@dataclasses.dataclass(frozen=True)
class RangeSummary:
    """The target over the whole of its records; NaN where nothing tells.

    - `distance`: mean over time, m. `stderr`: its standard error, m: noise, motion, scale, index.
    - `scatter`: rms of the scans' distances about the track, or about their mean without one, m.
    - `velocity`, `velocity_stderr`: mean over time, m/s; of a track alone.
    - `scans`: how many there are. `counted`: how many of them count.

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
    >>> summary = found.summary
    >>> summary.scans, summary.counted, bool(summary.stderr < 1e-3)  # m
    (3, 3, True)
    """

    distance: float
    stderr: float
    scatter: float
    velocity: float
    velocity_stderr: float
    scans: int
    counted: int

    @classmethod
    def of(
        cls, distance: np.ndarray, stderr: np.ndarray, track: Track | None, shared: float
    ) -> "RangeSummary":
        """From distances of scans and their standard errors; `shared`: the error common to all, m.

        States of a track are smoothed and go together, so the error of their mean is taken to be
        that of one of them: what averaging would gain is not claimed.
        """
        good = np.isfinite(distance)
        count = int(good.sum())
        if not count:
            return cls(*(np.nan,) * 5, scans=distance.size, counted=0)
        some, own = distance[good], stderr[good]
        if track is None:
            mean, velocity, velocity_stderr = float(some.mean()), np.nan, np.nan
            scatter = float(some.std(ddof=1)) if count > 1 else np.nan
            single = np.sqrt(np.maximum(np.mean(own**2) - shared**2, 0.0))
            each = max(scatter, float(single)) if count > 1 else float(single)
            error = float(np.hypot(each / np.sqrt(count), shared))
        else:
            left = some - track.distance  # of the same scans
            used = ~track.gated
            count = int(used.sum())
            scatter = float(np.sqrt(np.mean(left[used] ** 2))) if count else np.nan
            mean = float(track.distance.mean())
            error = float(np.median(track.distance_stderr))
            velocity = float(track.velocity.mean())
            velocity_stderr = float(np.median(track.velocity_stderr))
        return cls(mean, error, scatter, velocity, velocity_stderr, distance.size, count)
