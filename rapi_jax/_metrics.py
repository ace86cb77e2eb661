"""How linear a frequency scan is, branch by branch (Eqs. 5 to 7, Section 4.1)."""

import dataclasses
from functools import cached_property

import numpy as np

from ._arguments import takes
from ._errors import DataError
from ._thresholds import THRESHOLDS
from .recording._run import ROI, Run
from .sampling import _phase

SPEED_OF_LIGHT = 299_792_458.0  # m/s


@dataclasses.dataclass(frozen=True, eq=False)
class Branch:
    """One branch of a scan within its region of interest.

    - `direction`: "up" or "down"; `period`: which period, `None` for all of them together.
    - `time`: s since the branch's turning point; `frequency`: GHz. Several periods together lie
      side by side, on one line.
    - `duration_s`: length of the region of interest.
    """

    direction: str
    period: int | None
    time: np.ndarray
    frequency: np.ndarray
    duration_s: float

    @cached_property
    def _line(self) -> tuple[float, np.ndarray]:
        t = self.time - self.time.mean()
        y = self.frequency - self.frequency.mean()
        slope = float(t @ y) / float(t @ t)
        return slope, y - slope * t

    @property
    def slope_ghz_per_s(self) -> float:
        """The scan rate of the least-squares line (beta), GHz/s."""
        return self._line[0]

    @property
    def residual(self) -> np.ndarray:
        """The frequency less the least-squares line, GHz: the nonlinearity nu_nl."""
        return self._line[1]

    @property
    def rms_ghz(self) -> float:
        """The rms nonlinearity nu_nl,rms about the least-squares line, GHz."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def worst_ghz(self) -> float:
        """The largest nonlinearity, GHz."""
        return float(np.abs(self.residual).max())

    @property
    def excursion_ghz(self) -> float:
        """Peak to peak of the frequency in the region of interest (Delta nu), GHz."""
        return float(np.ptp(self.frequency))

    def one_minus_r2(self, excursion_ghz: float | None = None) -> float:
        """1 - r^2 = 12 (rms / excursion)^2; at the branch's own excursion unless one is given."""
        excursion = self.excursion_ghz if excursion_ghz is None else excursion_ghz
        return 12.0 * (self.rms_ghz / excursion) ** 2  # Section 4.1

    def _cycles(self, delay_s: float) -> float:
        return 2.0 * np.pi * delay_s * self.rms_ghz * 1e9

    def eq5_width_hz(self, delay_s: float) -> float:
        """The beat's width as the paper estimates it, Hz; T_s is the region of interest."""
        return (1.0 + self._cycles(delay_s)) / self.duration_s  # Eq. (5)

    def resolution_m(self, delay_s: float) -> float:
        """Range resolution at delay `delay_s`, m."""
        span = self.excursion_ghz * 1e9
        return SPEED_OF_LIGHT * (1.0 + self._cycles(delay_s)) / (2.0 * span)  # Eq. (6)

    def nonlinear_resolution_m(self, delay_s: float) -> float:
        """Range resolution where the nonlinearity alone limits it, m."""
        return SPEED_OF_LIGHT * self._cycles(delay_s) / (2.0 * self.excursion_ghz * 1e9)  # Eq. (7)

    def spectrum(self, delay_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Power spectrum of the beat at `delay_s`: offsets from its mean frequency (Hz), power.

        Rectangular window over the region of interest, zero-padded. The beat cos(2 pi nu tau) is
        taken on its positive-frequency side and shifted down by beta tau; the frequency is drawn
        straight between samples, as finely as the beat needs. Power is relative to that of a linear
        scan's peak. Raises `DataError` for several periods together, or a delay too long to form.
        """
        if self.period is None:
            raise DataError(
                f"the {self.direction} branches of several periods form no one beat. Take one of "
                "them."
            )
        order = np.argsort(self.time)
        time, residual = self.time[order], self.residual[order]
        radians = 2.0 * np.pi * delay_s * 1e9
        jump = radians * float(np.abs(np.diff(residual)).max())
        count = time.size * max(1, int(np.ceil(jump / 0.5)))
        if count > THRESHOLDS.longest_beat:
            raise DataError(
                f"the beat of the {self.direction} branch cannot be formed: at {delay_s:g} s its "
                f"phase moves {jump:.3g} rad between samples. Record more samples, or give the "
                "delay in seconds."
            )
        even = np.linspace(time[0], time[-1], count)
        phase = radians * np.interp(even, time, residual)
        length = 1 << int(np.ceil(np.log2(16 * count)))
        power = np.abs(np.fft.fft(np.exp(1j * phase), length) / count) ** 2
        offset = np.fft.fftfreq(length, (even[-1] - even[0]) / (count - 1))
        return np.fft.fftshift(offset), np.fft.fftshift(power)

    def peak_width_hz(self, delay_s: float) -> float:
        """Width of the beat spectrum at `delay_s`, Hz: outermost half maxima of its power."""
        offset, power = self.spectrum(delay_s)
        half = power.max() / 2.0
        above = np.flatnonzero(power >= half)
        first, last = int(above[0]), int(above[-1])
        edges = [
            np.interp(half, [power[out], power[into]], [offset[out], offset[into]])
            for out, into in ((first - 1, first), (last + 1, last))
        ]
        return float(edges[1] - edges[0])


@dataclasses.dataclass(frozen=True, eq=False)
class Linearity:
    """Both branches of a scan: `up` and `down` over all complete periods, and one per period.

    >>> from rapi_jax import Run, linearity, triangle
    >>> (drive,) = triangle(10.0, amplitude=4.5, bias=3.0, samples=200)
    >>> scan = linearity(Run(drive, 20.0 * drive.value))
    >>> max(scan.rms_ghz) < 1e-9, scan.up.direction  # GHz
    (True, 'up')
    """

    up: Branch
    down: Branch
    up_periods: tuple[Branch, ...]
    down_periods: tuple[Branch, ...]
    turning: tuple[float, float]  # phases of the response's minimum and maximum, 0 to 1

    @property
    def rms_ghz(self) -> tuple[float, float]:
        """The rms nonlinearity of `up` and of `down`, GHz."""
        return self.up.rms_ghz, self.down.rms_ghz


@takes(run=Run)
def linearity(run: Run, *, turning: tuple[float, float] | None = None) -> Linearity:
    """The linearity of one run of a repeating drive.

    The region of interest is the middle 80 % of the time between the response's turning points.
    These are found to a small part of a sample where the turn is sharp; `turning` gives their
    phases (cycles after the drive's first sample: minimum, maximum) where they are known better.
    Readings that are not numbers are left out. Raises `DataError` where there is no complete
    branch.

    >>> import numpy as np
    >>> from rapi_jax import Run, linearity, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> (drive,) = triangle(10.0, amplitude=4.5, bias=3.0, samples=2000)
    >>> scan = linearity(Run(drive, np.asarray(predict(paper_device(), drive))))
    >>> [round(float(rms), 2) for rms in scan.rms_ghz]  # GHz, up and down
    [0.44, 3.29]
    """
    drive = run.drive
    if not drive.repeats:
        raise DataError(
            f"run {run.name!r}: linearity is that of a repeating scan, but this drive does not "
            "repeat. Give it its rate and waveform."
        )
    good = run.valid
    if good.sum() < 16:
        raise DataError(f"run {run.name!r}: {good.sum()} readings are too few to judge a scan.")
    cycles = drive.time[good] * drive.rate
    response = run.response[good]
    low, high = turning_points(cycles, response) if turning is None else turning
    rise = (high - low) % 1.0
    ends = (drive.time[0] * drive.rate, (drive.time[-1] + drive.step_s) * drive.rate)
    sides = [
        _side(cycles, response, drive.rate, name, begin, length, ends, run.name)
        for name, begin, length in (("up", low, rise), ("down", high, 1.0 - rise))
    ]
    return Linearity(sides[0][0], sides[1][0], sides[0][1], sides[1][1], (low, high))


def _side(cycles, response, rate, name, begin, length, ends, run_name):
    """The branch that begins at phase `begin`: all periods together, and one by one."""
    slack = 1.5 * (ends[1] - ends[0]) / max(1, cycles.size)
    whole = ends[1] - ends[0] < 2.0 - slack  # one period: its end joins its start
    first = int(np.floor(ends[0] - begin)) if not whole else 0
    since = cycles - begin
    if whole:
        if ends[1] - ends[0] < 1.0 - slack:
            raise DataError(f"run {run_name!r}: less than one period is recorded.")
        since = np.mod(since, 1.0)
    periods = []
    for number in range(first, first + 1 if whole else int(np.ceil(ends[1] - begin)) + 1):
        start, stop = number + ROI[0] * length, number + ROI[1] * length
        inside = begin + start >= ends[0] - slack and begin + stop <= ends[1] + slack
        if not (whole or inside):
            continue
        use = (since >= start) & (since <= stop)
        if use.sum() < 4:
            raise DataError(f"run {run_name!r}: its {name} branch has {use.sum()} readings.")
        time = (since[use] - number) / rate
        periods.append(
            Branch(name, len(periods), time, response[use], (ROI[1] - ROI[0]) * length / rate)
        )
    if not periods:
        raise DataError(f"run {run_name!r}: no {name} branch is complete. Record more periods.")
    time = np.concatenate([b.time for b in periods])
    every = np.concatenate([b.frequency for b in periods])
    together = None if len(periods) > 1 else 0
    return Branch(name, together, time, every, periods[0].duration_s), tuple(periods)


def turning_points(cycles: np.ndarray, response: np.ndarray) -> tuple[float, float]:
    """Phases (0 to 1) of a repeating response's minimum and maximum, finer than a sample.

    A sharp corner is where the curves of its two sides meet; a round one is the vertex of a
    parabola. Only what is next to the turn is fitted; `Run.along` fits a tenth of the swing.
    """
    coarse = _phase.turning_phases(cycles, response)
    slope = 2.0 * float(np.ptp(response))  # of a symmetric triangle, a period
    low = _refined(cycles, response, coarse[0], slope)
    return float(low), float(_refined(cycles, -response, coarse[1], slope))


def _refined(cycles: np.ndarray, value: np.ndarray, at: float, slope: float) -> float:
    """The phase of the minimum of `value` near `at`."""
    for _ in range(3):
        x = np.mod(cycles - at + 0.5, 1.0) - 0.5
        left = (x > -THRESHOLDS.turn_near) & (x < -THRESHOLDS.turn_guard)
        right = (x < THRESHOLDS.turn_near) & (x > THRESHOLDS.turn_guard)
        if min(left.sum(), right.sum()) < 8:
            return at  # too few samples for better
        a, b = np.polyfit(x[left], value[left], 2), np.polyfit(x[right], value[right], 2)
        if min(-a[1], b[1]) > 0.25 * slope:
            roots = np.roots(a - b)
            real = roots[np.abs(roots.imag) < 1e-9].real
            move = float(real[np.argmin(np.abs(real))]) if real.size else 0.0
        else:
            near = np.abs(x) < THRESHOLDS.turn_near
            c = np.polyfit(x[near], value[near], 2)
            move = float(-c[1] / (2.0 * c[0])) if c[0] > 0 else 0.0
        if abs(move) > THRESHOLDS.turn_near:
            return at
        at = (at + move) % 1.0
    return at
