"""What the photodiodes recorded in one run."""

import dataclasses
from typing import Any

import numpy as np

from rapi_jax._errors import DataError


def _channel(name: str, value: Any) -> np.ndarray:
    array = np.asarray(value)
    if array.ndim != 1 or array.dtype.kind not in "iuf":
        raise DataError(
            f"`{name}` must be one column of numbers, but has shape {array.shape} and type "
            f"{array.dtype}."
        )
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        at = int(np.flatnonzero(~np.isfinite(array))[0])
        raise DataError(f"`{name}` has a value that is not finite at sample {at}: export it again.")
    return array


@dataclasses.dataclass(frozen=True, eq=False)
class Fringes:
    """Raw photodiode records of one run, sampled together.

    - `interferometer`: the auxiliary interferometer, `B + A cos(2 pi nu tau)`; codes or volts.
    - `cavity`: the Fabry-Perot's transmission, same length; `None` where there is none.
    - `sample_hz`: sampling rate of both, Hz.
    - `start_s`: time of the first sample from the drive's start, s; negative before it.
    - `delay_s`: nominal delay tau of the auxiliary interferometer, s.
    - `fsr_ghz`: free spectral range of the cavity, GHz.
    - `full_scale`: lowest and highest value the digitizer gives, in the records' own unit; `None`
      where unknown.

    Raises `DataError` where a channel is not a column of finite numbers, or the two differ in
    length.

    >>> import numpy as np
    >>> from rapi_jax.readout import Fringes
    >>> signal = np.cos(np.linspace(0.0, 100.0, 4000))
    >>> fringes = Fringes(signal, None, sample_hz=1e6, delay_s=2.45e-8)
    >>> fringes.interferometer.size, fringes.cavity is None
    (4000, True)
    """

    interferometer: np.ndarray
    cavity: np.ndarray | None
    sample_hz: float
    start_s: float = 0.0
    delay_s: float = 24.5e-9
    fsr_ghz: float = 1.5
    full_scale: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "interferometer", _channel("interferometer", self.interferometer))
        if self.interferometer.size < 256:
            raise DataError(
                f"`interferometer` has {self.interferometer.size} samples: too few to read fringes."
            )
        if self.cavity is not None:
            set_(self, "cavity", _channel("cavity", self.cavity))
            if self.cavity.size != self.interferometer.size:
                raise DataError(
                    f"`interferometer` has {self.interferometer.size} samples, but `cavity` has "
                    f"{self.cavity.size}. Both come from one digitizer: record them together."
                )
        for name in ("sample_hz", "delay_s", "fsr_ghz"):
            value = float(getattr(self, name))
            if not (np.isfinite(value) and value > 0):
                raise DataError(f"`{name}` must be a positive number, but is {value}.")
            set_(self, name, value)
        set_(self, "start_s", float(self.start_s))

    @property
    def size(self) -> int:
        """Number of samples of each channel."""
        return self.interferometer.size

    @property
    def stop_s(self) -> float:
        """Time of the last sample from the drive's start, s."""
        return self.start_s + (self.size - 1) / self.sample_hz


def mask_clipped(
    x: np.ndarray, full_scale: tuple[float, float] | None, *, low: bool = True
) -> np.ndarray | None:
    """Which samples lie on the digitizer's edge or on a repeated extreme; `None` where none does.

    Unclipped fringes dwell near their extremes too, but spread over many codes: an extreme is
    taken for an edge where its own value is half as frequent as all values within 1 % below it.
    `low`: look at the lower edge as well (a cavity's dark level may rest there by right).
    """
    bottom, top = float(x.min()), float(x.max())
    margin = 0.01 * (top - bottom)
    sides = [(top, 1)] + ([(bottom, -1)] if low else [])
    mask: np.ndarray | None = None
    for edge, sign in sides:
        at = x == edge
        own = int(at.sum())
        if own < 8:
            continue
        near = int(((x >= edge - margin) if sign > 0 else (x <= edge + margin)).sum()) - own
        limit = None if full_scale is None else full_scale[1 if sign > 0 else 0]
        on_limit = limit is not None and sign * (edge - limit) >= 0
        if on_limit or own > 0.5 * near:
            mask = at if mask is None else mask | at
    return mask
