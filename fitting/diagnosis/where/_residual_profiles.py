"""Mean errors by phase, time since a turning point, optical frequency, session time, harmonic.

All means are data less model, so they show what the model lacks. Bins without a reading are `None`;
no number that is not finite leaves this module.
"""

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from rapi_jax import Drive, Recording

from ._branches import branches, scan_phase
from ._harmonics import find_harmonics
from ._spectral_lines import list_lines
from ._thresholds import THRESHOLDS
from ._tones import find_tones

# Bins and lines of the pictures.
_PHASE_BINS = 40
_TIME_BINS = 30
_FREQUENCY_BINS = 40
_HARMONICS = 20


def to_numbers(values: Iterable[Any]) -> list[float | None]:
    """Plain numbers; `None` for what is not finite."""
    return [float(v) if np.isfinite(v) else None for v in values]


def residual_profiles(
    errors: list[Float[np.ndarray, "_ _"]],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    recording: Recording,
    *,
    own_origin: bool = False,
) -> dict[str, Any]:
    """The part `maps` of a diagnosis, from errors ("periods phases" a run, model less data).

    `own_origin`: the runs have a zero each, so their means are left out.
    """
    if own_origin:
        errors = [remove_mean(e, b) for e, b in zip(errors, blocks, strict=True)]
    found = find_tones(errors, blocks, spectrum)
    lines = find_harmonics(errors, blocks, spectrum, found)
    names = [run.name for run in recording.runs]
    rows = [
        {
            "run": k,
            "excitation_hz": recording.runs[k].drive.excitation_hz,
            "harmonic": list(range(1, 1 + min(_HARMONICS, h.hertz.size))),
            "amplitude": to_numbers(h.amplitude[:_HARMONICS]),
            "floor": to_numbers(h.floor[:_HARMONICS]),
            "significant": [bool(x) for x in h.significant[:_HARMONICS]],
        }
        for k, h in enumerate(lines)
        if h is not None
    ]
    return {
        "phase": _profile_by_phase(errors, blocks, spectrum, recording),
        "since_turn": _profile_since_turn(errors, blocks, recording),
        "frequency": _profile_by_frequency(errors, blocks, recording),
        "session": _profile_by_period(errors, blocks),
        "harmonics": {"rows": rows},
        "lines": list_lines(found, lines, names),
    }


def remove_mean(error: np.ndarray, block: PeriodBlock) -> np.ndarray:
    """Errors of a run ("periods phases") about their mean; 0 where no reading is in use."""
    mean = (error * block.use).sum() / max(block.use.sum(), 1.0)
    return (error - mean) * block.use


def remove_origin(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock], *, own_origin: bool
) -> list[Float[np.ndarray, "_ _"]]:
    """Errors less the origin of the response, which no model foretells: of all runs, or of each.

    Slow noise hides it, so a fit may leave any. `own_origin`: the runs have a zero each.
    """
    if own_origin:
        return [remove_mean(e, b) for e, b in zip(errors, blocks, strict=True)]
    used = sum(float(b.use.sum()) for b in blocks)
    total = sum(float((e * b.use).sum()) for e, b in zip(errors, blocks, strict=True))
    return [(e - total / max(used, 1.0)) * b.use for e, b in zip(errors, blocks, strict=True)]


def _bin_means(place: np.ndarray, value: np.ndarray, use: np.ndarray, bins: int) -> np.ndarray:
    """Means of `value` in bins `place` (-1: in none); NaN for a bin without values."""
    inside = (use > 0) & (place >= 0) & (place < bins)
    count = np.bincount(place[inside], minlength=bins)
    total = np.bincount(place[inside], weights=value[inside], minlength=bins)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _profile_by_phase(
    errors: list[Float[np.ndarray, "_ _"]],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    recording: Recording,
) -> dict[str, Any]:
    rows = []
    for k, (error, block) in enumerate(zip(errors, blocks, strict=True)):
        run = recording.runs[k]
        phase = scan_phase(run.drive, block)
        place = np.minimum((phase * _PHASE_BINS + 1e-9).astype(int), _PHASE_BINS - 1)
        all_places = np.broadcast_to(place[None, :], error.shape)
        mean = _bin_means(all_places, -error, block.use, _PHASE_BINS)
        rows.append(
            {
                "run": k,
                "name": run.name,
                "excitation_hz": run.drive.excitation_hz,
                "amplitude": run.drive.u_pp,
                "mean": to_numbers(mean),
                "stderr": to_numbers(_standard_errors(place, error, block, spectrum)),
            }
        )
    return {"phase": to_numbers((np.arange(_PHASE_BINS) + 0.5) / _PHASE_BINS), "rows": rows}


