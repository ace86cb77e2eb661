"""The interface of a bench, real or simulated: drives in, a recording out, within limits."""

import abc
import dataclasses
from collections.abc import Sequence

from rapi_jax import DataError, Drive, DriveLimits, LimitError, Recording
from rapi_jax.internal import join_refusals


class AbstractBench(abc.ABC):
    """A device that can be driven and read.

    >>> from hardware import AbstractBench, SimulatedBench
    >>> isinstance(SimulatedBench.like_paper(), AbstractBench)  # and so is a real one
    True
    """

    limits: DriveLimits

    @abc.abstractmethod
    def measure(self, drives: Drive | Sequence[Drive]) -> Recording:
        """Play each drive and read the optical frequency, GHz, on the drive's own samples.

        All drives are checked first: where one is refused, none is played. Raises `LimitError` for
        a drive beyond `limits`, `DataError` for one that does not repeat.
        """


def check_drives(drives: Drive | Sequence[Drive], limits: DriveLimits) -> tuple[Drive, ...]:
    """The drives, if all may be played; raises `LimitError` or `DataError` otherwise.

    A `LimitError` names all that are beyond the limits.
    """
    several = (drives,) if isinstance(drives, Drive) else tuple(drives)
    if not several:
        raise DataError("There is no drive to measure.")
    refused = []
    for number, drive in enumerate(several, 1):
        name = f"drive {number} of {len(several)}"
        where = "" if len(several) == 1 else f"{name}: "
        if not drive.repeats or drive.periods < 1:
            raise DataError(
                f"{where}a generator plays a drive that repeats, but this one has no complete "
                "period. Give it its rate and waveform, and at least one whole period."
            )
        try:
            limits.check(drive)
        except LimitError as error:
            if not where:
                raise
            refused.append((name, error))
    if refused:
        raise join_refusals(refused)
    return several


def amplify(drive: Drive, *, gain: float, offset_v: float) -> Drive:
    """The drive behind an amplifier, at the piezo's input."""
    return dataclasses.replace(drive, value=gain * drive.value + offset_v)
