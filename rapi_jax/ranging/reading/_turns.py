"""When the laser turns, from the interferometer's fringes alone: they are irregular there."""

import dataclasses

import numpy as np

from rapi_jax._errors import DataError

from ._analytic import analytic_signal, band_pass, unwrapped_phase
from ._thresholds import THRESHOLDS
from ._transforms import usable_size
from ._turn_check import check_turns, fit_period, seen_turns


@dataclasses.dataclass(frozen=True, eq=False)
class Turns:
    """Turns of the laser within a record, in order.

    - `time_s`: s after the record's first sample; those just outside its ends are among them.
    - `rising`: whether the frequency rises after each.
    """

    time_s: np.ndarray
    rising: np.ndarray


def _irregularity(x: np.ndarray, hz: float, fringe_hz: float) -> tuple[np.ndarray, float]:
    """How far the phase after each half fringe is from that before it continued; 0 to 1.

    Also half fringes a second. At a turn the phase runs back on itself, which the unsigned phase of
    the fringes shows as a step of minus twice its value there; where the turn is rounded, the rate
    falls to zero. Steps are taken between straight lines over four fringes on either side.
    """
    x = x[: usable_size(x.size)]
    low, high = THRESHOLDS.band
    gain = band_pass(x.size, low / 4 * fringe_hz / hz, min(high * fringe_hz / hz, 0.49))
    phase = unwrapped_phase(analytic_signal((x - x.mean())[None, :], gain))[0]
    step = max(1, round(0.5 * hz / fringe_hz))
    p = phase[::step]
    near, far = 3, 11  # half fringes
    out = np.zeros(p.size)
    if p.size > 2 * far + 1:
        j = np.arange(far, p.size - far)
        left = p[j - near] + (p[j - near] - p[j - far]) * near / (far - near)
        right = p[j + near] - (p[j + far] - p[j + near]) * near / (far - near)
        jump = left - right
        out[j] = np.abs(jump - 2 * np.pi * np.rint(jump / (2 * np.pi))) / np.pi
    return out, hz / step