def _standard_errors(
    place: np.ndarray, error: np.ndarray, block: PeriodBlock, spectrum: Spectrum
) -> np.ndarray:
    """Of the mean of each bin, from the scatter of its periods pooled with that of all bins.

    With one period, from white noise: a lower bound.
    """
    count = block.periods
    if count == 1:
        number = np.bincount(place[block.use[0] > 0], minlength=_PHASE_BINS)
        return np.where(number > 0, np.sqrt(spectrum.white / np.maximum(number, 1)), np.nan)
    each = np.stack(
        [_bin_means(place, e, u, _PHASE_BINS) for e, u in zip(error, block.use, strict=True)]
    )
    good = np.isfinite(each)
    number = good.sum(axis=0)
    value = np.where(good, each, 0.0)
    mean = value.sum(axis=0) / np.maximum(number, 1)
    square = (good * (value - mean[None, :]) ** 2).sum(axis=0)
    free = np.maximum(number - 1, 0)
    pooled = square.sum() / max(free.sum(), 1)
    variance = (square + THRESHOLDS.pooled_freedom * pooled) / (free + THRESHOLDS.pooled_freedom)
    return np.where(number > 0, np.sqrt(variance / np.maximum(number, 1)), np.nan)


def _profile_since_turn(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock], recording: Recording
) -> dict[str, Any]:
    since, grouped = [], defaultdict(list)
    for k, (error, block) in enumerate(zip(errors, blocks, strict=True)):
        drive = recording.runs[k].drive
        up, seconds = time_since_turn(drive, block)
        since.append(seconds)
        for turn, rising in (("low", True), ("high", False)):
            at = np.broadcast_to((up == rising)[None, :], error.shape)
            grouped[(turn, drive.excitation_hz)].append((seconds, -error, block.use * at))
    edges = since_turn_edges(since, blocks)
    rows = []
    for (turn, hertz), parts in grouped.items():
        place = [
            np.broadcast_to(np.digitize(s, edges)[None, :] - 1, e.shape).ravel()
            for s, e, _ in parts
        ]
        value = [e.ravel() for _, e, _ in parts]
        use = [u.ravel() for _, _, u in parts]
        mean = _bin_means(
            np.concatenate(place), np.concatenate(value), np.concatenate(use), _TIME_BINS
        )
        rows.append({"turn": turn, "excitation_hz": hertz, "mean": to_numbers(mean)})
    return {"seconds": to_numbers(np.sqrt(edges[1:] * edges[:-1])), "rows": rows}


def since_turn_edges(since: list[np.ndarray], blocks: list[PeriodBlock]) -> np.ndarray:
    """Edges of bins that grow with the time since a turn (`since`, s, one row per run)."""
    longest = max(float(s.max()) for s in since)
    shortest = min(max(min(b.step_s for b in blocks), longest * 1e-5), longest / 2)
    return np.geomspace(shortest, longest * (1 + 1e-9), _TIME_BINS + 1)


def time_since_turn(drive: Drive, block: PeriodBlock) -> tuple[np.ndarray, np.ndarray]:
    """Whether the drive rises, and the time since it last turned, s, at each phase."""
    up, along = branches(drive, block)
    if block.repeats:
        low, high = drive._turning
        rise = float(np.mod(high - low, 1.0))
        seconds = along * np.where(up, rise, 1.0 - rise) / drive.rate
        return up, seconds
    column = np.arange(along.size)
    begins = np.concatenate([[True], (np.diff(along) < 0) | (up[1:] != up[:-1])])
    return up, (column - np.maximum.accumulate(np.where(begins, column, 0))) * block.step_s


def _profile_by_frequency(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock], recording: Recording
) -> dict[str, Any]:
    """By the model's response, which has no noise of readings."""
    model = [e + b.data for e, b in zip(errors, blocks, strict=True)]
    seen = [m[b.use > 0] for m, b in zip(model, blocks, strict=True) if (b.use > 0).any()]
    low = min((float(m.min()) for m in seen), default=0.0)
    high = max((float(m.max()) for m in seen), default=1.0)
    width = max(high - low, 1e-300) / _FREQUENCY_BINS
    rows = []
    for k, (error, block) in enumerate(zip(errors, blocks, strict=True)):
        up, _ = branches(recording.runs[k].drive, block)
        offset = np.where(block.use > 0, model[k] - low, 0.0)
        place = np.clip((offset / width).astype(int), 0, _FREQUENCY_BINS - 1)
        for direction, rising in (("up", True), ("down", False)):
            at = np.broadcast_to((up == rising)[None, :], error.shape)
            mean = _bin_means(place, -error, block.use * at, _FREQUENCY_BINS)
            rows.append({"run": k, "direction": direction, "mean": to_numbers(mean)})
    return {"nu": to_numbers(low + width * (np.arange(_FREQUENCY_BINS) + 0.5)), "rows": rows}


def _profile_by_period(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock]
) -> dict[str, Any]:
    """Mean and root mean square of each period, in order of time."""
    time, mean, rms = [], [], []
    for error, block in zip(errors, blocks, strict=True):
        count = block.use.sum(axis=1)
        some = np.where(count > 0, count, np.nan)
        time.append(block.time.mean(axis=1))
        mean.append(-(error * block.use).sum(axis=1) / some)
        rms.append(np.sqrt((block.use * error**2).sum(axis=1) / some))
    t = np.concatenate(time)
    order = np.argsort(t, kind="stable")
    columns = (t, np.concatenate(mean), np.concatenate(rms))
    return dict(
        zip(("time_s", "mean", "rms"), (to_numbers(c[order]) for c in columns), strict=True)
    )
