"""Where a record is cut: neighbouring cycles of one rate and swing are one run."""

import numpy as np
from jaxtyping import Float

from rapi_jax.io.imports._options import ImportOptions
from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.io.imports.cycles._cycles import (
    Cycle,
    closed_cycle,
    loses_a_period,
    name_waveform,
    refine_rate,
    round_rate,
)
from rapi_jax.io.imports.cycles._groups import find_repeating, repeated_cycles
from rapi_jax.io.imports.cycles._noisy_cycles import find_noisy_cycles

from ._describe import describe_dropped
from ._overlap import part_runs
from ._piece import Piece
from ._stated_rate import stated_rate
from ._whole_record import (
    run_not_periodic,
    run_of_one_cycle,
    run_of_one_period,
    run_without_cycles,
)

Samples = Float[np.ndarray, " samples"]


def cut_record(
    drive: Samples, step_s: float, options: ImportOptions, label: str
) -> tuple[list[Piece], list[str]]:
    """The runs of a record, and what was done. Raises `DataError` where a stated rate is wrong."""
    whole = (0, drive.size - 1)
    cycles = find_repeating(drive, step_s)
    if not cycles:
        if (closed := closed_cycle(drive, step_s)) is not None:
            return run_of_one_period(drive, closed, step_s, options, label)
        return run_without_cycles(drive, step_s, options)
    notes = []
    if sum(map(len, repeated_cycles(cycles))) < len(cycles) / 2.0:
        averaged = find_noisy_cycles(drive, step_s, repeated_cycles)
        if averaged is None:
            return run_not_periodic(whole, cycles, options, step_s)
        drive, cycles, note = averaged
        notes = [note]
    kept = repeated_cycles(cycles)
    if len(cycles) == 1 and options.waveform is None:
        shape = name_waveform(drive, cycles, cycles[0].rate, step_s)
        if shape not in ("sine", "triangle"):
            return run_of_one_cycle(whole, cycles[0], options, label)
    if not options.cut and len(kept) > 1:
        kept = [max(kept, key=len)]
    pieces, own, rates = [], [], []
    for group in kept:
        exact, group = refine_rate(drive, group, step_s)
        rate = round_rate(exact, len(group))
        first, last = whole if not options.cut else _extend(drive, group, rate, step_s)
        if loses_a_period(rate, exact, last - first + 1, step_s):
            rate = exact
        rate = stated_rate(rate, options, label)
        waveform = options.waveform or name_waveform(drive, group, rate, step_s)
        pieces.append(Piece(first, last, rate, waveform))
        own.append(group)
        rates.append(rate)
    pieces = part_runs(pieces, own, rates, step_s)
    if len(cycles) == 1 and not options.rates:
        notes.append("one period only: its rate is read off the record's length; give --rate")
    return pieces, notes + describe_dropped(pieces, drive, step_s)


def _extend(drive: Samples, group: list[Cycle], rate: float, step_s: float) -> tuple[int, int]:
    """The ends of a run: its cycles, and as much before and after as the drive repeats."""
    first, last = group[0].first, group[-1].last
    period = 1.0 / (rate * step_s)
    at = np.arange(drive.size)
    change = np.abs(drive - np.interp(at - period, at, drive))  # from a period before
    within = change[int(np.ceil(first + period)) : last + 1]
    least = THRESHOLDS.repeats * max(cycle.swing for cycle in group)
    if within.size > period / 2.0:  # the next rate departs from the same turn, at first by little
        again = THRESHOLDS.repeats_again * float(within.max())
        least = min(least, again + THRESHOLDS.equal * float(np.ptp(drive)))
    for _ in range(int(period)):
        if first == 0 or abs(drive[first - 1] - np.interp(first - 1 + period, at, drive)) > least:
            break
        first -= 1
    for _ in range(int(period)):
        if last + 1 >= drive.size or change[last + 1] > least:
            break
        last += 1
    return first, last
