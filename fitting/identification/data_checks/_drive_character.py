"""What a drive is that lacks the period said of it: another rate, changing swings, many tones."""

import dataclasses

import numpy as np

from rapi_jax import Drive, Recording
from rapi_jax.internal import turning_samples

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class DriveCharacter:
    """The spectrum of a drive about its mean, and when it repeats.

    - `low_hz`, `high_hz`: the middle 90 % of its power lies between. `main_hz`: its strongest tone;
      `main_share`: the share of the power within a fifth of it.
    - `repeats_s`: the shortest time after which the drive is what it was; 0 where none is seen.
    - `swings`: the smallest and the largest swing from turn to turn, of those above a tenth of all.
    """

    low_hz: float
    high_hz: float
    main_hz: float
    main_share: float
    repeats_s: float
    swings: tuple[float, float]

    @property
    def many_tones(self) -> bool:
        """Whether no single tone holds half of the power."""
        return self.main_share < THRESHOLDS.main_tone

    @property
    def broadband(self) -> bool:
        """Whether the power of such a drive is spread widely."""
        wide = self.high_hz > THRESHOLDS.broadband * max(self.low_hz, 1e-300)
        return wide and self.many_tones

    @property
    def changing(self) -> bool:
        """Whether the swings differ by more than a tenth, as one amplitude after another does."""
        low, high = self.swings
        return low < (1.0 - THRESHOLDS.branch_swing) * high


def period_mismatch(drive: Drive, lag: float) -> float:
    """Rms difference of the drive and itself `lag` later (s), over its span."""
    inside = drive.time <= drive.time[-1] - lag
    later = np.interp(drive.time[inside] + lag, drive.time, drive.value)
    return float(np.sqrt(np.mean((later - drive.value[inside]) ** 2))) / drive.u_pp


def rate_error(drive: Drive) -> float:
    """By what share the drive's own rate is higher than the one said of it; 0 where none is seen.

    To first order a wrong rate makes the drive of as many periods later differ by its slope times
    the delay; that has to be most of how the two differ.
    """
    periods = int((drive.time[-1] + drive.step_s) * drive.rate - 0.2)
    if periods < 1:
        return 0.0
    lag, beside = periods / drive.rate, 0.05 / drive.rate
    t = drive.time[(drive.time >= beside) & (drive.time <= drive.time[-1] - lag)]
    at = [np.interp(t + shift, drive.time, drive.value) for shift in (lag, 0.0, beside, -beside)]
    apart, slope = at[0] - at[1], (at[2] - at[3]) / (2.0 * beside)
    square = float(slope @ slope)
    if t.size < 3 or not square > 0:
        return 0.0
    early = float(apart @ slope) / square
    whole = float(apart @ apart)
    rest = whole - early**2 * square
    known = abs(early) > THRESHOLDS.rate_sigmas * np.sqrt(max(rest, 0.0) / t.size / square)
    return early / (lag - early) if known and rest < 0.5 * whole else 0.0


def characterise(drive: Drive) -> DriveCharacter:
    """The character of a drive that moves."""
    from scipy.signal.windows import tukey

    window = np.asarray(tukey(drive.size + 2, 0.2))[1:-1]  # little leaks, the ends still count
    mean = float(window @ drive.value) / float(window.sum())
    power = np.abs(np.fft.rfft(window * (drive.value - mean))) ** 2
    hertz = np.fft.rfftfreq(drive.size, drive.step_s)
    total = np.cumsum(power) / power.sum()
    low, high = (float(hertz[np.searchsorted(total, level)]) for level in (0.05, 0.95))
    peak = float(hertz[1:][np.argmax(power[1:])])
    width = max(0.2 * peak, 2.5 * float(hertz[1]))  # a tone through the window is 4 lines wide
    near = np.abs(hertz - peak) <= width
    main = float(power[near] @ hertz[near] / power[near].sum())
    share = float(power[near].sum() / power.sum())
    return DriveCharacter(low, high, main, share, _repetition(drive), _swings(drive))


