"""What a check found: one measured figure a run or branch, beside what was claimed."""

import dataclasses
from typing import Any

import numpy as np

from fitting._json import replace_nonfinite

SCHEMA = "rapi.claim-check/1"
NEXT = {
    "prediction": (
        "If the device changed since it was fitted (drift over more hours than the claim's, "
        "temperature, bias, a new mount), fit again with runs of today. If not, `rapi diagnose "
        "RECORDING --model RESULT` says where the two part, and which effect causes it."
    ),
    "straightness": (
        "Measure runs like those of the fit, too, and check these against the model: if they hold, "
        "the drive that reached the piezo was not the one listed (gain, range, load, a lag); if "
        "not, the device changed since it was fitted (hours, temperature, bias): fit again, and "
        "write the drives again."
    ),
}


@dataclasses.dataclass(frozen=True)
class Checked:
    """One measured figure beside what was claimed, in the response's unit.

    - `branch`: "up" or "down" of a scan; empty where it is a whole run.
    - `rms`: what was measured. `low`, `high`: the 95 % interval claimed for one. `bound`: what the
      largest of all that were judged exceeds as seldom. All three nan where nothing is claimed.
    - `noise`: of the readings in this run, part of `rms`.
    - `span`: peak to peak that a scan reached, of its mean period. `span_asked`: what its drive was
      made for. Both `None` where it is no certified scan; no part of the claim.
    - `outside`: why it is not judged; empty where it is.
    """

    run: str
    branch: str
    excitation_hz: float | None
    swing: float
    rms: float
    low: float
    high: float
    bound: float
    noise: float
    outside: tuple[str, ...] = ()
    span: float | None = None
    span_asked: float | None = None

    @property
    def held(self) -> bool | None:
        """Whether the claim held here; `None` where it is not judged."""
        return None if self.outside else self.rms <= self.bound

    @property
    def within(self) -> bool | None:
        """Whether it is no larger than the interval for one alone; `None` where not judged."""
        return None if self.outside else self.rms <= self.high


@dataclasses.dataclass(frozen=True)
class ClaimCheck:
    """Whether a claim held: `kind` is "prediction" or "straightness".

    `offset`: the model's zero less the recording's, response unit, where runs share one; no part of
    the claim.
    `advice`: what to do, where the claim did not hold.

    >>> from fitting import Claim, check_claim
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> claim = Claim(
    ...     rms=0.024, low=0.011, high=0.049, noise=0.022, curvature=3.0,
    ...     rates_hz=(10.0, 40.0), swings=(4.4, 4.6), hours=1.0,
    ... )
    >>> checked = check_claim(paper_device(), recording, claim=claim)
    >>> checked.unit, checked.held
    ('GHz', True)
    """

    kind: str
    unit: str
    drive_unit: str
    checked: tuple[Checked, ...]
    advice: tuple[str, ...] = ()
    offset: float | None = None

    @property
    def held(self) -> bool | None:
        """Whether the claim held wherever it was judged; `None` where nothing was."""
        judged = [one.held for one in self.checked if one.held is not None]
        return all(judged) if judged else None

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for a file (schema `rapi.claim-check/1`)."""
        rows = [
            dataclasses.asdict(one) | {"held": one.held, "within": one.within}
            for one in self.checked
        ]
        return replace_nonfinite(
            {
                "schema": SCHEMA,
                "kind": self.kind,
                "unit": self.unit,
                "drive_unit": self.drive_unit,
                "held": self.held,
                "checked": rows,
                "offset": self.offset,
                "advice": list(self.advice),
            }
        )


def without_noise(rms: float, noise: float) -> float:
    """What of an rms is not noise."""
    return float(np.sqrt(max(rms**2 - noise**2, 0.0)))
