"""Phase and group index of air with standard errors."""

import dataclasses
import math
from collections.abc import Callable
from typing import Literal

from rapi_jax._errors import DataError
from rapi_jax.ranging._records import AirState

from . import _ciddor, _edlen
from ._thresholds import THRESHOLDS

Formula = Literal["ciddor", "edlen"]
_REFRACTIVITY: dict[str, Callable[..., float]] = {
    "ciddor": _ciddor.refractivity,
    "edlen": _edlen.refractivity,
}


@dataclasses.dataclass(frozen=True)
class AirIndex:
    """An index of air and where its standard error comes from.

    - `value`: the index. `stderr`: its standard error.
    - `parts`: standard errors of the index from `temperature`, `pressure`, `humidity`, `co2` and
      the `formula` itself; `stderr` is the root of the sum of their squares.
    """

    value: float
    parts: dict[str, float]

    @property
    def stderr(self) -> float:
        """Standard error of the index."""
        return math.hypot(*self.parts.values())


def refractive_index(
    air: AirState, wavelength_m: float, *, formula: Formula = "ciddor"
) -> AirIndex:
    """The phase index: of a fringe at one optical frequency.

    **Arguments:**

    - `air`: its state and the standard errors of that.
    - `wavelength_m`: in vacuum, 300 nm to 1700 nm.
    - `formula`: `"ciddor"` (Ciddor 1996), or `"edlen"` (Edlen as modified by Birch and Downs 1993).

    Raises `DataError` for a wavelength outside, or a formula that is not one of these.
    """
    return _index(air, wavelength_m, formula, group=False)


def group_index(air: AirState, wavelength_m: float, *, formula: Formula = "ciddor") -> AirIndex:
    """The group index n - wavelength dn/dwavelength: of the fringes of a frequency scan.

    The phase 2 pi nu tau(nu) of a scan grows with nu at the rate of the group delay, so a distance
    from a scan (Eq. 2) is that of the optical path divided by the group index. Arguments and errors
    are those of `refractive_index`; Ciddor and Hill (1999).
    """
    return _index(air, wavelength_m, formula, group=True)


def _index(air: AirState, wavelength_m: float, formula: str, *, group: bool) -> AirIndex:
    if formula not in _REFRACTIVITY:
        raise DataError(f"`formula` must be one of {', '.join(_REFRACTIVITY)}, not {formula!r}.")
    if not THRESHOLDS.shortest_m <= wavelength_m <= THRESHOLDS.longest_m:
        raise DataError(
            f"`wavelength_m` must be from {THRESHOLDS.shortest_m:g} to {THRESHOLDS.longest_m:g}, "
            f"but is {wavelength_m:g}. The formulas for the index of air hold there; is it in "
            "metres?"
        )

    def refractivity(state: list[float]) -> float:
        return _REFRACTIVITY[formula](*state, wavelength_m=wavelength_m, group=group)

    inputs = (
        ("temperature", air.temperature_c, air.temperature_stderr),
        ("pressure", air.pressure_pa, air.pressure_stderr),
        ("humidity", air.relative_humidity, air.humidity_stderr),
        ("co2", air.co2_ppm, air.co2_stderr),
    )
    state = [value for _, value, _ in inputs]
    parts = {}
    for number, (name, value, stderr) in enumerate(inputs):
        # A central difference over one standard error either way: the derivative, times it.
        above, below = state.copy(), state.copy()
        above[number], below[number] = value + stderr, value - stderr
        parts[name] = abs(refractivity(above) - refractivity(below)) / 2.0
    own = THRESHOLDS.ciddor_stderr if formula == "ciddor" else THRESHOLDS.edlen_stderr
    parts["formula"] = own * (THRESHOLDS.group_factor if group else 1.0)
    return AirIndex(1.0 + refractivity(state), parts)
