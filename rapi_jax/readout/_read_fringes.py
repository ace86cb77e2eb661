"""`read_fringes`: all steps, in order."""

import dataclasses

import numpy as np

from rapi_jax.recording._drive import Drive

from ._decimate import Decimated, decimate
from ._envelope import envelope_from_extremes, fit_envelope
from ._fringe_signal import FringeSignal
from ._fringes import Fringes, mask_clipped
from ._join_branches import join_branches
from ._readout import Peaks, Readout, Turn
from ._refine import fringe_path, refine_phase
from .cavity import _scale
from .cavity._comb import Comb, read_comb
from .cavity._peaks import PeakFit, find_peaks, find_regions
from .turns._drive_turns import rising_at
from .turns._find import CavityPeaks, find_turns
from .turns._given_fringe import refit_on_fringe
from .turns._hidden import describe_hidden
from .turns._laser_turn import LaserTurn, refine_turn

_TWO_PI = 2 * np.pi


def read_fringes(fringes: Fringes, drive: Drive) -> Readout:
    """Optical frequency against time from raw fringes (Eq. 1), with the cavity as scale.

    Between turns the phase is that of the analytic signal; at turns, that of a local model in which
    the fringe rate passes zero, fitted to the fringes themselves: the drive only says that the
    laser turns, and roughly when. Then the fringes correct the whole phase, which gives each value
    its standard error; the cavity's comb checks the count of fringes, mends it where it can, and
    calibrates the delay. What is wrong with a record is listed in `faults`; `DataError` only where
    there is nothing to read.

    >>> import numpy as np
    >>> from rapi_jax import triangle
    >>> from rapi_jax.readout import Fringes, read_fringes
    >>> (drive,) = triangle(20.0, amplitude=4.0, bias=3.0, samples=2000)
    >>> time = 0.01 + np.arange(60_000) * 1e-6  # s
    >>> phase = np.mod(time * 20.0, 1.0)
    >>> ghz = 75.0 * np.where(phase < 0.5, 2 * phase, 2 - 2 * phase)
    >>> light = np.cos(2 * np.pi * ghz * 24.5)  # a delay of 24.5 ns
    >>> found = read_fringes(Fringes(light, None, sample_hz=1e6, start_s=0.01), drive)
    >>> round(float(np.ptp(found.frequency)))  # GHz
    75
    """
    faults: list[str] = []
    mask = mask_clipped(fringes.interferometer, fringes.full_scale)
    if mask is not None:
        faults.append(
            f"interferometer: {100 * mask.mean():.2f} % of samples clipped, first at "
            f"{fringes.start_s + int(np.argmax(mask)) / fringes.sample_hz:.6g} s; left out"
        )
    data = decimate(fringes.interferometer, fringes.sample_hz, fringes.start_s, mask, drive)
    block = max(8, int(4.0 / (data.fringe_hz * data.step_s)))
    offset, amplitude = envelope_from_extremes(data.value, block)
    signal = FringeSignal.of(
        data.time, (data.value - offset) / amplitude, data.good, data.highest_hz * data.step_s
    )
    regions = None
    if fringes.cavity is not None:
        regions = find_regions(
            fringes.cavity, fringes.sample_hz, fringes.start_s, signal.time, signal.travel
        )
    turns, notes = find_turns(signal, drive, CavityPeaks(fringes, regions, signal))
    faults += notes
    middle = float(data.time[data.time.size // 2])
    rising = (not turns[0].rising_after) if turns else rising_at(drive, middle)

    solution = _solve_phase(data, signal, turns, rising, rough=True)
    signal = dataclasses.replace(signal, y=solution.y)
    turns = [refine_turn(signal, turn) for turn in turns]
    solution = _solve_phase(data, signal, turns, rising)
    scale = _calibrate_scale(fringes, data, solution, turns)
    for _ in range(
        2
    ):  # a turn on the wrong fringe is fitted again on the one that the comb asks for
        wrong = [slip for slip in scale.slips if slip.turn >= 0]
        if not wrong:
            break
        other = list(turns)
        for slip in wrong:
            other[slip.turn] = refit_on_fringe(signal, turns[slip.turn], slip.jump)
        again = _solve_phase(data, signal, other, rising)
        rescaled = _calibrate_scale(fringes, data, again, other)
        if sum(abs(s.jump) for s in rescaled.slips) >= sum(abs(s.jump) for s in scale.slips):
            break
        turns, solution, scale = other, again, rescaled
    return _collect(fringes, data, solution, turns, scale, faults)


@dataclasses.dataclass(frozen=True, eq=False)
class _Solution:
    """Phase and standard error (rad), normalised fringes, visibility; and what did not fit."""

    phase: np.ndarray
    stderr: np.ndarray
    y: np.ndarray
    visibility: np.ndarray
    notes: list[str]


def _solve_phase(
    data: Decimated,
    signal: FringeSignal,
    turns: list[LaserTurn],
    rising: bool,
    *,
    rough: bool = False,
) -> _Solution:
    base, notes = join_branches(signal, turns, rising)
    phase = base
    for _ in range(2):
        offset, amplitude = fit_envelope(data.value, data.good, phase, fringe_path(phase))
        y = (data.value - offset) / amplitude
        # A rough phase is still far off: let corrections add up instead of smoothing them.
        phase, stderr = refine_phase(data.time, y, data.good, phase, phase if rough else base)
    # A value is a mean over its group of samples: at a corner that is not the value in its middle.
    stderr[1:-1] = np.hypot(stderr[1:-1], np.abs(np.diff(phase, 2)) / 8)
    return _Solution(phase, stderr, y, amplitude, notes)


@dataclasses.dataclass(frozen=True, eq=False)
class _Scale:
    """The cavity's peaks and comb, slips, turns with peaks on both sides; and notes."""

    fits: list[PeakFit]
    comb: Comb | None
    slips: list[_scale.Slip]
    checked: np.ndarray
    notes: list[str]


def _calibrate_scale(
    fringes: Fringes, data: Decimated, solution: _Solution, turns: list[LaserTurn]
) -> _Scale:
    times = np.array([turn.fit.time_s for turn in turns])
    unchecked = np.zeros(times.size, dtype=bool)
    if fringes.cavity is None:
        return _Scale([], None, [], unchecked, [])
    notes: list[str] = []
    edge = mask_clipped(fringes.cavity, fringes.full_scale, low=False)
    if edge is not None:
        notes.append(f"cavity: {int(edge.sum())} samples clipped; left out of the fits")
    nominal = _TWO_PI * fringes.delay_s * fringes.fsr_ghz * 1e9
    fits, more = find_peaks(
        fringes.cavity,
        edge,
        fringes.sample_hz,
        fringes.start_s,
        data.time,
        solution.phase,
        fringe_path(solution.phase),
        times,
    )
    notes += more
    comb = read_comb(fits, nominal)
    if comb is None:
        notes.append("cavity: too few peaks for a scale; the nominal delay is used")
        return _Scale(fits, None, [], unchecked, notes)
    found, checked = _scale.find_slips(comb, fits, times)
    return _Scale(fits, comb, found, checked, notes + _scale.list_off_comb_peaks(comb, fits, times))


def _collect(
    fringes: Fringes,
    data: Decimated,
    solution: _Solution,
    turns: list[LaserTurn],
    scale: _Scale,
    faults: list[str],
) -> Readout:
    phase, stderr = solution.phase, solution.stderr
    visibility = solution.visibility / np.median(solution.visibility)
    if visibility.min() < 0.75 or visibility.max() > 1.33:
        faults.append(
            f"interferometer: visibility changes from {visibility.min():.2f} to "
            f"{visibility.max():.2f} of the usual (lowest at "
            f"{data.time[int(np.argmin(visibility))]:.6g} s); followed"
        )
    times = np.array([turn.fit.time_s for turn in turns])
    phase, stderr, corrected = _scale.correct_slips(scale.slips, data.time, phase, stderr, times)
    faults += solution.notes + scale.notes + corrected
    delay, delay_stderr = fringes.delay_s, float("inf")
    peaks = Peaks(*(np.zeros(0) for _ in range(4)))
    if scale.comb is not None:
        per_period = 1.0 / (_TWO_PI * fringes.fsr_ghz * 1e9)
        delay, delay_stderr = scale.comb.period * per_period, scale.comb.stderr * per_period
        used = scale.comb.used
        peaks = Peaks(
            np.array([p.time_s for p in scale.fits])[used],
            scale.comb.order[used],
            scale.comb.residual[used] / (delay * 1e9),
            np.array([p.stderr for p in scale.fits])[used] / (_TWO_PI * delay * 1e9),
        )
    per_ghz = _TWO_PI * delay * 1e9
    unseen = [0.0 if ok else t.hidden_s for t, ok in zip(turns, scale.checked, strict=True)]
    errors = np.hypot([t.fit.stderr_s for t in turns], unseen).tolist()
    hidden = [k for k, error in enumerate(unseen) if error > 0]
    faults += describe_hidden(
        [turns[k].fit.time_s for k in hidden], [errors[k] for k in hidden], len(turns)
    )
    read = tuple(
        Turn(t.fit.time_s, error, t.drive_s, t.rising_after, t.fit.rounding_s, bool(ok))
        for t, error, ok in zip(turns, errors, scale.checked, strict=True)
    )
    error = (solution.y - np.cos(solution.phase))[data.good]
    return Readout(
        data.time,
        (phase - phase[0]) / per_ghz,  # Eq. (1)
        stderr / per_ghz,
        read,
        peaks,
        delay,
        delay_stderr,
        float(np.sqrt(np.mean(error**2))),
        tuple(faults),
    )
