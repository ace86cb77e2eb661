"""The gap drawn out: over phase, time since a turning point, optical frequency, session, harmonics.

All means are data less model, so they show what the model lacks. Bins without a reading are `None`;
no number that is not finite leaves this module.
"""

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from rapi_jax import Drive, Recording

from ._localisation import branches, scan_phase
from ._spectral_lines import find_harmonics, find_tones, list_lines

_PHASES = 40
_SINCE = 30
_NU = 40
_HARMONICS = 20
_POOLED = 4.0  # degrees of freedom that the run's other bins lend to one bin's scatter


def numbers(values: Iterable[Any]) -> list[float | None]:
    """Plain numbers; `None` for what is not finite."""
    return [float(v) if np.isfinite(v) else None for v in values]


def residual_profiles(
    errors: list[np.ndarray],
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
        errors = [_centred(e, b) for e, b in zip(errors, blocks, strict=True)]
    found = find_tones(errors, blocks, spectrum)
    lines = find_harmonics(errors, blocks, spectrum, found)
    names = [run.name for run in recording.runs]
    rows = [
        {
            "run": k,
            "excitation_hz": recording.runs[k].drive.excitation_hz,
            "harmonic": list(range(1, 1 + min(_HARMONICS, h.hertz.size))),
            "amplitude": numbers(h.amplitude[:_HARMONICS]),
            "floor": numbers(h.floor[:_HARMONICS]),
            "significant": [bool(x) for x in h.significant[:_HARMONICS]],
        }
        for k, h in enumerate(lines)
        if h is not None
    ]
    return {
        "phase": _phase(errors, blocks, spectrum, recording),
        "since_turn": _since_turn(errors, blocks, recording),
        "frequency": _frequency(errors, blocks, recording),
        "session": _session(errors, blocks),
        "harmonics": {"rows": rows},
        "lines": list_lines(found, lines, names),
    }


def _centred(error: np.ndarray, block: PeriodBlock) -> np.ndarray:
    mean = (error * block.use).sum() / max(block.use.sum(), 1.0)
    return (error - mean) * block.use


def _binned(place: np.ndarray, value: np.ndarray, use: np.ndarray, bins: int) -> np.ndarray:
    """Means of `value` by `place` (-1: none); NaN where there is none."""
    inside = (use > 0) & (place >= 0) & (place < bins)
    count = np.bincount(place[inside], minlength=bins)
    total = np.bincount(place[inside], weights=value[inside], minlength=bins)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _phase(
    errors: list[np.ndarray], blocks: list[PeriodBlock], spectrum: Spectrum, recording: Recording
) -> dict[str, Any]:
    rows = []
    for k, (error, block) in enumerate(zip(errors, blocks, strict=True)):
        run = recording.runs[k]
        phase = scan_phase(run.drive, block)
        place = np.minimum((phase * _PHASES + 1e-9).astype(int), _PHASES - 1)
        all_places = np.broadcast_to(place[None, :], error.shape)
        mean = _binned(all_places, -error, block.use, _PHASES)
        rows.append(
            {
                "run": k,
                "name": run.name,
                "excitation_hz": run.drive.excitation_hz,
                "amplitude": run.drive.u_pp,
                "mean": numbers(mean),
                "stderr": numbers(_stderr(place, error, block, spectrum)),
            }
        )
    return {"phase": numbers((np.arange(_PHASES) + 0.5) / _PHASES), "rows": rows}


def _stderr(
    place: np.ndarray, error: np.ndarray, block: PeriodBlock, spectrum: Spectrum
) -> np.ndarray:
    """Of a bin's mean: from the scatter of its periods, steadied by the scatter of all bins.

    With one period, from white noise: a lower edge.
    """
    count = block.periods
    if count == 1:
        number = np.bincount(place[block.use[0] > 0], minlength=_PHASES)
        return np.where(number > 0, np.sqrt(spectrum.white / np.maximum(number, 1)), np.nan)
    each = np.stack([_binned(place, e, u, _PHASES) for e, u in zip(error, block.use, strict=True)])
    good = np.isfinite(each)
    number = good.sum(axis=0)
    value = np.where(good, each, 0.0)
    mean = value.sum(axis=0) / np.maximum(number, 1)
    square = (good * (value - mean[None, :]) ** 2).sum(axis=0)
    free = np.maximum(number - 1, 0)
    pooled = square.sum() / max(free.sum(), 1)
    variance = (square + _POOLED * pooled) / (free + _POOLED)
    return np.where(number > 0, np.sqrt(variance / np.maximum(number, 1)), np.nan)


def _since_turn(
    errors: list[np.ndarray], blocks: list[PeriodBlock], recording: Recording
) -> dict[str, Any]:
    since, grouped = [], defaultdict(list)
    for k, (error, block) in enumerate(zip(errors, blocks, strict=True)):
        drive = recording.runs[k].drive
        up, seconds = _turned(drive, block)
        since.append(seconds)
        for turn, rising in (("low", True), ("high", False)):
            at = np.broadcast_to((up == rising)[None, :], error.shape)
            grouped[(turn, drive.excitation_hz)].append((seconds, -error, block.use * at))
    longest = max(float(s.max()) for s in since)
    shortest = min(max(min(b.step_s for b in blocks), longest * 1e-5), longest / 2)
    edges = np.geomspace(shortest, longest * (1 + 1e-9), _SINCE + 1)
    rows = []
    for (turn, hertz), parts in grouped.items():
        place = [
            np.broadcast_to(np.digitize(s, edges)[None, :] - 1, e.shape).ravel()
            for s, e, _ in parts
        ]
        value = [e.ravel() for _, e, _ in parts]
        use = [u.ravel() for _, _, u in parts]
        mean = _binned(np.concatenate(place), np.concatenate(value), np.concatenate(use), _SINCE)
        rows.append({"turn": turn, "excitation_hz": hertz, "mean": numbers(mean)})
    return {"seconds": numbers(np.sqrt(edges[1:] * edges[:-1])), "rows": rows}


def _turned(drive: Drive, block: PeriodBlock) -> tuple[np.ndarray, np.ndarray]:
    """Whether the drive rises, and the time since it last turned, s, at each column."""
    up, along = branches(drive, block)
    if block.repeats:
        low, high = drive._turning
        rise = float(np.mod(high - low, 1.0))
        seconds = along * np.where(up, rise, 1.0 - rise) / drive.rate
        return up, seconds
    column = np.arange(along.size)
    begins = np.concatenate([[True], (np.diff(along) < 0) | (up[1:] != up[:-1])])
    return up, (column - np.maximum.accumulate(np.where(begins, column, 0))) * block.step_s


def _frequency(
    errors: list[np.ndarray], blocks: list[PeriodBlock], recording: Recording
) -> dict[str, Any]:
    """Over the model's response, which the readings' noise does not move."""
    model = [e + b.data for e, b in zip(errors, blocks, strict=True)]
    seen = [m[b.use > 0] for m, b in zip(model, blocks, strict=True) if (b.use > 0).any()]
    low = min((float(m.min()) for m in seen), default=0.0)
    high = max((float(m.max()) for m in seen), default=1.0)
    width = max(high - low, 1e-300) / _NU
    rows = []
    for k, (error, block) in enumerate(zip(errors, blocks, strict=True)):
        up, _ = branches(recording.runs[k].drive, block)
        offset = np.where(block.use > 0, model[k] - low, 0.0)
        place = np.clip((offset / width).astype(int), 0, _NU - 1)
        for direction, rising in (("up", True), ("down", False)):
            at = np.broadcast_to((up == rising)[None, :], error.shape)
            mean = _binned(place, -error, block.use * at, _NU)
            rows.append({"run": k, "direction": direction, "mean": numbers(mean)})
    return {"nu": numbers(low + width * (np.arange(_NU) + 0.5)), "rows": rows}


def _session(errors: list[np.ndarray], blocks: list[PeriodBlock]) -> dict[str, Any]:
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
    return dict(zip(("time_s", "mean", "rms"), (numbers(c[order]) for c in columns), strict=True))
