"""A low-finesse Fabry-Perot alone, read as an interferometer with fringes of any shape."""

from typing import Any

import numpy as np
from scipy import fft, interpolate

from rapi_jax._errors import DataError
from rapi_jax.readout._readout import Peaks, Readout, Turn
from rapi_jax.readout.turns._drive_turns import drive_turns, rising_at
from rapi_jax.recording._drive import Drive

from ._thresholds import THRESHOLDS

_TWO_PI = 2 * np.pi


def read_etalon(
    transmission: Any, drive: Drive, *, fsr_ghz: float, fringes_per_knot: float = 1.5
) -> Readout:
    """Optical frequency from the fringes of one low-finesse cavity, sampled with the drive.

    - `transmission`: of the cavity, at the drive's sample times, any unit.
    - `fsr_ghz`: its free spectral range.
    - `fringes_per_knot`: knots of the phase's spline are so many fringes apart: faster changes of
      the scan rate are smoothed.

    The phase is a cubic spline of time with a corner at each turn of the drive; the fringe's shape
    (four harmonics, the same up and down), background and visibility (straight lines on each
    branch) are fitted with it. There must be two fringes or more between most turns; shorter
    branches are extrapolated and listed. Raises `DataError` where no branch has them.

    >>> import numpy as np
    >>> from rapi_jax import Drive
    >>> from rapi_jax.readout import read_etalon
    >>> time = np.arange(400) * 0.006  # s
    >>> volts = np.interp(time, [0.0, 0.12, 2.1, 2.4], [4.0, 5.5, -0.5, 5.0])
    >>> transmission = 1 / (1 + 1.5 * np.sin(np.pi * 0.25 * volts / 0.322) ** 2)
    >>> found = read_etalon(transmission, Drive(time, volts), fsr_ghz=0.322)
    >>> round(float(np.ptp(found.frequency)), 2)  # GHz, of 0.25 GHz/V x 6 V
    1.5
    """
    x = np.asarray(transmission, dtype=np.float64)
    if x.shape != drive.time.shape or not np.isfinite(x).all():
        raise DataError(
            f"`transmission` must be one finite value for each of the drive's {drive.size} "
            f"samples, but has shape {x.shape}."
        )
    best = _Fit(drive, x, fringes_per_knot, 0.0)
    best.solve()
    if best.turns:
        best = _search(best, drive, x, fringes_per_knot)
    return best.readout(fsr_ghz)


def _search(fit: "_Fit", drive: Drive, x: np.ndarray, per_knot: float) -> "_Fit":
    """The lag of the laser's turns behind the drive's, one for all, by least squares."""
    fringe = float(np.min(np.diff(fit.edges))) / 8.0
    tried = {0.0: fit}

    def cost(lag: float) -> float:
        if lag not in tried:
            tried[lag] = _Fit(drive, x, per_knot, lag)
            tried[lag].solve(12)
        return float(tried[lag].error @ tried[lag].error)

    for lag in np.linspace(0.0, 0.6, 7) * fringe:
        cost(float(lag))
    best = min(tried, key=cost)
    step = 0.05 * fringe
    while step > drive.step_s / 4:
        best = min((best - step, best, best + step), key=cost)
        step /= 2
    found = tried[best]
    found.solve(30)
    wide = max(2.0 * drive.step_s, 0.01 * fringe)
    bend = (cost(best - wide) - 2 * cost(best) + cost(best + wide)) / wide**2
    found.lag_stderr = float(np.sqrt(2 * found.variance() / bend)) if bend > 0 else fringe
    return found


