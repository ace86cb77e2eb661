"""Tones: single lines of the errors that do not follow the scan.

A tone is looked for in all runs at once, between their lines too, since one run is short.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy import special

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum

from ._sums_of_squares import fill_masked
from ._thresholds import THRESHOLDS
from ._tone_periodogram import Periodogram, measure_again, periodogram

_TINY = 1e-300


@dataclasses.dataclass(frozen=True)
class Tone:
    """A line that does not follow the scan: of one amplitude in all runs, with a phase in each.

    `p_value`: over all frequencies searched.
    """

    hz: float
    amplitude: float
    p_value: float


def find_tones(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock], spectrum: Spectrum
) -> list[Tone]:
    """Tones in what does not repeat with the scan, strongest first.

    Runs of one period are left out. Power over noise is added up over all runs on a common fine
    grid, so a tone may lie between lines, and on a harmonic of some of the runs. Phases are free in
    each run: no clock needs to hold over the session. The p-value is that of the highest peak of
    the whole search, by Rice's formula for upcrossings of a chi-square process (Baluev 2008, for
    one run). A tone is fitted and taken out before the next is looked for.
    """
    chosen = [(fill_masked(e, b), b) for e, b in zip(errors, blocks, strict=True) if b.periods > 1]
    found: list[Tone] = []
    if not chosen or not spectrum.measured:
        return found
    rests = [e for e, _ in chosen]
    used = [b for _, b in chosen]
    longest = max(b.size * b.step_s for b in used)
    top = max(0.5 / b.step_s for b in used)
    density = THRESHOLDS.tone_grid_density
    grid = np.arange(1, int(top * longest * density)) / (longest * density)
    parts = [periodogram(e, b, spectrum, grid) for e, b in zip(rests, used, strict=True)]
    for _ in range(THRESHOLDS.most_tones):
        tone = _strongest_tone(parts, grid)
        if tone is None or tone.p_value > THRESHOLDS.false_alarm_level:
            break
        tone = _interpolate_peak(rests, used, parts, grid, tone)
        found.append(tone)
        for k, (rest, block) in enumerate(zip(rests, used, strict=True)):
            if tone.hz < 0.5 / block.step_s:
                rests[k] = _subtract_sine(rest, block, tone.hz)
                parts[k] = measure_again(parts[k], rests[k], block, spectrum, grid)
    return found


def remove_tones(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock], tones: list[Tone]
) -> list[Float[np.ndarray, "_ _"]]:
    """The errors less the tones: their leakage raises the noise that is measured beside them."""
    out = [fill_masked(e, b) for e, b in zip(errors, blocks, strict=True)]
    for tone in tones:
        for k, b in enumerate(blocks):
            if b.periods > 1 and tone.hz < 0.5 / b.step_s:
                out[k] = _subtract_sine(out[k], b, tone.hz)
    return [e * b.use for e, b in zip(out, blocks, strict=True)]


def _strongest_tone(parts: list[Periodogram], grid: np.ndarray) -> Tone | None:
    """The least likely point of the grid, with the chance of noise alone over the whole search."""
    runs = np.sum([p.kept > 0 for p in parts], axis=0).astype(float)
    total = np.sum([p.z for p in parts], axis=0)
    # Of frequencies in as many runs the highest sum is the least likely: few chances to work out.
    counts = np.unique(runs[runs > 0])
    best = [(int(r), int(np.argmax(np.where(runs == r, total, -1.0)))) for r in counts]
    if not best:
        return None
    at = max((_minus_log_chance(r, float(total[i])), i) for r, i in best)[1]
    r, z = float(runs[at]), float(total[at])
    band = float((runs > 0).sum()) * float(grid[1] - grid[0])
    width = np.sqrt(np.mean([p.seconds**2 for p in parts if p.kept[at] > 0]))
    # Upcrossings of half a chi-square process with 2r degrees of freedom, a hertz.
    log_rate = (r - 0.5) * np.log(max(z, _TINY)) - z - special.gammaln(r)
    p = band * float(np.sqrt(np.pi / 3.0) * width) * float(np.exp(min(log_rate, 50.0)))
    p += float(special.gammaincc(r, z))
    weight = sum(float(part.weight[at]) for part in parts)
    square = (z - r) / max(weight, _TINY)
    return Tone(float(grid[at]), float(np.sqrt(max(square, 0.0))), float(min(p, 1.0)))


def _minus_log_chance(runs: int, total: float) -> float:
    """Minus the logarithm of the chance that noise alone in so many runs adds up to `total`.

    The chance underflows for strong tones: then they are ranked by the sum's size.
    """
    chance = float(special.gammaincc(runs, total))
    return -np.log(chance) if chance > 1e-290 else 660.0 + total


def _interpolate_peak(
    rests: list[np.ndarray],
    blocks: list[PeriodBlock],
    parts: list[Periodogram],
    grid: np.ndarray,
    tone: Tone,
) -> Tone:
    """The peak between points of the grid; an error of a tenth of a line would leave a residue."""
    step = float(grid[1] - grid[0])
    near = tone.hz + step * np.linspace(-1.0, 1.0, 9)
    at = int(np.argmin(np.abs(grid - tone.hz)))
    total, weight, runs = np.zeros(near.size), 0.0, 0
    for rest, block, part in zip(rests, blocks, parts, strict=True):
        if part.kept[at] > 0:
            nonsynchronous = rest - rest.mean(axis=0)[None, :]
            angle = -2j * np.pi * block.step_s * near[:, None]
            within = np.exp(angle * np.arange(nonsynchronous.shape[1])[None, :])
            across = np.exp(
                angle * nonsynchronous.shape[1] * np.arange(nonsynchronous.shape[0])[None, :]
            )
            line = ((across @ nonsynchronous) * within).sum(axis=1)
            scale = 4.0 * part.weight[at] / (part.kept[at] * nonsynchronous.size) ** 2
            total += scale * np.abs(line) ** 2
            weight, runs = weight + float(part.weight[at]), runs + 1
    i = int(np.clip(np.argmax(total), 1, near.size - 2))
    before, here, after = total[i - 1 : i + 2]
    curvature = before - 2 * here + after
    move = float(np.clip((before - after) / (2 * curvature), -1.0, 1.0)) if curvature < 0 else 0.0
    square = (float(here - 0.25 * (before - after) * move) - runs) / max(weight, _TINY)
    hertz = float(near[i] + move * (near[1] - near[0]))
    return Tone(hertz, float(np.sqrt(max(square, 0.0))), tone.p_value)


def _subtract_sine(error: np.ndarray, block: PeriodBlock, hertz: float) -> np.ndarray:
    """The error less the sine of that frequency that fits best what does not repeat."""
    angle = 2 * np.pi * hertz * block.step_s * np.arange(error.size).reshape(error.shape)
    waves = np.stack([np.cos(angle), np.sin(angle)])
    nonsynchronous = waves - waves.mean(axis=1)[:, None, :]
    flat = nonsynchronous.reshape(2, -1)
    found = np.linalg.lstsq(flat.T, error.ravel(), rcond=1e-6)[0]
    return error - (found @ flat).reshape(error.shape)
