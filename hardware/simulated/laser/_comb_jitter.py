"""Errors of a cavity's comb that differ from branch to branch: wrong end points of a scan."""

import numpy as np

from ._scan import Scan

_FIRST = 1 << 20  # branches before the drive's start are counted, too


class CombJitter:
    """How far the comb is off along a scan, GHz.

    A branch lies between the scan's lowest and highest frequency. Each has two errors of its own,
    at its beginning and at its end; between them the comb moves evenly in time. Both are a function
    of `key` and of the branch's number since the drive's start.
    """

    def __init__(self, rms_ghz: float, key: int, scan: Scan) -> None:
        """`scan`: gives the rate and where in a period the branches meet."""
        self._rms, self._key, self._rate = rms_ghz, key, scan.rate_hz
        one = scan.nu[: scan.nu.size // scan.periods]
        low, high = np.argmin(one) / one.size, np.argmax(one) / one.size
        self._begin, self._share = min(low, high), abs(high - low)  # cycles

    def even(self, start_s: float, step_s: float, count: int) -> np.ndarray:
        """At `count` times, `step_s` apart from `start_s` after the drive's start."""
        cycles = (start_s + np.arange(count) * step_s) * self._rate - self._begin
        period = np.floor(cycles)
        cycles -= period
        second = cycles >= self._share
        along = np.where(second, (cycles - self._share) / (1.0 - self._share), cycles / self._share)
        branch = (2 * period + second).astype(np.int64)
        first = int(branch[0])
        ends = self._rms * np.array([self._ends(b) for b in range(first, int(branch[-1]) + 1)])
        begin, end = ends[branch - first].T
        return begin + (end - begin) * along

    def _ends(self, branch: int) -> np.ndarray:
        return np.random.default_rng([self._key, _FIRST + branch]).standard_normal(2)
