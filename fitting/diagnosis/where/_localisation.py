"""Where the gap lies: by run, by direction of the drive, at turning points or between them."""

import dataclasses
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from rapi_jax import Drive, Recording
from rapi_jax.internal import branch_fraction

from ._gap import Gap, Sums, measure_gap, sums

EDGE = 0.1  # of a branch, at either end
_NEAR = 0.015  # of a period
_TOLD = 0.15  # by which a part's share of the gap must exceed its share of the readings to be named
_MOST = 0.4  # of the gap that a part must hold to be named
_WORD = 0.05  # by which a further word must raise the information, in nats
_SAME = 0.02  # of an amplitude


def branches(drive: Drive, block: PeriodBlock) -> tuple[np.ndarray, np.ndarray]:
    """Whether each column of a block is on a rising branch, and how far along it (0 to 1)."""
    if not block.repeats:  # the phase of a free drive is along its branches
        up = block.phase < 0.5
        return up, np.clip(2.0 * np.mod(block.phase, 0.5), 0.0, 1.0)
    low, high = drive._turning
    return branch_fraction(scan_phase(drive, block), 0.0, float(np.mod(high - low, 1.0)))


def scan_phase(drive: Drive, block: PeriodBlock) -> np.ndarray:
    """Phase of each column since the drive's minimum, also where periods begin elsewhere."""
    if not block.repeats:
        return block.phase
    first = int(np.flatnonzero(drive.period >= 0)[0])
    begin = float(drive.phase[first])
    # Turning points are known to a bin; periods that begin that near to the minimum begin with it.
    return block.phase if min(begin, 1.0 - begin) < _NEAR else np.mod(block.phase + begin, 1.0)


@dataclasses.dataclass(frozen=True)
class Cell:
    """One part of one run. `locked`, `whole`: its part of the recording's mean squares, signed."""

    run: int
    up: bool
    edge: bool
    readings: float
    synchronous2: float  # per reading of the cell, above noise, what repeats with the scan
    nonsynchronous2: float  # the same of what does not
    synchronous: float
    whole: float


def cells(
    errors: list[np.ndarray],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    recording: Recording,
    *,
    own_origin: bool = False,
    fitted: int = 0,
) -> list[Cell]:
    """All parts of all runs; `locked` and `whole` sum to those of `gap`."""
    parts = sums(errors, blocks, spectrum, own_origin=own_origin, fitted=fitted)
    free = sum(p.free for p in parts)
    return list(_cells(parts, blocks, recording, free))


def _cells(
    parts: Sequence[Sums], blocks: Sequence[PeriodBlock], recording: Recording, free: float
) -> Iterator[Cell]:
    for k, (part, block) in enumerate(zip(parts, blocks, strict=True)):
        up, along = branches(recording.runs[k].drive, block)
        edge = (along <= EDGE) | (along >= 1.0 - EDGE)
        noise = _noise_of_mean(part)
        for rising in (True, False):
            for at_edge in (True, False):
                here = (up == rising) & (edge == at_edge)
                readings = float(part.count[here].sum())
                if readings == 0:
                    continue
                a = float(part.count[here] @ part.mean[here] ** 2)
                b = float(part.spread[here].sum())
                floor = part.noise * readings * part.free / part.readings
                whole = a + b - floor
                synchronous = a - float(noise[here].sum()) if part.readings > part.phases else whole
                yield Cell(
                    k,
                    rising,
                    at_edge,
                    readings,
                    synchronous / readings,
                    (whole - synchronous) / readings,
                    synchronous / free,
                    whole / free,
                )


def _noise_of_mean(part: Sums) -> np.ndarray:
    """What noise adds at each phase to the sum of squares of the mean period.

    From the scatter at that phase, so that error which comes and goes at one place is not taken for
    error that repeats there; summed up it is that of the run.
    """
    own = part.spread / np.maximum(part.count - 1.0, 1.0) * (part.count > 0)
    total = float(own.sum())
    return own * (part.synchronous_noise / total) if total > 0 else own


