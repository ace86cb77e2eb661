"""White frequency noise of one laser as several interferometers of different delay see it."""

from collections.abc import Sequence

import numpy as np

from ._light_noise import Laser
from ._normal import TableNormal


class SharedPhaseNoise:
    """Phase walks over several delays, point samples of one Wiener process.

    An interferometer of delay tau sees the phase's change over the window `(t - tau, t]`: windows
    share what they overlap, between interferometers and from sample to sample. So each sampling
    interval is cut where one of the windows that reach into it begins, and each piece has its own
    independent step. A delay below the interval needs no steps but its own.

    The cavity beside them sees the frequency over the window of the first delay, at most over one
    interval, as in `PhaseNoise`.
    """

    def __init__(
        self, laser: Laser, delays_s: Sequence[float], sample_hz: float, normal: TableNormal
    ) -> None:
        """`delays_s`: the auxiliary interferometer's first; `sample_hz`: of the digitizer."""
        samples = [delay * sample_hz for delay in delays_s]
        self._whole = [int(x) for x in samples]  # sampling intervals within each delay
        rests = [x - whole for x, whole in zip(samples, self._whole, strict=True)]
        self._longest = max(self._whole)
        cuts = sorted({*rests, 1.0} if self._longest else set(rests))
        power = 2.0 * np.pi * laser.linewidth_hz / sample_hz  # rad^2 an interval
        self._rms = np.sqrt(power * np.diff([0.0, *cuts]))
        # The part of an interval after each window's beginning: so many pieces of it.
        self._pieces = [cuts.index(rest) + 1 for rest in rests]
        self._window_s = min(delays_s[0], 1.0 / sample_hz)
        self._silent = laser.linewidth_hz == 0.0
        self._normal = normal
        self._tail = self._steps(self._longest)

    def _steps(self, count: int) -> np.ndarray:
        """Running sums of the pieces of each interval, from its end: (pieces, count)."""
        steps = np.empty((len(self._rms), count), dtype=np.float32)
        for row, rms in zip(steps, self._rms, strict=True):
            row[:] = self._normal.draw(count, float(rms)) if count and not self._silent else 0.0
        for row, before in zip(steps[1:], steps[:-1], strict=True):
            row += before
        return steps

    def draw(self, count: int) -> tuple[list[np.ndarray], np.ndarray] | None:
        """Phase over each delay (rad) and frequency (Hz) at the next samples; `None`: no noise."""
        if self._silent:
            return None
        steps = self._steps(count)
        if self._longest:
            steps = np.concatenate([self._tail, steps], axis=1)
            self._tail = steps[:, count:]
        now = slice(self._longest, self._longest + count)
        frequency = steps[-1 if self._whole[0] else self._pieces[0] - 1, now]
        frequency = frequency / np.float32(2.0 * np.pi * self._window_s)
        walk = None
        if self._longest:
            walk = np.cumsum(steps[-1], dtype=np.float64)
        phases = []
        for whole, pieces in zip(self._whole, self._pieces, strict=True):
            begin = self._longest - whole
            phase = steps[pieces - 1, begin : begin + count]
            if walk is not None and whole:
                phase = (walk[now] - walk[begin : begin + count] + phase).astype(np.float32)
            phases.append(phase)
        return phases, frequency