def _segment_phase(x: np.ndarray) -> np.ndarray | None:
    """Unwrapped phase of the fundamental on one branch, rising; `None` with too few fringes."""
    if x.size < 24:
        return None
    trend = np.polyfit(np.linspace(-1, 1, x.size), x, 1)
    y = x - np.polyval(trend, np.linspace(-1, 1, x.size))
    size = int(fft.next_fast_len(3 * x.size) or 3 * x.size)
    padded = np.concatenate([-y[::-1] + 2 * y[0], y, -y[::-1] + 2 * y[-1]])[:size]
    padded = np.pad(padded, (0, size - padded.size))
    spectrum = np.asarray(fft.fft(padded))
    power = np.abs(spectrum[: size // 2])
    power[: int(1.3 * size / x.size)] = 0.0  # less than 1.3 fringes on the branch
    top = int(np.argmax(power))
    if not np.isfinite(power[top]) or top * x.size / size < 1.3:
        return None
    hz = np.arange(size)
    keep = (hz > 0.4 * top) & (hz < 1.7 * top)
    z = np.asarray(fft.ifft(np.where(keep, spectrum, 0.0)))[x.size : 2 * x.size]
    return np.unwrap(np.angle(z))


class _Fit:
    """Spline phase, fringe shape, background and visibility, by damped Gauss-Newton."""

    def __init__(self, drive: Drive, x: np.ndarray, per_knot: float, lag: float) -> None:
        self.drive, self.time, self.x, self.lag = drive, drive.time, x, lag
        self.lag_stderr = drive.step_s / 2
        start, stop = float(drive.time[0]), float(drive.time[-1])
        self.turns = drive_turns(drive, start + drive.step_s, stop - drive.step_s)
        self.rising = not self.turns[0][1] if self.turns else rising_at(drive, (start + stop) / 2)
        inner = [t + lag for t, _ in self.turns if start < t + lag < stop]
        self.edges = [start, *inner, stop]
        self.branch = np.searchsorted(inner, drive.time, side="right")
        self.faults: list[str] = []
        phase = self._initial()
        self._basis(phase, per_knot)
        self.coefficients = np.linalg.lstsq(self.basis, phase, rcond=None)[0]

    def _initial(self) -> np.ndarray:
        """Phase of the analytic signal branch by branch, joined to the nearest whole fringe."""
        phase = np.zeros(self.x.size)
        known: list[int] = []
        level = None
        raw = [_segment_phase(self.x[self.branch == k]) for k in range(len(self.edges) - 1)]
        pace = [
            0.0 if r is None else float(np.ptp(r) / np.ptp(self.drive.value[self.branch == k]))
            for k, r in enumerate(raw)
        ]
        longest = int(np.argmax([0.0 if r is None else float(np.ptp(r)) for r in raw]))
        for k in range(len(self.edges) - 1):
            part = np.flatnonzero(self.branch == k)
            sign = 1.0 if self.rising == (k % 2 == 0) else -1.0
            found = raw[k]
            if found is None or np.ptp(self.drive.value[part]) * pace[longest] < 1.5 * _TWO_PI:
                continue
            known.append(k)
            t = self.time[part]
            # The ends of the analytic signal are poor: carry its inner part outward.
            inner = (t > t[0] + 0.06 * np.ptp(t)) & (t < t[-1] - 0.06 * np.ptp(t))
            curve = np.polynomial.Polynomial.fit(t[inner], sign * found[inner], 3)
            found = np.where(inner, sign * found, curve(t))
            begin = curve(self.edges[k])
            if level is not None and k - 1 in known:
                found = found + _TWO_PI * np.round((level - begin) / _TWO_PI)
            phase[part] = found
            level = found[-1] + curve.deriv()(t[-1]) * (self.edges[k + 1] - t[-1])
        if not known:
            raise DataError(
                "The cavity's transmission shows fewer than two fringes on every branch of the "
                "drive: scan further, or use a cavity with closer fringes."
            )
        self.known = known
        for k in range(len(self.edges) - 1):
            part = np.flatnonzero(self.branch == k)
            if k in known or not part.size:
                continue
            self.faults.append(
                f"branch from {self.edges[k]:.6g} to {self.edges[k + 1]:.6g} s: fewer than two "
                "fringes; its frequency rests on its neighbour"
            )
            # As fast as the drive moves, on the scale of a branch that could be read.
            near = min(known, key=lambda j: abs(j - k))
            other = np.flatnonzero(self.branch == near)
            scale = np.ptp(phase[other]) / np.ptp(self.drive.value[other])
            joint = part[0] - 1 if near < k else part[-1] + 1
            move = self.drive.value[part] - self.drive.value[joint]
            phase[part] = phase[joint] + scale * move
        return phase

    def _basis(self, phase: np.ndarray, per_knot: float) -> None:
        """Cubic B-splines with a corner at each turn: three knots there leave only the value."""
        knots = [self.edges[0]] * 4
        for k in range(len(self.edges) - 1):
            part = np.flatnonzero(self.branch == k)
            if k:
                knots += [self.edges[k]] * 3
            if k in self.known:
                fringes = np.abs(phase[part] - phase[part[0]]) / _TWO_PI
                inner = np.arange(1, int(fringes[-1] / per_knot)) * per_knot
                grown = np.maximum.accumulate(fringes) + 1e-9 * np.arange(part.size)
                knots += list(np.interp(inner, grown, self.time[part]))
        knots += [self.edges[-1]] * 4
        self.knots = np.array(knots)
        matrix = interpolate.BSpline.design_matrix(
            np.clip(self.time, knots[0], knots[-1]), self.knots, 3
        )
        self.basis = matrix.toarray()

    def _frame(self) -> np.ndarray:
        """Straight lines in time on each branch that was read, for background and visibility."""
        columns = []
        owner = np.array(
            [min(self.known, key=lambda j, k=k: abs(j - k)) for k in range(len(self.edges) - 1)]
        )[self.branch]
        for k in self.known:
            here = owner == k
            middle = (self.edges[k] + self.edges[k + 1]) / 2
            half = max((self.edges[k + 1] - self.edges[k]) / 2, 1e-12)
            columns += [here.astype(float), here * (self.time - middle) / half]
        return np.column_stack(columns)

    def _shape(self, shape: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The fringe at each phase and its slope, from harmonic coefficients."""
        h = np.arange(1, THRESHOLDS.fringe_harmonics + 1)
        angle = phase[:, None] * h
        c, s = shape[: THRESHOLDS.fringe_harmonics], shape[THRESHOLDS.fringe_harmonics :]
        return np.cos(angle) @ c + np.sin(angle) @ s, (-np.sin(angle) * h) @ c + (
            np.cos(angle) * h
        ) @ s

    def solve(self, steps: int = 40) -> None:
        """Alternate: shape given the levels, levels given the shape, phase given both."""
        frame = self._frame()
        x, h = self.x, np.arange(1, THRESHOLDS.fringe_harmonics + 1)
        visibility = np.full(x.size, np.std(x) * np.sqrt(2))
        third = np.diff(np.eye(self.basis.shape[1]), 2, axis=0)
        for step in range(steps):
            phase = self.basis @ self.coefficients
            angle = phase[:, None] * h
            waves = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
            both = np.concatenate([waves * visibility[:, None], frame], axis=1)
            shape = np.linalg.lstsq(both, x, rcond=None)[0][: 2 * THRESHOLDS.fringe_harmonics]
            shape /= np.hypot(shape[0], shape[THRESHOLDS.fringe_harmonics])
            fringe, slope = self._shape(shape, phase)
            both = np.concatenate([frame * fringe[:, None], frame], axis=1)
            levels = np.linalg.lstsq(both, x, rcond=None)[0]
            visibility = frame @ levels[: frame.shape[1]]
            usual = float(np.median(visibility))
            visibility = np.clip(visibility, 0.3 * usual, 3.0 * usual)
            background = frame @ levels[frame.shape[1] :]
            error = x - background - visibility * fringe
            jac = (visibility * slope)[:, None] * self.basis
            # Shape, levels and phase trade off a little: what they explain is not the phase's.
            others = np.concatenate([waves * visibility[:, None], both], axis=1)
            others, _ = np.linalg.qr(others)
            free = jac - others @ (others.T @ jac)
            normal = free.T @ free
            ridge = 1e-6 * np.trace(normal) / normal.shape[0]
            normal = normal + ridge * (third.T @ third + 1e-3 * np.eye(third.shape[1]))
            move = np.linalg.solve(normal, free.T @ error)
            largest = float(np.abs(move).max())
            self.coefficients = self.coefficients + move * min(1.0, 0.7 / max(largest, 1e-30))
            if step > 5 and largest < 1e-5:
                break
        self.error, self.visibility, self.normal = error, visibility, normal

    def variance(self) -> float:
        """Variance of the residuals, grown for their correlation from sample to sample."""
        e = self.error - self.error.mean()
        near = max(float(e[1:] @ e[:-1] / (e @ e)), 0.0)
        fewer = (1 + near) / max(1 - near, 0.02)
        return float(e @ e) / max(1, e.size - self.normal.shape[0]) * fewer

    def readout(self, fsr_ghz: float) -> Readout:
        """The phase as frequency, with errors that allow for correlated residuals."""
        phase = self.basis @ self.coefficients
        covariance = self.variance() * np.linalg.inv(self.normal)
        # The phase's zero and the shape's are one: only differences are known.
        centred = self.basis - self.basis.mean(axis=0)
        spread = np.einsum("ij,jk,ik->i", centred, covariance, centred)
        turns = tuple(Turn(t + self.lag, self.lag_stderr, t, up) for t, up in self.turns)
        return Readout(
            self.time,
            (phase - phase[0]) / _TWO_PI * fsr_ghz,
            np.sqrt(np.maximum(spread, 0.0)) / _TWO_PI * fsr_ghz,
            turns,
            Peaks(*(np.zeros(0) for _ in range(4))),
            1e-9 / fsr_ghz,
            float("inf"),
            float(np.sqrt(np.mean((self.error / self.visibility) ** 2))),
            tuple(self.faults),
        )
