"""What was proved about an operator on a range of drive."""

import dataclasses
from typing import Any

from rapi_jax._errors import NotInvertible
from rapi_jax.display._results import summarise_certificate

from ._failures import Failure


@dataclasses.dataclass(frozen=True)
class Certificate:
    """What was proved about an operator on a range of drive, at one scan rate and amplitude.

    - `invertible`: whether every history of drives within the range keeps the slope positive.
    - `low`, `high`, `u_pp`, `freq`: the range, the peak-to-peak drive in the thresholds, the rate.
    - `slope_min`, `slope_at`, `slope_direction`: the smallest slope and where it is met.
    - `failures`: where it is not positive. `crossed`: (play, from, to) where its band is crossed:
      memoryless there, and by itself no fault. `negative`: plays with a threshold below zero.

    >>> from rapi_jax import certify
    >>> from rapi_jax.examples import paper_device
    >>> proof = certify(paper_device().operator, 0.75, 5.25, 10.0)
    >>> proof.invertible, round(proof.slope_min, 1), proof.slope_direction  # GHz/V
    (True, 8.3, 'down')
    """

    invertible: bool
    low: float
    high: float
    u_pp: float
    freq: float
    slope_min: float
    slope_at: float
    slope_direction: str
    failures: tuple[Failure, ...]
    crossed: tuple[tuple[int, float, float], ...]
    negative: tuple[int, ...]
    reasons: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for a file."""
        return dataclasses.asdict(self)

    def summary(self) -> str:
        """The certificate as text for people."""
        return summarise_certificate(self).text()

    def _repr_html_(self) -> str:
        return summarise_certificate(self).html()

    def require(self) -> None:
        """Raise `NotInvertible` where there is no inverse."""
        if not self.invertible:
            raise NotInvertible(
                f"the model cannot be inverted between {self.low:.6g} and {self.high:.6g} at "
                f"{self.freq:g} Hz: {'; '.join(self.reasons)}. Scan less, move the bias, or "
                "identify the model again with more data."
            )