def _folded(irregular: np.ndarray, rate_hz: float, excitation_hz: float) -> np.ndarray:
    """The irregularity over one period: the largest in each bin, averaged over periods."""
    bins = min(THRESHOLDS.turn_bins, max(16, int(rate_hz / excitation_hz / 2)))
    time = (np.arange(irregular.size) + 0.5) / rate_hz
    place = np.floor(time * excitation_hz * bins).astype(int)
    largest = np.zeros(place[-1] + 1)
    np.maximum.at(largest, place, irregular)
    periods = max(1, largest.size // bins)
    whole = largest[: periods * bins] if largest.size >= bins else np.resize(largest, bins)
    return whole.reshape(periods, -1).mean(axis=0)


def find_phases(
    x: np.ndarray, hz: float, fringe_hz: float, excitation_hz: float, *, symmetric: bool
) -> tuple[float, float, float] | None:
    """Phases (0 to 1, of the period that begins with the record) of the two turns, and contrast.

    `symmetric`: the two are half a period apart. `None` where no two stand out.
    """
    irregular, rate = _irregularity(x, hz, fringe_hz)
    folded = _folded(irregular, rate, excitation_hz)
    bins = folded.size
    smooth = (folded + np.roll(folded, 1) + np.roll(folded, -1)) / 3
    usual = float(np.median(smooth))
    spread = 1.4826 * float(np.median(np.abs(smooth - usual))) + 1e-3
    first = int(np.argmax(smooth + np.roll(smooth, -(bins // 2)))) if symmetric else -1
    if symmetric:
        height = (smooth[first] + smooth[(first + bins // 2) % bins]) / 2
        half = np.roll(smooth, -first)
        pair = half[: bins // 2] + half[bins // 2 : 2 * (bins // 2)]
        shift = _centre(np.roll(pair, bins // 4), bins // 4)
        begin = (first + 0.5 + shift) / bins
        phases = begin % 1.0, (begin + 0.5) % 1.0
    else:
        first = int(np.argmax(smooth))
        far = np.abs((np.arange(bins) - first + bins / 2) % bins - bins / 2) > 0.03 * bins
        second = int(np.argmax(np.where(far, smooth, -1)))
        height = min(smooth[first], smooth[second])
        phases = tuple(
            ((at + 0.5 + _centre(np.roll(smooth, bins // 2 - at), bins // 2)) / bins) % 1.0
            for at in (first, second)
        )
    contrast = float((height - usual) / spread)
    if contrast <= THRESHOLDS.turn_contrast:
        return None
    return min(phases), max(phases), contrast


def _centre(value: np.ndarray, at: int) -> float:
    """Centre of the stretch above half the height around place `at`, less `at`."""
    reach = max(2, value.size // 40)
    low, high = max(0, at - reach), min(value.size, at + reach + 1)
    part = value[low:high] - 0.5 * value[at]
    part = np.maximum(part, 0.0)
    return float(part @ (np.arange(low, high) - at) / part.sum()) if part.sum() > 0 else 0.0


def drive_phases(drive: np.ndarray, hz: float, excitation_hz: float) -> tuple[float, float]:
    """Phases of a recorded drive's minimum and maximum."""
    place = np.floor(np.arange(drive.size) * (excitation_hz / hz) * 512).astype(int) % 512
    count = np.maximum(np.bincount(place, minlength=512), 1)
    mean = np.bincount(place, weights=drive, minlength=512) / count
    return (int(np.argmin(mean)) + 0.5) / 512, (int(np.argmax(mean)) + 0.5) / 512


def find_turns(
    x: np.ndarray,
    hz: float,
    fringe_hz: float,
    excitation_hz: float,
    *,
    symmetric: bool,
    rising_at_start: bool | None,
    drive: np.ndarray | None,
    name: str,
) -> tuple[Turns, list[str]]:
    """Turns of a record from its decimated interferometer `x` at `hz` samples a second.

    A drive, where recorded, says which turn is a minimum; else `rising_at_start`. A turn within
    0.3 % of a period of the record's first sample counts as its start.

    Raises `DataError` where the record holds less than a branch, no turn stands out, or the laser
    turns at another rate.
    """
    faults: list[str] = []
    length = x.size / hz
    if length * excitation_hz < 0.75:
        raise DataError(
            f"{name}: {length:.4g} s are {length * excitation_hz:.2g} periods of "
            f"{excitation_hz:g} Hz: record at least one whole period."
        )
    window = int(min(x.size, THRESHOLDS.turn_periods * hz / excitation_hz))
    begins = [0] if x.size < 2 * window else [0, x.size - window]
    found = []
    for begin in begins:
        part = find_phases(
            x[begin : begin + window], hz, fringe_hz, excitation_hz, symmetric=symmetric
        )
        if part is not None:
            found.append((begin / hz, part[:2]))
    if not found:
        raise DataError(
            f"{name}: no turns of the laser are seen at {excitation_hz:g} Hz: the fringes are as "
            "regular everywhere. Is `excitation_hz` right, and does the record hold a whole period?"
        )
    phases = np.array(found[0][1])
    drift = 0.0
    if len(found) > 1:
        at, later = found[1]
        expected = (phases - at * excitation_hz) % 1.0
        difference = (np.array(later)[:, None] - expected[None, :] + 0.5) % 1.0 - 0.5
        nearest = difference[np.arange(2), np.argmin(np.abs(difference), axis=1)]
        drift = float(np.mean(nearest)) / at if np.max(np.abs(nearest)) < 0.1 else 0.0
        if abs(drift) > 1e-3 * excitation_hz:
            faults.append(
                f"{name}: the scan runs at {excitation_hz - drift:.6g} Hz, not {excitation_hz:g}"
            )
    rate = excitation_hz - drift
    number = np.arange(-1, int(np.ceil(length * rate)) + 1)
    time = ((phases[:, None] + number[None, :]) / rate).ravel()
    side = np.repeat([0, 1], number.size)
    order = np.argsort(time)
    time, side = time[order], side[order]
    irregular, per_s = _irregularity(x[:window], hz, fringe_hz)
    seen = seen_turns(irregular, per_s, rate)
    which, at, doubts = check_turns(seen, time, excitation_hz, name)
    faults += doubts
    # Over several periods in one window a slightly wrong rate is seen and mended.
    if len(begins) == 1 and which.size >= 4 and np.unique(side[which]).size == 2:
        period = fit_period(time[which], at, side[which], rate)
        slow = 1.0 / period / excitation_hz - 1.0
        if abs(slow) > max(1e-3, THRESHOLDS.rate_off / (length * excitation_hz)):
            time = at[0] + (time - time[which[0]]) * period * rate
            rate = 1.0 / period
            faults.append(f"{name}: the scan runs at {rate:.4g} Hz, not {excitation_hz:g}")
    if drive is not None:
        low, _ = drive_phases(drive, hz, excitation_hz)
        distance = np.abs((phases - low + 0.5) % 1.0 - 0.5)
        minimum = int(np.argmin(distance))
    else:
        if rising_at_start is None:
            faults.append(
                f"{name}: nothing tells whether the frequency rises at its start; taken as rising. "
                "If it falls, up and down are exchanged and velocities have the other sign: add "
                "`rising_at_start`"
            )
            rising_at_start = True
        last = int(np.searchsorted(time, THRESHOLDS.at_start / excitation_hz, side="right")) - 1
        minimum = int(side[last]) if rising_at_start else 1 - int(side[last])
    keep = (time > -0.05 / rate) & (time < length + 0.05 / rate)
    return Turns(time[keep], side[keep] == minimum), faults
