r"""Harmonics of the scan that are errors of the model.

A harmonic is an error of the model where it stands above the lines beside it, which do not repeat
with the scan: `P |Ebar|^2 / s2 ~ F(2, 2m)` for noise of any colour, with `m` such lines.
"""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float
from scipy import stats

from fitting.diagnosis.noise._lines import SpectralLines, to_lines
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum

from ._sums_of_squares import fill_masked
from ._thresholds import THRESHOLDS
from ._tones import Tone

_TINY = 1e-300


@dataclasses.dataclass(frozen=True, eq=False)
class Harmonics:
    """The harmonics of one run, from the first on: amplitudes of the error, and of noise alone.

    `floor`: rms amplitude of noise. `significant`: at 1 % false ones among those named, over all
    runs.
    """

    hertz: Float[np.ndarray, " harmonics"]
    amplitude: Float[np.ndarray, " harmonics"]
    floor: Float[np.ndarray, " harmonics"]
    p_value: Float[np.ndarray, " harmonics"]
    significant: Bool[np.ndarray, " harmonics"]


def control_false_discoveries(p_value: Float[np.ndarray, " tests"]) -> Bool[np.ndarray, " tests"]:
    """Which of many tests are significant, few false ones among them (Benjamini, Hochberg 1995)."""
    if not p_value.size:
        return np.zeros(0, dtype=bool)
    return stats.false_discovery_control(p_value) <= THRESHOLDS.false_alarm_level


def find_harmonics(
    errors: list[Float[np.ndarray, "_ _"]],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    tones: list[Tone],
) -> list[Harmonics | None]:
    """Which harmonics of each run are model error; `None` for a run that does not repeat.

    `tones`: see `find_tones`; lines near them say nothing about the noise. With one period there is
    no noise to compare with: only what is 16 times the fastest lines is named.
    """
    found = [
        _harmonics(fill_masked(e, b), b, spectrum, tones) if b.repeats else None
        for e, b in zip(errors, blocks, strict=True)
    ]
    every = [h.p_value for h in found if h is not None]
    passed = control_false_discoveries(np.concatenate(every)) if every else np.zeros(0, dtype=bool)
    out: list[Harmonics | None] = []
    at = 0
    for h in found:
        if h is not None:
            here = passed[at : at + h.p_value.size]
            at += h.p_value.size
            h = dataclasses.replace(h, significant=here & h.significant)
        out.append(h)
    return out


def _harmonics(
    error: np.ndarray, block: PeriodBlock, spectrum: Spectrum, tones: list[Tone]
) -> Harmonics:
    lines = SpectralLines.of(block)
    power, level = np.abs(to_lines(error)) ** 2, spectrum.of_lines(lines)
    periods, size = block.periods, block.size
    at = np.arange(periods, (size - 1) // 2 + 1, periods)  # neither the mean nor Nyquist's
    if periods > 1:
        beside = ~lines.synchronous & (lines.multiplicity == 2)
        for tone in tones:
            beside &= np.abs(lines.hertz - tone.hz) > THRESHOLDS.tone_exclusion * lines.hertz[1]
        reach = THRESHOLDS.neighbouring_harmonics * periods
        count = np.concatenate([[0.0], np.cumsum(beside)])
        total = np.concatenate([[0.0], np.cumsum(beside * power / np.maximum(level, _TINY))])
        low, high = np.maximum(at - reach, 0), np.minimum(at + reach + 1, power.size)
        number = np.maximum(count[high] - count[low], 1.0)
        noise = level[at] * (total[high] - total[low]) / number
        clear = np.ones(at.size, dtype=bool)
    else:
        number, noise = np.full(at.size, THRESHOLDS.single_period_lines * size), level[at]
        clear = power[at] > THRESHOLDS.single_period_ratio * noise
    noise = np.maximum(noise, _TINY)
    p = (1.0 + power[at] / noise / number) ** -number  # of F(2, 2 number)
    scale = 2.0 / np.sqrt(size)
    return Harmonics(lines.hertz[at], scale * np.sqrt(power[at]), scale * np.sqrt(noise), p, clear)
