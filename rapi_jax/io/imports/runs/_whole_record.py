"""A record that is one run as a whole: it does not repeat, or holds no more than one cycle."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax.io.imports._options import ImportOptions
from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.io.imports.cleaning._nearest_waveform import choose_waveform
from rapi_jax.io.imports.cycles._cycles import Cycle, name_waveform, round_one_rate
from rapi_jax.recording._drive import Drive

from ._piece import Piece
from ._stated_rate import stated_rate

Samples = Float[np.ndarray, " samples"]


def run_without_cycles(
    drive: Samples, step_s: float, options: ImportOptions
) -> tuple[list[Piece], list[str]]:
    """A record in which no turn is seen twice."""
    whole = (0, drive.size - 1)
    if len(options.rates) == 1 and options.rates[0] * step_s * drive.size >= 0.999:
        rate, waveform, note = options.rates[0], options.waveform, ""
        if waveform is None:
            time = np.arange(drive.size) * step_s
            waveform, found = choose_waveform(Drive(time, drive, rate, "other"))
            note = f" and {found}"
        return [Piece(*whole, rate, waveform)], [
            f"no turn is seen twice: the rate of {rate:g} Hz is as said{note}"
        ]
    rate = options.rates[0] if options.rates else None
    return [Piece(*whole, rate, "other")], [
        "no period was found: the drive is taken for one that does not repeat"
    ]


def run_of_one_period(
    drive: Samples, cycle: Cycle, step_s: float, options: ImportOptions, label: str
) -> tuple[list[Piece], list[str]]:
    """A record of one period that does not begin at a turn."""
    whole = (cycle.first, cycle.last)
    from_low = np.roll(drive[:-1], -int(np.argmin(drive[:-1])))
    period = dataclasses.replace(cycle, last=from_low.size - 1)
    shape = options.waveform or name_waveform(from_low, [period], cycle.rate, step_s)
    if shape not in ("sine", "triangle"):
        return run_of_one_cycle(whole, cycle, options, label)
    rate = stated_rate(round_one_rate(cycle.rate, 4, cycle, step_s), options, label)
    note = "one period only: its rate is read off the record's length; give --rate"
    return [Piece(*whole, rate, shape)], [] if options.rates else [note]


def run_of_one_cycle(
    whole: tuple[int, int], cycle: Cycle, options: ImportOptions, label: str
) -> tuple[list[Piece], list[str]]:
    """A record of one cycle that is neither a triangle nor a sine."""
    rate = stated_rate(float(f"{cycle.rate:.4g}"), options, label)
    return [Piece(*whole, rate, "other")], [
        f"the drive rises and falls once, in {1.0 / cycle.rate:.4g} s, as neither a triangle nor a "
        f'sine: one run, waveform "other", at {rate:.4g} Hz. Record three periods or more'
    ]


def run_not_periodic(
    whole: tuple[int, int], cycles: list[Cycle], options: ImportOptions, step_s: float
) -> tuple[list[Piece], list[str]]:
    """A record whose cycles do not repeat."""
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