def _repetition(drive: Drive) -> float:
    """The shortest lag, to four fifths of the record, after which the drive is what it was (s)."""
    from scipy.signal import find_peaks

    u = drive.value - drive.value.mean()
    size = 1 << (2 * u.size - 1).bit_length()
    spectrum = np.fft.rfft(u, size)
    product = np.fft.irfft(np.abs(spectrum) ** 2, size)[: u.size]
    square = np.cumsum(u**2)
    lags = np.arange(THRESHOLDS.least_period_samples, int(THRESHOLDS.longest_lag * u.size))
    if not lags.size:
        return 0.0
    # Sums of squares of the two parts that overlap at each lag.
    early, late = square[u.size - 1 - lags], square[-1] - square[lags - 1]
    alike = 2.0 * product[lags] / np.maximum(early + late, 1e-300)
    peaks, _ = find_peaks(alike, height=THRESHOLDS.alike)
    for lag in lags[peaks][:50]:
        near = (lag + np.linspace(-1.0, 1.0, 21)) * drive.step_s
        misses = [period_mismatch(drive, float(one)) for one in near]
        if min(misses) < THRESHOLDS.shorter_period_miss:
            return float(near[int(np.argmin(misses))])
    return 0.0


def describe_repetition(recording: Recording) -> str | None:
    """What to say of a drive that repeats, though that was not said; `None` where none does."""
    for run in recording.runs:
        if run.drive.repeats or run.drive.u_pp == 0:
            continue
        period = _repetition(run.drive)
        if not 0.0 < THRESHOLDS.unstated_periods * period <= run.drive.time[-1]:
            continue
        said = dataclasses.replace(run.drive, excitation_hz=1.0 / period)
        rate = said.rate * (1.0 + rate_error(said))
        return (
            f"The drive of run {run.name!r} repeats, though, every {1.0 / rate:.4g} s: say "
            f'`excitation_hz = {rate:.4g}` and its `waveform`, which is not "other".'
        )
    return None


def _swings(drive: Drive) -> tuple[float, float]:
    turns = turning_samples(drive.value, THRESHOLDS.branch_swing)
    moves = np.abs(np.diff(drive.value[turns]))[1:-1]  # the first and last may be cut off
    return (float(moves.min()), float(moves.max())) if moves.size else (drive.u_pp, drive.u_pp)


def describe_drive(drive: Drive) -> tuple[str, str]:
    """The kind of fault of a drive without the period said of it, and the words that follow on
    "does not have the period of 10 Hz": what it is, and what to say instead.
    """
    found = characterise(drive)
    repeats = found.repeats_s
    if found.many_tones:
        name = "broadband" if found.broadband else "a sum of tones"
        what = f"it is {name}, 90 % of its power from {found.low_hz:.3g} to {found.high_hz:.3g} Hz"
        one = "A model of one scan rate (Eq. 11) is best identified on triangles or sines."
        if repeats:
            what += f", and repeats every {repeats:.4g} s"
            cure = f"Say `excitation_hz = {1.0 / repeats:.4g}`"
        else:
            what += f", and repeats nowhere in the {drive.time[-1]:.3g} s recorded"
            cure = 'Leave `excitation_hz` out and say `waveform = "other"`'
        kind = "broadband drive" if found.broadband and not repeats else "wrong period"
        return kind, f"{what}. {cure}. {one}"
    if repeats:
        rate = 1.0 / repeats
        return "wrong period", f"it repeats at about {rate:.3g} Hz. {_cure(rate, drive.rate)}"
    what = f"it swings at about {found.main_hz:.3g} Hz"
    if found.changing:
        low, high = found.swings
        what += f", by {low:.3g} to {high:.3g} in turn, and so does not repeat"
        right = abs(found.main_hz - drive.rate) < found.main_hz / 20.0
        rate = "" if right else f" and `excitation_hz = {found.main_hz:.3g}`"
        return "wrong period", f'{what}. Say `waveform = "other"`{rate}.'
    return "wrong period", f"{what}. {_cure(found.main_hz, drive.rate)}"


def describe_rate(drive: Drive, error: float) -> str:
    """What follows on "does not have the period of 10 Hz" where its rate is higher by a share."""
    rate = drive.rate * (1.0 + error)
    return f"it repeats at {rate:.4g} Hz. {_cure(rate, drive.rate)}"


def _cure(rate: float, said: float) -> str:
    if abs(abs(np.log10(rate / said)) - 3.0) < 0.1:
        return "That is a factor of 1000: `time_s` must be in s and `excitation_hz` in Hz."
    if said < rate < 1.2 * said:
        return (
            "Correct `excitation_hz`, or the clock of `time_s`: it seems slow where samples are "
            'missing. Or say `waveform = "other"`.'
        )
    return 'Correct `excitation_hz`, or say `waveform = "other"`.'
