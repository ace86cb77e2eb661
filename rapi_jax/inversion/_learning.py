"""Iterative learning control: a drive improved from measurement to measurement, without a model."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from rapi_jax._arguments import takes
from rapi_jax._errors import DataError, LimitError
from rapi_jax._limits import DriveLimits
from rapi_jax._metrics import Linearity, linearity, turning_points
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._run import Run

from ._target import Target
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class Learned:
    """The course of a learning: one entry a measurement, the start first.

    - `runs`: what was measured, each with its drive. `linearity`: of each.
    - `error_ghz`: rms distance from the target over the whole period, lag and origin taken out.
    - `best`: the measurement with the smallest nonlinearity (both branches together).
    - `lead_s`: lag of the response that was allowed for, s.
    - `stopped`: "done" after all iterations, "diverged" or "limits"; `reason` says more.

    >>> from rapi_jax import DriveLimits, Run, learn, linear_scan, triangle
    >>> (target,) = linear_scan(20.0, span=60.0, samples=512)
    >>> (start,) = triangle(20.0, amplitude=3.0, bias=3.0, samples=512)
    >>> limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    >>> bench = lambda drive: Run(drive, 20.0 * drive.value)
    >>> found = learn(bench, target, start, limits=limits, iterations=1)
    >>> found.best, found.rms_ghz.shape  # measurements x branches
    (0, (2, 2))
    """

    runs: tuple[Run, ...]
    linearity: tuple[Linearity, ...]
    error_ghz: np.ndarray
    best: int
    lead_s: float
    stopped: str
    reason: str = ""

    @property
    def drives(self) -> tuple[Drive, ...]:
        """The drive of each measurement."""
        return tuple(run.drive for run in self.runs)

    @property
    def drive(self) -> Drive:
        """The best drive."""
        return self.runs[self.best].drive

    @property
    def rms_ghz(self) -> np.ndarray:
        """Nonlinearity up and down against measurement: shape (measurements, 2), GHz."""
        return np.array([scan.rms_ghz for scan in self.linearity])


@takes(target=Target, start=Drive, limits=DriveLimits)
def learn(
    measure: Callable[[Drive], Run],
    target: Target,
    start: Drive,
    *,
    limits: DriveLimits,
    iterations: int = 10,
    gain: float = 0.7,
    bandwidth_hz: float | None = None,
    lead_s: float | None = None,
    slope: Any = None,
    response: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Learned:
    r"""Learn the drive under which the device follows `target`, up to a constant.

    $u \leftarrow u + \gamma\, Q R^{-1}[(\nu^* - \nu)(t + \tau) / s(t)]$: $Q$ is a zero-phase
    low-pass filter, $\tau$ the response's lag, $s$ its local slope, $R$ the rest of its linear
    dynamics where they are known.

    **Arguments:**

    - `measure`: plays a drive and gives its run; on a bench, `lambda d: bench.measure(d).runs[0]`.
    - `start`: one period, from its minimum: the target's own shape in volts, a plain triangle of
      about the right size, or a model's drive. It is put on the target's samples. What its corners
      hold beyond `bandwidth_hz` stays in the drive: sharp ones ring on a device that resonates.
    - `limits`: of the drive. A start beyond them raises `LimitError`; a later drive ends the
      learning before it is played. Nothing is clipped.
    - `gain`: part of the error taken out in one iteration.
    - `bandwidth_hz`: of `Q` (half of the error's amplitude passes there); 15 scan rates by default.
      It must stay below the device's resonances, where the response is larger than `slope` and
      turns its sign: learning diverges there.
    - `lead_s`: lag of the response, s; by default how much later the first response turns.
    - `slope`: local slope, GHz/V, one number or one per sample; by default from the first run.
    - `response`: hertz -> complex response of amplifier and mirror relative to that at rest,
      without what `lead_s` holds; by default 1. With it the bandwidth may pass a resonance.

    A nonlinearity 1.5 times the best twice in a row (4 times: once) is taken for divergence and
    ends the learning; `best` is kept. Raises `DataError` where drive and target do not match.

    >>> import numpy as np
    >>> from rapi_jax import DriveLimits, Run, learn, linear_scan, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> (target,) = linear_scan(20.0, span=60.0, samples=512)
    >>> (start,) = triangle(20.0, amplitude=3.6, bias=3.0, samples=512)
    >>> limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    >>> bench = lambda drive: Run(drive, np.asarray(predict(paper_device(), drive)))
    >>> found = learn(bench, target, start, limits=limits, iterations=3)
    >>> bool(found.rms_ghz[-1].max() < 0.2 * found.rms_ghz[0].max())
    True
    """
    if not (gain > 0 and iterations >= 0):
        raise ValueError("Arguments `gain` and `iterations` must be positive.")
    _check(target, start)
    rate, size = target.excitation_hz, target.time.size
    band = 15.0 * rate if bandwidth_hz is None else bandwidth_hz
    learning = _low_pass(size, rate, band)
    if response is not None:
        learning = learning * _regularised_inverse(
            np.asarray(response(np.arange(learning.size) * rate))
        )
    drive = _drive(
        start, target, _resample_periodic(target.time, start.time, start.value, 1.0 / rate)
    )
    limits.check(drive)
    runs: list[Run] = []
    scans: list[Linearity] = []
    errors: list[float] = []
    stopped, reason = "done", ""
    for number in range(iterations + 1):
        try:
            limits.check(drive)
            run = measure(drive)
        except LimitError as error:
            if number == 0:
                raise
            stopped, reason = "limits", f"the drive of iteration {number} is refused: {error}"
            break
        answer = _filled(run, size)
        if number == 0:
            lead_s = _lag(drive, answer) if lead_s is None else float(lead_s)
            slope = _slope(drive, _advanced(answer, lead_s * rate)) if slope is None else slope
            slope = np.broadcast_to(np.asarray(slope, dtype=float), size)
        error_now = target.value - _advanced(answer, float(lead_s or 0.0) * rate)
        error_now = error_now - error_now.mean()
        runs.append(run)
        scans.append(linearity(run))
        errors.append(float(np.sqrt(np.mean(error_now**2))))
        reason = _diverged(scans)
        if reason:
            stopped = "diverged"
            break
        change = np.fft.irfft(np.fft.rfft(error_now / slope) * learning, size)
        drive = _drive(start, target, drive.value + gain * change)
    best = int(np.argmin([_total_rms(scan) for scan in scans]))
    lead = float(lead_s or 0.0)
    return Learned(tuple(runs), tuple(scans), np.array(errors), best, lead, stopped, reason)


def _check(target: Target, start: Drive) -> None:
    if not start.repeats or start.periods < 1:
        raise DataError("Learning starts from a drive that repeats, with one complete period.")
    if abs(start.rate / target.excitation_hz - 1) > 1e-9:
        raise DataError(
            f"the start scans at {start.rate:g} Hz, but the target at {target.excitation_hz:g} Hz. "
            "Learning holds for one rate: start from a drive of the target's."
        )


def _drive(start: Drive, target: Target, value: np.ndarray) -> Drive:
    return Drive(target.time, value, target.excitation_hz, start.waveform)


def _resample_periodic(
    at: np.ndarray, time: np.ndarray, value: np.ndarray, period: float
) -> np.ndarray:
    one = time < period * (1 - 1e-9)
    return np.interp(at, time[one], value[one], period=period)


def _filled(run: Run, size: int) -> np.ndarray:
    """One period of the response, readings that are not numbers bridged."""
    if run.drive.size != size:
        raise DataError(
            f"the run has {run.drive.size} samples, but its drive had {size}. `measure` must give "
            "the response on the samples of the drive it was given."
        )
    good = np.flatnonzero(run.valid)
    if good.size < size / 2:
        raise DataError(f"only {good.size} of {size} readings are numbers: nothing to learn from.")
    return np.interp(np.arange(size), good, run.response[good], period=size)


def _advanced(response: np.ndarray, cycles: float) -> np.ndarray:
    """A periodic response earlier by a part of its period, by straight lines: corners stay put."""
    size = response.size
    return np.interp(np.arange(size) + cycles * size, np.arange(size), response, period=size)


def _lag(drive: Drive, response: np.ndarray) -> float:
    """How much later than the drive the response turns, s: free of hysteresis, unlike its phase."""
    cycles = drive.time * drive.rate
    turns = zip(turning_points(cycles, response), turning_points(cycles, drive.value), strict=True)
    lags = [(late - early + 0.5) % 1.0 - 0.5 for late, early in turns]
    return max(0.0, float(np.mean(lags)) / drive.rate)


def _slope(drive: Drive, response: np.ndarray) -> np.ndarray:
    """Response over drive, sample by sample, over 1 % of the period; bounded below near turns."""
    width = max(3, drive.size // 100)
    kernel = np.ones(width) / width

    def rise(x: np.ndarray) -> np.ndarray:
        step = (np.roll(x, -1) - np.roll(x, 1)) / 2.0
        wide = np.concatenate([step[-width:], step, step[:width]])
        return np.convolve(wide, kernel, mode="same")[width:-width]

    du, dy = rise(drive.value), rise(response)
    mean = float(np.abs(dy).sum() / np.abs(du).sum())
    steady = np.abs(du) > 0.5 * float(np.abs(du).mean())
    local = np.where(steady, dy / np.where(steady, du, 1.0), mean)
    return np.clip(local, THRESHOLDS.least_local_slope * mean, mean / THRESHOLDS.least_local_slope)


def _low_pass(size: int, rate: float, bandwidth_hz: float) -> np.ndarray:
    """Gains of the harmonics: a smooth fall that does not ring, one half at the bandwidth."""
    if not bandwidth_hz > 0:
        raise ValueError(f"Argument `bandwidth_hz` must be positive, but is {bandwidth_hz}.")
    hertz = np.arange(size // 2 + 1) * rate
    return np.exp(-np.log(2.0) * (hertz / bandwidth_hz) ** 2)


def _regularised_inverse(response: np.ndarray) -> np.ndarray:
    """The inverse of a response, held back where that is small: there a drive does little."""
    return np.conj(response) / np.maximum(np.abs(response) ** 2, THRESHOLDS.weak_response**2)


def _total_rms(scan: Linearity) -> float:
    return float(np.hypot(*scan.rms_ghz))


def _diverged(scans: list[Linearity]) -> str:
    course = [_total_rms(scan) for scan in scans]
    best = min(course)
    last = course[-2:]
    if not np.isfinite(course[-1]) or last[-1] > THRESHOLDS.much_worse * best:
        return f"nonlinearity grew to {course[-1]:.3g} GHz from {best:.3g} GHz in one iteration"
    if len(last) == 2 and min(last) > THRESHOLDS.worse * best:
        return f"nonlinearity stayed above {THRESHOLDS.worse:g} times its best, {best:.3g} GHz"
    return ""
