"""A long record cut into runs of one rate and swing."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError
from rapi_jax.recording._drive import Drive, Waveform

from ._options import ImportOptions
from ._thresholds import THRESHOLDS
from .cycles._cycles import (
    Cycle,
    closed_cycle,
    find_cycles,
    loses_a_period,
    name_waveform,
    refine_rate,
    round_one_rate,
    round_rate,
)
from .cycles._noisy_cycles import find_noisy_cycles

Samples = Float[np.ndarray, " samples"]


@dataclasses.dataclass(frozen=True)
class Piece:
    """Samples `first` to `last` of a record as one run, and what its drive is."""

    first: int
    last: int
    excitation_hz: float | None
    waveform: Waveform


def cut_record(
    drive: Samples, step_s: float, options: ImportOptions, label: str
) -> tuple[list[Piece], list[str]]:
    """The runs of a record, and what was done. Raises `DataError` where a stated rate is wrong."""
    whole = (0, drive.size - 1)
    cycles = find_cycles(drive, step_s)
    if not cycles:
        if (closed := closed_cycle(drive, step_s)) is not None:
            return _one_period(drive, closed, step_s, options, label)
        return _without_cycles(whole, step_s, options)
    notes = []
    if sum(map(len, _repeated(cycles))) < len(cycles) / 2.0:
        averaged = find_noisy_cycles(drive, step_s, _repeated)
        if averaged is None:
            return _not_periodic(whole, cycles, options, step_s)
        drive, cycles, note = averaged
        notes = [note]
    kept = _repeated(cycles)
    if len(cycles) == 1 and options.waveform is None:
        shape = name_waveform(drive, cycles, cycles[0].rate, step_s)
        if shape not in ("sine", "triangle"):
            return _one_cycle(whole, cycles[0], options, label)
    if not options.cut and len(kept) > 1:
        kept = [max(kept, key=len)]
    pieces, own, rates = [], [], []
    for group in kept:
        exact, group = refine_rate(drive, group, step_s)
        rate = round_rate(exact, len(group))
        first, last = whole if not options.cut else _extend(drive, group, rate, step_s)
        if loses_a_period(rate, exact, last - first + 1, step_s):
            rate = exact
        rate = _stated(rate, options, label)
        waveform = options.waveform or name_waveform(drive, group, rate, step_s)
        pieces.append(Piece(first, last, rate, waveform))
        own.append(group)
        rates.append(rate)
    pieces = _apart(pieces, own, rates, step_s)
    if len(cycles) == 1 and not options.rates:
        notes.append("one period only: its rate is read off the record's length; give --rate")
    return pieces, notes + _dropped(pieces, drive.size, step_s)


def describe_run(drive: Drive, name: str, first: int) -> str:
    """What a run is, in a sentence; `first`: its first sample in the record."""
    where = f"samples {first}-{first + drive.size - 1}"
    if not drive.repeats:
        return f"{name}: {where}, {drive.size * drive.step_s:.4g} s, not periodic"
    inside = np.flatnonzero(drive.period >= 0)
    ends = (int(inside[0]), drive.size - 1 - int(inside[-1])) if inside.size else (0, 0)
    a_period = drive.step_s * drive.rate
    parts = [
        f"{n * a_period:.2g} of a period {where}"
        for n, where in zip(ends, ("before", "after"), strict=True)
        if n * a_period >= 0.01
    ]
    broken = f"; broken ends stay, for settling ({' and '.join(parts)})" if parts else ""
    return (
        f"{name}: {where}, {drive.periods} period(s) of a {drive.waveform} at "
        f"{drive.rate:.6g} Hz, swing {drive.u_pp:.4g}{broken}"
    )


def _group(cycles: list[Cycle]) -> list[list[Cycle]]:
    """Neighbouring cycles of one rate and one pair of levels."""
    groups: list[list[Cycle]] = []
    for cycle in cycles:
        if groups and groups[-1][-1].last == cycle.first and _alike(groups[-1][0], cycle):
            groups[-1].append(cycle)
        else:
            groups.append([cycle])
    return groups


def _repeated(cycles: list[Cycle]) -> list[list[Cycle]]:
    """The groups of cycles that are alike; a cycle alone where there is no other."""
    groups = _group(cycles)
    repeated = [group for group in groups if len(group) > 1]
    return repeated or (groups if len(groups) == 1 else [])


def _alike(one: Cycle, other: Cycle) -> bool:
    swing = max(one.swing, other.swing)
    return (
        abs(one.rate - other.rate) < THRESHOLDS.same_rate * max(one.rate, other.rate)
        and abs(one.low - other.low) < THRESHOLDS.same_level * swing
        and abs(one.high - other.high) < THRESHOLDS.same_level * swing
    )


def _stated(found: float, options: ImportOptions, label: str) -> float:
    """The rate that was said, where the drive has it."""
    if not options.rates:
        return found
    near = min(options.rates, key=lambda rate: abs(np.log(rate / found)))
    if abs(near - found) <= THRESHOLDS.stated_rate * found:
        return near
    said = ", ".join(f"{rate:g}" for rate in options.rates)
    factor = near / found
    why = "That is a factor of 1000: check --time-unit" if abs(
        abs(np.log10(factor)) - 3.0
    ) < 0.02 else "Correct --rate, or leave it out"  # fmt: skip
    raise DataError(
        f"{label}: the drive repeats at {found:.5g} Hz, not at {said} Hz as said. {why}."
    )


def _extend(drive: Samples, group: list[Cycle], rate: float, step_s: float) -> tuple[int, int]:
    """The ends of a run: its cycles, and as much before and after as the drive repeats."""
    first, last = group[0].first, group[-1].last
    period = 1.0 / (rate * step_s)
    least = THRESHOLDS.repeats * max(cycle.swing for cycle in group)
    at = np.arange(drive.size)
    for _ in range(int(period)):
        if first == 0 or abs(drive[first - 1] - np.interp(first - 1 + period, at, drive)) > least:
            break
        first -= 1
    for _ in range(int(period)):
        if last + 1 >= drive.size:
            break
        if abs(drive[last + 1] - np.interp(last + 1 - period, at, drive)) > least:
            break
        last += 1
    return first, last


def _apart(
    pieces: list[Piece], groups: list[list[Cycle]], rates: list[float], step_s: float
) -> list[Piece]:
    """Runs that share only a few samples, about a turn that noise displaces."""
    found = list(pieces)
    for k in range(len(found) - 1):
        if found[k].last < found[k + 1].first:
            continue
        turn = _turn(groups[k + 1], 1.0 / (rates[k + 1] * step_s))
        shared = turn - 1 + int(THRESHOLDS.shared_samples / (rates[k] * step_s))
        last = max(min(found[k].last, shared), groups[k][-1].last)
        found[k] = dataclasses.replace(found[k], last=last)
        found[k + 1] = dataclasses.replace(found[k + 1], first=max(turn, found[k + 1].first))
    return found


def _turn(group: list[Cycle], period: float) -> int:
    """Where the first cycle begins, by all of them: noise displaces each turn; rather early.

    By as much as turns are displaced, and no more: what is before is of the run before.
    """
    begins = np.array([cycle.first - k * period for k, cycle in enumerate(group)])
    first = float(np.median(begins))
    near = abs(first - group[0].first) < 2.0 * THRESHOLDS.shared_samples * period
    early = min(float(np.abs(begins - first).max()), THRESHOLDS.early_start * period)
    return max(int(np.ceil((first if near else group[0].first) - early - 1e-6)), 0)


def without_overlap(pieces: list[Piece], drive: Samples, step_s: float) -> list[Piece]:
    """Runs without the samples about a turn that they share with another one of another rate."""
    found = list(pieces)
    for k in range(len(found) - 1):
        if found[k].last < found[k + 1].first:
            continue
        one = found[k]
        value = drive[one.first : one.last + 1]
        run = Drive(step_s * np.arange(value.size), value, one.excitation_hz, one.waveform)
        inside = np.flatnonzero(run.period >= 0) if run.repeats else np.zeros(0, dtype=int)
        last = one.first + int(inside[-1]) if inside.size else one.last
        found[k] = dataclasses.replace(one, last=last)
        found[k + 1] = dataclasses.replace(found[k + 1], first=max(last, found[k + 1].first))
    return found


def _dropped(pieces: list[Piece], size: int, step_s: float) -> list[str]:
    edges = [(-1, -1), *((p.first, p.last) for p in pieces), (size, size)]
    lost = [
        (before[1] + 1, after[0] - 1)
        for before, after in zip(edges[:-1], edges[1:], strict=True)
        if after[0] - before[1] > 1
    ]
    if not lost:
        return []
    shown = ", ".join(f"{a}-{b}" for a, b in lost[:4])
    more = f" and {len(lost) - 4} more" if len(lost) > 4 else ""
    samples = sum(b - a + 1 for a, b in lost)
    return [
        f"dropped {samples} samples ({samples * step_s:.4g} s) that belong to no whole period of "
        f"one rate: {shown}{more}"
    ]


def _without_cycles(
    whole: tuple[int, int], step_s: float, options: ImportOptions
) -> tuple[list[Piece], list[str]]:
    size = whole[1] + 1
    if len(options.rates) == 1 and options.rates[0] * step_s * size >= 0.999:
        piece = Piece(*whole, options.rates[0], options.waveform or "triangle")
        waveform = "" if options.waveform else " and its waveform is taken for a triangle"
        return [piece], [f"no turn is seen twice: the rate of {options.rates[0]:g} Hz is as "
                         f"said{waveform}"]  # fmt: skip
    rate = options.rates[0] if options.rates else None
    return [Piece(*whole, rate, "other")], [
        "no period was found: the drive is taken for one that does not repeat"
    ]


def _one_period(
    drive: Samples, cycle: Cycle, step_s: float, options: ImportOptions, label: str
) -> tuple[list[Piece], list[str]]:
    """A record of one period that does not begin at a turn."""
    whole = (cycle.first, cycle.last)
    from_low = np.roll(drive[:-1], -int(np.argmin(drive[:-1])))
    period = dataclasses.replace(cycle, last=from_low.size - 1)
    shape = options.waveform or name_waveform(from_low, [period], cycle.rate, step_s)
    if shape not in ("sine", "triangle"):
        return _one_cycle(whole, cycle, options, label)
    rate = _stated(round_one_rate(cycle.rate, 4, cycle, step_s), options, label)
    note = "one period only: its rate is read off the record's length; give --rate"
    return [Piece(*whole, rate, shape)], [] if options.rates else [note]


def _one_cycle(
    whole: tuple[int, int], cycle: Cycle, options: ImportOptions, label: str
) -> tuple[list[Piece], list[str]]:
    rate = _stated(float(f"{cycle.rate:.4g}"), options, label)
    return [Piece(*whole, rate, "other")], [
        f"the drive rises and falls once, in {1.0 / cycle.rate:.4g} s, as neither a triangle nor a "
        f'sine: one run, waveform "other", at {rate:.4g} Hz. Record three periods or more'
    ]


def _not_periodic(
    whole: tuple[int, int], cycles: list[Cycle], options: ImportOptions, step_s: float
) -> tuple[list[Piece], list[str]]:
    rates = [cycle.rate for cycle in cycles]
    usual = float(np.median(rates))
    one = all(abs(rate - usual) < THRESHOLDS.same_rate * usual for rate in rates)
    rate = options.rates[0] if options.rates else float(f"{usual:.4g}") if one else None
    swings = sorted(cycle.swing for cycle in cycles)
    waveform = options.waveform if rate and options.waveform else "other"
    note = (
        f"{len(cycles)} cycles that do not repeat (swings of {swings[0]:.4g} to {swings[-1]:.4g}, "
        f"rates of {min(rates):.4g} to {max(rates):.4g} Hz): one run, "
        + (f'waveform "{waveform}", at {rate:.4g} Hz' if rate else "without a rate")
    )
    if len(cycles) > 2 and waveform == "other":
        note += (
            ". If the drive does repeat, give --rate and --waveform, or the drive that was sent "
        )
        note += "(--drive-amplitude, --drive-offset, --drive-rate)"
    return [Piece(*whole, rate, waveform)], [note]
