"""What a model has seen: the range in which it interpolates."""

import dataclasses
from typing import Any

import numpy as np

from rapi_jax._arguments import takes
from rapi_jax._errors import ModelError
from rapi_jax._limits import DriveLimits
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._recording import Recording

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class Identified:
    """Drive range (V), steepest slope (V/s), scan rates (Hz) and amplitudes of a recording.

    `swings_joined`: whether what was recorded at one amplitude was seen to predict the others, so
    that swings between them are inside, too. Without `amplitudes` no swing is outside.
    `drive_unit`: in place of V, where it is no voltage. `response_unit`: of the recording, empty
    where it is not known.

    >>> from rapi_jax import Identified
    >>> from rapi_jax.examples import paper_recording
    >>> recording, _ = paper_recording(samples=100)
    >>> seen = Identified.of(recording)
    >>> seen.rates_hz, round(seen.drive_min, 2), round(seen.drive_max, 2)
    ((10.0, 20.0, 30.0, 40.0), 0.75, 5.25)
    """

    drive_min: float
    drive_max: float
    slew_max: float
    rates_hz: tuple[float, ...]
    amplitudes: tuple[float, ...]
    swings_joined: bool = True
    drive_unit: str = "V"
    response_unit: str = ""

    @classmethod
    @takes(recording=Recording)
    def of(cls, recording: Recording, *, swings_joined: bool = True) -> "Identified":
        """The range of `recording`."""
        drives = recording.drives
        return cls(
            drive_min=min(float(d.value.min()) for d in drives),
            drive_max=max(float(d.value.max()) for d in drives),
            slew_max=max(float(np.abs(np.diff(d.value)).max() / d.step_s) for d in drives),
            rates_hz=tuple(rate for rate in recording.rates if rate > 0),
            amplitudes=tuple(recording.amplitudes),
            swings_joined=swings_joined,
            drive_unit=recording.drive_unit,
            response_unit=recording.response_unit,
        )

    @classmethod
    def from_dict(cls, fields: dict[str, Any]) -> "Identified":
        """From what `to_dict` gave; raises `ModelError` where a part is missing."""
        try:
            return cls(
                drive_min=float(fields["drive_min"]),
                drive_max=float(fields["drive_max"]),
                slew_max=float(fields["slew_max"]),
                rates_hz=tuple(map(float, fields["rates_hz"])),
                amplitudes=tuple(map(float, fields["amplitudes"])),
                swings_joined=bool(fields.get("swings_joined", True)),
                drive_unit=str(fields.get("drive_unit", "V")),
                response_unit=str(fields.get("response_unit", "")),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise ModelError(
                "the model does not say in which range it was identified. Fit it again."
            ) from error

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for a file."""
        return {
            "drive_min": self.drive_min,
            "drive_max": self.drive_max,
            "slew_max": self.slew_max,
            "rates_hz": list(self.rates_hz),
            "amplitudes": list(self.amplitudes),
            "swings_joined": self.swings_joined,
            "drive_unit": self.drive_unit,
            "response_unit": self.response_unit,
        }

    @property
    def centre(self) -> float:
        """The middle of the drive range."""
        return (self.drive_min + self.drive_max) / 2

    def limits(self) -> DriveLimits:
        """Limits for a drive that stays near what was seen: 5 % more range, 3 times the slope.

        A straight scan needs more drive than the crooked one of the same span at the fast rates,
        and right after a turn, where no play moves yet, about twice the slope.
        """
        more = THRESHOLDS.range_margin * (self.drive_max - self.drive_min)
        return DriveLimits(
            self.drive_min - more,
            self.drive_max + more,
            THRESHOLDS.slope_margin * max(self.slew_max, 1e-12),
            unit=self.drive_unit,
        )

    def recorded_limits(self) -> DriveLimits:
        """Limits for a drive that stays within what was seen: its range, and its largest slope."""
        rounding = 1.0 + 1e-9
        return DriveLimits(
            self.drive_min,
            self.drive_max,
            rounding * max(self.slew_max, 1e-12),
            unit=self.drive_unit,
        )

    def _is_near(self, swing: float, recorded: float) -> bool:
        """Whether a swing is a little below one that was recorded; what is above has limits."""
        most = 1.0 + THRESHOLDS.range_margin
        return THRESHOLDS.least_swing * recorded <= swing <= most * recorded

    def outside(self, drive: Drive) -> list[str]:
        """In which ways `drive` leaves the range, in words; empty where it does not."""
        limits, unit = self.limits(), self.drive_unit
        found = []
        low, high = float(drive.value.min()), float(drive.value.max())
        if low < limits.low_v or high > limits.high_v:
            found.append(
                f"the drive goes from {low:.4g} to {high:.4g} {unit}, the model was identified "
                f"from {self.drive_min:.4g} to {self.drive_max:.4g} {unit}"
            )
        swings = self.amplitudes
        if swings and drive.u_pp < THRESHOLDS.least_swing * min(swings):
            found.append(
                f"the drive swings by {drive.u_pp:.3g} {unit}, the model was identified at "
                f"{' and '.join(f'{swing:.3g}' for swing in swings)} {unit}: how thresholds "
                "follow the swing is assumed below that (Eq. 11), and one more run near "
                f"{drive.u_pp:.2g} {unit} would measure it"
            )
        elif (
            swings
            and not self.swings_joined
            and not any(self._is_near(drive.u_pp, s) for s in swings)
        ):
            seen = " and ".join(f"{swing:.3g}" for swing in swings)
            found.append(
                f"the drive swings by {drive.u_pp:.3g} {unit}, the model was identified at {seen} "
                f"{unit}, and "
                "what it saw at one of these did not predict the other: one more run near "
                f"{drive.u_pp:.2g} {unit} would show what lies between"
            )
        found += self.other_rate(drive.rate)
        return found

    def other_rate(self, *rates_hz: float) -> list[str]:
        """That the model was not identified at some of these rates, in words; empty where it was.

        All of them in one text.
        """
        slow, fast = min(self.rates_hz, default=0.0), max(self.rates_hz, default=np.inf)
        other = [
            f"{rate:g}"
            for rate in rates_hz
            if (rate > 0 and not self.rates_hz) or not 0.95 * slow <= rate <= 1.05 * fast
        ]
        if not other:
            return []
        what = "rate is" if len(other) == 1 else "rates are"
        seen = f"{slow:g} to {fast:g} Hz" if slow < fast else f"{slow:g} Hz"
        seen = seen if self.rates_hz else "none"
        return [f"the scan {what} {', '.join(other)} Hz, the model was identified at {seen}"]
