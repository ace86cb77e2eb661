"""An ideal analogue-to-digital converter: volts to codes."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Digitizer:
    """An even converter with `bits` bits between `low_v` and `high_v`; values beyond are clipped.

    Codes are int16, centred: from `-2**(bits - 1)` for `low_v` to `2**(bits - 1) - 1` for `high_v`.
    Defaults: 12 bits at 30 MS/s over +-1 V.
    """

    sample_hz: float = 30e6
    bits: int = 12
    low_v: float = -1.0
    high_v: float = 1.0

    def __post_init__(self) -> None:
        if not (self.sample_hz > 0 and 2 <= self.bits <= 16 and self.low_v < self.high_v):
            raise ValueError(f"No digitizer has {self}.")

    @property
    def full_scale(self) -> tuple[float, float]:
        """The lowest and the highest code."""
        return float(-(2 ** (self.bits - 1))), float(2 ** (self.bits - 1) - 1)

    @property
    def volts_per_code(self) -> float:
        """Size of one code, V."""
        return (self.high_v - self.low_v) / (2**self.bits - 1)

    def codes(self, volts: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
        """The codes of `volts`, which is overwritten."""
        low, high = self.full_scale
        volts -= self.low_v
        volts *= 1.0 / self.volts_per_code
        volts += low
        np.rint(volts, out=volts)
        np.clip(volts, low, high, out=volts)
        if out is None:
            return volts.astype(np.int16)
        out[:] = volts
        return out

    def volts(self, codes: np.ndarray) -> np.ndarray:
        """The voltage that stands for `codes`, V."""
        return self.low_v + (codes - self.full_scale[0]) * self.volts_per_code
