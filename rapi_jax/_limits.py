"""What a drive may do to the piezo: checked before it is written or sent, refused whole."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ._errors import LimitError
from ._thresholds import THRESHOLDS
from .recording._drive import Drive


@dataclasses.dataclass(frozen=True)
class DriveLimits:
    """Limits of a voltage, where the drive that they are compared with is stated.

    That is at the piezo's input for a bench, at the generator's output for `AFG31000.channel`.

    - `low_v`, `high_v`: V.
    - `slew_v_per_s`: steepest slope between samples, V/s.
    - `step_v`: largest step from one sample to the next, V; for a drive that repeats also the one
      that closes the period.
    - `max_frequency_hz`: highest scan rate, Hz.
    - `unit`: of the drive, where it is not a voltage; in place of V throughout.

    >>> from rapi_jax import DriveLimits, LimitError, triangle
    >>> limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=200.0)
    >>> slow, fast = triangle([10.0, 40.0], amplitude=4.5, bias=3.0, samples=100)
    >>> limits.check(slow)  # 90 V/s: nothing is raised
    >>> try:
    ...     limits.check(fast)
    ... except LimitError as error:
    ...     print(str(error).split(" (")[0])
    the step after sample 40 is 360 V/s, but `slew_v_per_s` is 200 V/s
    """

    low_v: float
    high_v: float
    slew_v_per_s: float
    step_v: float = np.inf
    max_frequency_hz: float = np.inf
    unit: str = "V"

    def __post_init__(self) -> None:
        if not np.isfinite([self.low_v, self.high_v]).all():
            raise ValueError(f"`low_v` and `high_v` must be finite, but the limits are {self}.")
        if not self.low_v < self.high_v:
            raise ValueError(f"`low_v` must lie below `high_v`, but they are {self}.")
        for name in ("slew_v_per_s", "step_v", "max_frequency_hz"):
            if not getattr(self, name) > 0:
                raise ValueError(f"`{name}` must be positive, but is {getattr(self, name)}.")

    def check(self, drive: Drive) -> None:
        """Raise `LimitError` where `drive` leaves the limits anywhere; never changes it."""
        value, slack = drive.value, THRESHOLDS.limit_rounding * (self.high_v - self.low_v)
        for outside, name, limit in (
            (value < self.low_v - slack, "low_v", self.low_v),
            (value > self.high_v + slack, "high_v", self.high_v),
        ):
            if outside.any():
                worst = int(np.argmax(np.where(outside, np.abs(value - limit), -1.0)))
                raise LimitError(
                    f"{outside.sum()} sample(s) beyond `{name}` = {limit:g} {self.unit}, the "
                    f"first at sample {np.argmax(outside)}, the worst at sample {worst}: "
                    f"{value[worst]:.6g} {self.unit}. Scan less, move the bias, or widen the limit "
                    "if the device allows it."
                )
        if drive.rate > self.max_frequency_hz * (1 + THRESHOLDS.limit_rounding):
            raise LimitError(
                f"the scan rate is {drive.rate:g} Hz, but `max_frequency_hz` is "
                f"{self.max_frequency_hz:g} Hz. Scan more slowly."
            )
        step = np.diff(value)
        self._check_steps(np.abs(step), drive.step_s, slack, "after sample {i}")
        if drive.repeats:
            closing = abs(float(closing_step(drive)))
            self._check_steps(np.array([closing]), drive.step_s, slack, "that closes the period")

    def _check_steps(self, step: np.ndarray, step_s: float, slack: float, where: str) -> None:
        limits = (
            (self.step_v, "step_v", self.unit, 1.0),
            (self.slew_v_per_s * step_s, "slew_v_per_s", f"{self.unit}/s", step_s),
        )
        for limit, name, unit, per in limits:
            over = step > limit + slack
            if over.any():
                i = int(np.argmax(step))
                raise LimitError(
                    f"the step {where.format(i=i)} is {step[i] / per:.6g} {unit}, but `{name}` is "
                    f"{getattr(self, name):g} {unit} ({over.sum()} such step(s)). Scan more "
                    "slowly, smooth the corners more (`--corner`, in Python `corner`), or widen "
                    "the limit if the device allows it. A smaller span needs less, unless the "
                    "model's own slope is small there."
                )


def join_refusals(refused: Sequence[tuple[str, LimitError]]) -> LimitError:
    """One error for drives that are refused, each named by what `refused` says of it.

    The first is told in full, with what to do; of the others what is wrong, nothing where it is the
    same.
    """
    (name, first), *others = refused
    text, seen = f"{name}: {first}", _fault(first)
    if others:
        more = [
            other if _fault(error) == seen else f"{other} ({_fault(error)})"
            for other, error in others
        ]
        text += f" Refused, too: {'; '.join(more)}."
    return type(first)(text)


def _fault(error: Exception) -> str:
    """What is wrong, without what to do."""
    return str(error).partition(". ")[0]


def closing_step(drive: Drive) -> float:
    """The step from the last sample of a period to the first of the next, V.

    With a whole number of samples a period, these are the record's last and first. Otherwise the
    record ends within a period, and the drive is continued to where the next sample falls.
    """
    cycles = drive.size * drive.step_s * drive.rate  # where the next sample falls, in periods
    at = (cycles % 1.0) / drive.rate
    if min(at, 1.0 / drive.rate - at) < 1e-6 * drive.step_s:
        return float(drive.value[0] - drive.value[-1])
    return float(np.interp(at, drive.time, drive.value) - drive.value[-1])
