"""How many periods a drive is played when the generator ends it by itself."""

import math

from hardware._errors import InstrumentError
from hardware.bench._file import BenchFile
from hardware.bench._thresholds import THRESHOLDS
from hardware.digitizer._base import Acquisition
from hardware.generator._base import AbstractOutput, AbstractWatchdog
from rapi_jax import DataError, Drive


def watchdog_of(output: AbstractOutput, file: BenchFile) -> AbstractWatchdog | None:
    """The output as one that ends a drive by itself, `None` where the file does not ask for it.

    Raises `DataError` where it is asked for and the driver cannot.
    """
    if file.generator.watchdog_s is None:
        return None
    if not isinstance(output, AbstractWatchdog):
        raise DataError(
            f"`generator.watchdog_s` is given, but a generator of kind '{file.generator.kind}' "
            "does not end a drive by itself. Leave it out."
        )
    return output


def count_cycles(
    drive: Drive, asked: Acquisition, file: BenchFile, *, most: int, records: int = 1
) -> int:
    """Periods to play: settling, `records` records with the wait for each, and `watchdog_s`.

    Raises `DataError` where they are more than `most`.
    """
    record_s = asked.before_s + asked.after_s + wait_s(drive)
    seconds = records * record_s + (file.generator.watchdog_s or 0.0)
    cycles = math.ceil(file.settling + seconds * drive.rate)
    if cycles > most:
        raise DataError(
            f"With `generator.watchdog_s` the generator would have to count {cycles} periods of "
            f"{drive.rate:g} Hz, but counts {most} at most. Nothing was played. Take less at once, "
            "or leave `watchdog_s` out: then nothing ends the drive if this computer fails."
        )
    return cycles


def wait_s(drive: Drive) -> float:
    """Longest wait for a trigger, s."""
    return THRESHOLDS.trigger_wait_periods / drive.rate


def allowed_s(
    watchdog: AbstractWatchdog | None, drive: Drive, asked: Acquisition, *, resource: str
) -> float:
    """How long to wait for a record that begins with the next trigger, s.

    No longer than the drive plays, so that no record holds its end. Raises `InstrumentError` where
    that is too short for the record.
    """
    needed_s = asked.before_s + asked.after_s + wait_s(drive)
    most_s = needed_s + THRESHOLDS.late_s
    if watchdog is None:
        return most_s
    left_s = watchdog.playing_s() - THRESHOLDS.watchdog_reserve_s
    if left_s < needed_s:
        raise InstrumentError(
            resource,
            "",
            "",
            why=f"The generator ends the drive too soon for a record: {max(left_s, 0.0):.3g} s are "
            f"left, and {needed_s:.3g} s needed. The instruments answered slowly.",
            cure="Give more time by `generator.watchdog_s` of the bench file.",
        )
    return min(most_s, left_s)
