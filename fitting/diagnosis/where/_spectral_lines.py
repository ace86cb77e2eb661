r"""Single lines of the errors: harmonics of the scan, and tones that do not follow it.

A harmonic is an error of the model where it stands above the lines beside it, which do not repeat
with the scan: `P |Ebar|^2 / s2 ~ F(2, 2m)` for noise of any colour, with `m` such lines. A tone is
looked for in all runs at once, between their lines too, since one run is short.
"""

import dataclasses

import numpy as np
from scipy import special

from fitting.diagnosis.noise._lines import SpectralLines, to_lines
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.noise._spectrum_fit import EXPONENTIAL_MEDIAN
from fitting.diagnosis.noise._thresholds import THRESHOLDS as NOISE

from ._gap import LEVEL, filled

_BESIDE = 3  # harmonics to either side whose loose lines judge one
_FINE = 6  # times the lines of the longest run: grid of the search for tones
_MOST = 8  # tones
_MOST_LOCKED = 20  # harmonics listed among the lines
_LEAST = 0.3  # of a tone's power that must be left once what repeats is taken out
_AROUND = 25  # lines to either side, for the local level of the noise
_ONE_PERIOD = 16.0  # times the white noise, where no period repeats
_TINY = 1e-300


@dataclasses.dataclass(frozen=True)
class Tone:
    """A line that does not follow the scan: rms-equal in all runs, phase free in each."""

    hz: float
    amplitude: float
    p_value: float  # over all frequencies searched


@dataclasses.dataclass(frozen=True, eq=False)
class Harmonics:
    """The harmonics of one run, from the first on: amplitudes of the error, and of noise alone."""

    hertz: np.ndarray
    amplitude: np.ndarray
    floor: np.ndarray  # amplitude that noise has, in the root mean square
    p_value: np.ndarray
    significant: np.ndarray  # at 1 % false ones among those named, over all runs


def benjamini_hochberg(p_value: np.ndarray, level: float = LEVEL) -> np.ndarray:
    """Which of many tests stand, with at most a share `level` of false ones among them."""
    if not p_value.size:
        return np.zeros(0, dtype=bool)
    rank = np.sort(p_value)
    below = np.flatnonzero(rank <= level * np.arange(1, rank.size + 1) / rank.size)
    return p_value <= (rank[below[-1]] if below.size else -1.0)


def find_harmonics(
    errors: list[np.ndarray], blocks: list[PeriodBlock], spectrum: Spectrum, tones: list[Tone]
) -> list[Harmonics | None]:
    """Which harmonics of each run are model error; `None` for a run that does not repeat.

    `tones`: as found by `tones`; lines they stand on say nothing about the noise beside. With one
    period there is no noise to compare with: only what is 16 times the fastest lines is named.
    """
    found = [
        _harmonics(filled(e, b), b, spectrum, tones) if b.repeats else None
        for e, b in zip(errors, blocks, strict=True)
    ]
    every = [h.p_value for h in found if h is not None]
    stand = benjamini_hochberg(np.concatenate(every)) if every else np.zeros(0, dtype=bool)
    out: list[Harmonics | None] = []
    at = 0
    for h in found:
        if h is not None:
            here = stand[at : at + h.p_value.size]
            at += h.p_value.size
            h = dataclasses.replace(h, significant=here & h.significant)
        out.append(h)
    return out