def localise(
    errors: list[np.ndarray],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    recording: Recording,
    *,
    own_origin: bool = False,
    fitted: int = 0,
) -> list[dict[str, Any]]:
    """The list `where` of a diagnosis, largest share first.

    `rms`: of what repeats with the scan, above noise, in that part of the run; `rms_not_locked`: of
    what does not; 0 where noise explains it. `share` of the recording's gap, both kinds: parts that
    noise explains have none, the others sum to 1; all are 0 where there is no gap. `of_readings`:
    the part's share of the data.
    """
    found = cells(errors, blocks, spectrum, recording, own_origin=own_origin, fitted=fitted)
    whole = measure_gap(errors, blocks, spectrum, own_origin=own_origin, fitted=fitted)
    positive = sum(max(c.whole, 0.0) for c in found)
    scale = 1.0 / positive if _any_gap(whole) and positive > 0 else 0.0
    readings = sum(c.readings for c in found)
    entries = []
    for c in found:
        run = recording.runs[c.run]
        entries.append(
            {
                "run": c.run,
                "name": run.name,
                "excitation_hz": run.drive.excitation_hz,
                "amplitude": run.drive.u_pp,
                "direction": "up" if c.up else "down",
                "region": "edge" if c.edge else "middle",
                "rms": float(np.sqrt(max(c.synchronous2, 0.0))),
                "rms_not_locked": float(np.sqrt(max(c.nonsynchronous2, 0.0))),
                "share": max(c.whole, 0.0) * scale,
                "of_readings": c.readings / readings,
            }
        )
    entries.sort(key=lambda entry: -entry["share"])
    return entries


def _any_gap(whole: Gap) -> bool:
    return whole.significant and max(whole.synchronous, whole.structural2) > 0


def describe_localisation(
    entries: list[dict[str, Any]], profiles: dict[str, Any] | None = None
) -> str:
    """One sentence on where most of the gap lies, in the words of a report.

    Names the part (region, direction, rate, amplitude) that tells most: `s log(s / d)` for a share
    `s` of the gap in a share `d` of the readings, and nothing where none stands out. A tone that
    does not follow the scan is named too.
    """
    if not any(entry["share"] > 0 for entry in entries):
        return "Nothing stands above the noise, so there is no gap to place."
    kind = _kind(entries)
    tone = _tone(profiles)
    share, data, words = _best_part(entries)
    if share - data < _TOLD:
        text = "The gap is spread evenly over runs, directions and phases"
    else:
        of = f"which is {100 * data:.2g} % of the readings"
        text = f"{100 * share:.0f} % of the gap lies {words}, {of}"
    return text + kind + tone + "."


def _kind(entries: list[dict[str, Any]]) -> str:
    squares = [(e["share"], e["rms"] ** 2, e["rms_not_locked"] ** 2) for e in entries]
    synchronous = sum(share * x / max(x + y, 1e-300) for share, x, y in squares)
    nonsynchronous = sum(share * y / max(x + y, 1e-300) for share, x, y in squares)
    if nonsynchronous > 2.0 * synchronous:
        return "; most of it does not repeat with the scan"
    return "; most of it repeats with the scan" if synchronous > 2.0 * nonsynchronous else ""


def _tone(profiles: dict[str, Any] | None) -> str:
    tones = [line for line in (profiles or {}).get("lines") or [] if not line["locked"]]
    if not tones:
        return ""
    hertz = " and ".join(f"{line['hz']:.4g} Hz" for line in tones[:2])
    return f", and {hertz} stands out whatever the scan does"


def _best_part(entries: list[dict[str, Any]]) -> tuple[float, float, str]:
    rates = _distinct([e["excitation_hz"] for e in entries if e["excitation_hz"] is not None], 1e-6)
    sizes = _distinct([e["amplitude"] for e in entries], _SAME)
    some_rates = [None, *(rates if len(rates) > 1 else [])]
    some_sizes = [None, *(sizes if len(sizes) > 1 else [])]
    best, found = 0.0, (0.0, 0.0, "")
    for part in product(("edge", "middle", None), ("up", "down", None), some_rates, some_sizes):
        inside = [e for e in entries if _inside(e, *part)]
        share = sum(e["share"] for e in inside)
        data = sum(e["of_readings"] for e in inside)
        if share < _MOST:
            continue
        score = share * np.log(share / data) - _WORD * sum(x is not None for x in part)
        if score > best:
            best, found = score, (share, data, _words(*part))
    return found


def _inside(
    e: dict[str, Any],
    region: str | None,
    direction: str | None,
    rate: float | None,
    size: float | None,
) -> bool:
    return (
        region in (None, e["region"])
        and direction in (None, e["direction"])
        and (rate is None or e["excitation_hz"] == rate)
        and (size is None or abs(e["amplitude"] - size) <= _SAME * size)
    )


def _distinct(values: list[float], tolerance: float) -> list[float]:
    out: list[float] = []
    for value in sorted(values):
        if not out or value > out[-1] * (1.0 + tolerance):
            out.append(value)
    return out


def _words(
    region: str | None, direction: str | None, rate: float | None, size: float | None
) -> str:
    near = {
        None: "",
        "edge": "within 10 % of a turning point",
        "middle": "away from turning points",
    }
    branch = {None: "", "up": "on rising branches", "down": "on falling branches"}
    parts = [near[region], branch[direction]]
    parts.append("" if rate is None else f"at {rate:.4g} Hz")
    parts.append("" if size is None else f"at the amplitude {size:.3g}")
    return " ".join(part for part in parts if part)