def _harmonics(
    error: np.ndarray, block: PeriodBlock, spectrum: Spectrum, tones: list[Tone]
) -> Harmonics:
    lines = SpectralLines.of(block)
    power, level = np.abs(to_lines(error)) ** 2, spectrum.variance(lines.hertz, lines.step_s)
    periods, size = block.periods, block.size
    at = np.arange(periods, (size - 1) // 2 + 1, periods)  # neither the mean nor Nyquist's
    if periods > 1:
        judge = ~lines.synchronous & (lines.multiplicity == 2)
        for tone in tones:
            judge &= np.abs(lines.hertz - tone.hz) > 1.5 * lines.hertz[1]
        reach = _BESIDE * periods
        count = np.concatenate([[0.0], np.cumsum(judge)])
        total = np.concatenate([[0.0], np.cumsum(judge * power / np.maximum(level, _TINY))])
        low, high = np.maximum(at - reach, 0), np.minimum(at + reach + 1, power.size)
        number = np.maximum(count[high] - count[low], 1.0)
        noise = level[at] * (total[high] - total[low]) / number
        sure = np.ones(at.size, dtype=bool)
    else:
        number, noise = np.full(at.size, 0.4 * size), level[at]
        sure = power[at] > _ONE_PERIOD * noise
    noise = np.maximum(noise, _TINY)
    p = (1.0 + power[at] / noise / number) ** -number  # of F(2, 2 number)
    scale = 2.0 / np.sqrt(size)
    return Harmonics(lines.hertz[at], scale * np.sqrt(power[at]), scale * np.sqrt(noise), p, sure)


@dataclasses.dataclass(frozen=True, eq=False)
class _Search:
    """One run's part in the search: how strong a tone of each frequency is beside its noise."""

    seconds: float
    length: int  # of the padded transform
    place: np.ndarray  # in it, of each frequency of the grid
    left: np.ndarray  # share of a tone's power that does not repeat with the scan; 0: not looked at
    level: np.ndarray  # of noise, as the spectrum has it
    weight: np.ndarray  # of a tone's squared amplitude in `z`
    z: np.ndarray  # exponential with mean 1 where there is noise alone


def _search(error: np.ndarray, block: PeriodBlock, spectrum: Spectrum, grid: np.ndarray) -> _Search:
    periods, phases = error.shape
    seconds = error.size * block.step_s
    length = 1 << int(np.ceil(np.log2(8 * error.size)))
    place = np.round(grid * length * block.step_s).astype(int)
    cycles = grid * phases * block.step_s
    with np.errstate(invalid="ignore", divide="ignore"):
        comb = np.sin(np.pi * cycles * periods) / (periods * np.sin(np.pi * cycles))
    left = 1.0 - np.where(np.isfinite(comb), comb, 1.0) ** 2
    slow, fast = NOISE.slowest_line / seconds, 0.5 / block.step_s - 2.0 / seconds
    left = np.where((grid >= slow) & (grid <= fast) & (left > _LEAST), left, 0.0)
    level = np.maximum(spectrum.variance(grid, block.step_s), _TINY)
    place = np.minimum(place, length // 2)
    empty = _Search(seconds, length, place, left, level, left, left)
    return _seen(empty, error, block, spectrum, grid)


def _seen(
    search: _Search, error: np.ndarray, block: PeriodBlock, spectrum: Spectrum, grid: np.ndarray
) -> _Search:
    rest = (error - error.mean(axis=0)[None, :]).ravel()
    size, left = rest.size, search.left
    power = np.abs(np.fft.rfft(rest, search.length)[search.place]) ** 2 / size
    # Where the spectrum's form falls short of the noise, the level all around counts.
    hertz = np.fft.rfftfreq(size, block.step_s)
    level = np.maximum(spectrum.variance(hertz, block.step_s), _TINY)
    own = np.abs(np.fft.rfft(rest)) ** 2 / size / level
    here = _around(own[np.arange(own.size) % block.periods != 0])
    excess = np.maximum(np.interp(grid, np.linspace(0.0, hertz[-1], here.size), here), 1.0)
    z = np.where(left > 0, power / (search.level * excess * np.where(left > 0, left, 1.0)), 0.0)
    weight = left * size / (4.0 * search.level * excess)
    return dataclasses.replace(search, weight=weight, z=z)


def _around(power: np.ndarray) -> np.ndarray:
    """The level about each line, from the median of blocks of lines."""
    blocks = max(power.size // (2 * _AROUND), 1)
    edges = np.linspace(0, power.size, blocks + 1).astype(int)
    level = [
        np.median(power[a:b]) / EXPONENTIAL_MEDIAN
        for a, b in zip(edges[:-1], edges[1:], strict=True)
    ]
    middle = (edges[:-1] + edges[1:] - 1) / 2.0
    return np.interp(np.arange(power.size), middle, np.array(level))


def find_tones(
    errors: list[np.ndarray], blocks: list[PeriodBlock], spectrum: Spectrum
) -> list[Tone]:
    """Tones in what does not repeat with the scan, strongest first.

    Runs of one period are left out. Power over noise is added up over all runs on a common fine
    grid, so a tone may lie between lines, and on a harmonic of some of the runs. Phases are free in
    each run: no clock needs to hold over the session. The p-value is that of the highest peak of
    the whole search, by Rice's formula for upcrossings of a chi-square process (Baluev 2008, for
    one run). A tone is fitted and taken out before the next is looked for.
    """
    chosen = [(filled(e, b), b) for e, b in zip(errors, blocks, strict=True) if b.periods > 1]
    found: list[Tone] = []
    if not chosen or not spectrum.measured:
        return found
    rests = [e for e, _ in chosen]
    used = [b for _, b in chosen]
    longest = max(b.size * b.step_s for b in used)
    top = max(0.5 / b.step_s for b in used)
    grid = np.arange(1, int(top * longest * _FINE)) / (longest * _FINE)
    parts = [_search(e, b, spectrum, grid) for e, b in zip(rests, used, strict=True)]
    for _ in range(_MOST):
        tone = _highest(parts, grid)
        if tone is None or tone.p_value > LEVEL:
            break
        tone = _closer(rests, used, parts, grid, tone)
        found.append(tone)
        for k, (rest, block) in enumerate(zip(rests, used, strict=True)):
            if tone.hz < 0.5 / block.step_s:
                rests[k] = _without(rest, block, tone.hz)
                parts[k] = _seen(parts[k], rests[k], block, spectrum, grid)
    return found


def remove_tones(
    errors: list[np.ndarray], blocks: list[PeriodBlock], tones: list[Tone]
) -> list[np.ndarray]:
    """The errors less the tones: their leakage raises the noise that is measured beside them."""
    out = [filled(e, b) for e, b in zip(errors, blocks, strict=True)]
    for tone in tones:
        for k, b in enumerate(blocks):
            if b.periods > 1 and tone.hz < 0.5 / b.step_s:
                out[k] = _without(out[k], b, tone.hz)
    return [e * b.use for e, b in zip(out, blocks, strict=True)]


def _highest(parts: list[_Search], grid: np.ndarray) -> Tone | None:
    runs = np.sum([p.left > 0 for p in parts], axis=0).astype(float)
    total = np.sum([p.z for p in parts], axis=0)
    # Of frequencies in as many runs the highest sum is the least likely: few chances to work out.
    best = [(int(r), _top(np.where(runs == r, total, -1.0))) for r in np.unique(runs[runs > 0])]
    if not best:
        return None
    # The chance underflows for strong tones: rank by the sum's size then.
    at = max((_surprise(r, float(total[i])), i) for r, i in best)[1]
    r, z = float(runs[at]), float(total[at])
    band = float((runs > 0).sum()) * float(grid[1] - grid[0])
    width = np.sqrt(np.mean([p.seconds**2 for p in parts if p.left[at] > 0]))
    # Upcrossings of half a chi-square process with 2r degrees of freedom, a hertz.
    log_rate = (r - 0.5) * np.log(max(z, _TINY)) - z - special.gammaln(r)
    p = band * float(np.sqrt(np.pi / 3.0) * width) * float(np.exp(min(log_rate, 50.0)))
    p += float(special.gammaincc(r, z))
    weight = sum(float(part.weight[at]) for part in parts)
    square = (z - r) / max(weight, _TINY)
    return Tone(float(grid[at]), float(np.sqrt(max(square, 0.0))), float(min(p, 1.0)))


def _top(values: np.ndarray) -> int:
    return int(np.argmax(values))


def _surprise(runs: int, total: float) -> float:
    """Minus the logarithm of the chance that noise alone in so many runs adds up to `total`."""
    chance = float(special.gammaincc(runs, total))
    return -np.log(chance) if chance > 1e-290 else 660.0 + total


def _closer(
    rests: list[np.ndarray],
    blocks: list[PeriodBlock],
    parts: list[_Search],
    grid: np.ndarray,
    tone: Tone,
) -> Tone:
    """The peak between points of the grid; an error of a tenth of a line would leave a residue."""
    step = float(grid[1] - grid[0])
    near = tone.hz + step * np.linspace(-1.0, 1.0, 9)
    at = int(np.argmin(np.abs(grid - tone.hz)))
    total, weight, runs = np.zeros(near.size), 0.0, 0
    for rest, block, part in zip(rests, blocks, parts, strict=True):
        if part.left[at] > 0:
            nonsynchronous = rest - rest.mean(axis=0)[None, :]
            angle = -2j * np.pi * block.step_s * near[:, None]
            within = np.exp(angle * np.arange(nonsynchronous.shape[1])[None, :])
            across = np.exp(
                angle * nonsynchronous.shape[1] * np.arange(nonsynchronous.shape[0])[None, :]
            )
            line = ((across @ nonsynchronous) * within).sum(axis=1)
            scale = 4.0 * part.weight[at] / (part.left[at] * nonsynchronous.size) ** 2
            total += scale * np.abs(line) ** 2
            weight, runs = weight + float(part.weight[at]), runs + 1
    i = int(np.clip(np.argmax(total), 1, near.size - 2))
    before, here, after = total[i - 1 : i + 2]
    bend = before - 2 * here + after
    move = float(np.clip((before - after) / (2 * bend), -1.0, 1.0)) if bend < 0 else 0.0
    square = (float(here - 0.25 * (before - after) * move) - runs) / max(weight, _TINY)
    hertz = float(near[i] + move * (near[1] - near[0]))
    return Tone(hertz, float(np.sqrt(max(square, 0.0))), tone.p_value)


def _without(error: np.ndarray, block: PeriodBlock, hertz: float) -> np.ndarray:
    """The error less the sine of that frequency that fits best what does not repeat."""
    angle = 2 * np.pi * hertz * block.step_s * np.arange(error.size).reshape(error.shape)
    waves = np.stack([np.cos(angle), np.sin(angle)])
    nonsynchronous = waves - waves.mean(axis=1)[:, None, :]
    flat = nonsynchronous.reshape(2, -1)
    found = np.linalg.lstsq(flat.T, error.ravel(), rcond=1e-6)[0]
    return error - (found @ flat).reshape(error.shape)


def list_lines(
    tones_: list[Tone], harmonics_: list[Harmonics | None], names: list[str]
) -> list[dict[str, object]]:
    """All lines found, as in `maps`: tones first, then the strongest harmonics of the runs."""
    out: list[dict[str, object]] = [
        {"hz": t.hz, "amplitude": t.amplitude, "p_value": t.p_value, "locked": False}
        for t in tones_
    ]
    synchronous = []
    for name, h in zip(names, harmonics_, strict=True):
        if h is not None:
            for i in np.flatnonzero(h.significant):
                synchronous.append(
                    {
                        "hz": float(h.hertz[i]),
                        "amplitude": float(h.amplitude[i]),
                        "p_value": float(h.p_value[i]),
                        "locked": True,
                        "run": name,
                    }
                )
    synchronous.sort(key=lambda line: -line["amplitude"])
    return out + synchronous[:_MOST_LOCKED]
