"""Calibration constants that turn chi-squares into probabilities, with their provenance."""

import dataclasses
import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

SCHEMA = "rapi.calibration/1"


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Constants of `_probability`, fitted to a bank of simulated devices.

    Between hypotheses:

    - `temperature`: differences of log evidence are divided by it, and by `form` times the excess
      at stake between two hypotheses besides: no effect is quite as its equation says.
    - `parameter`: log evidence that one more parameter costs, in units of the logarithm of the
      number of lines, halved.
    - `chance`: log evidence that one more effect costs, for the search over its initial guesses.
    - `law`: log evidence that an effect which changes the law of thresholds costs besides: a device
      whose hysteresis is none that a density of plays can make differs from it by such a law, too.
    - `hysteresis`: what an effect must remove for nothing, as a share of what a density of plays
      explains beside it: a device's hysteresis may differ from any such density by so much.
    - `second`: what a second effect must remove for nothing, as a share of what the first explains
      alone: so much the first one's equation may be wrong by.

    For `unlisted`, logarithms of odds a decade:

    - `none_level`, `none_slope`: where nothing is named, of the excess a line; the level is the
      excess at even odds. `determinant`: what share of the density's log determinant counts there
      as excess: the more of it a device needs, the likelier is something that is not hysteresis.
    - `named_level`, `named_excess`, `named_left`, `named_open`: where something is, of the excess
      a line, of the share of the excess that is left, and of the share of the gap on data held out
      that stays open; the level is the logarithm of the odds at 0.3, 0.03 and 0.05.
    - `most_unlisted`: the probability at most, where something is named that leaves too much: two
      effects together are not always found.
    - `nonsynchronous`: by what the excess a line of what does not repeat is multiplied.
    - `left_unknown`, `left_unknown_width`, `misfit_unknown`, `misfit_unknown_width`: where no run
      repeats, so that noise is unknown: the share of the excess that the right effects leave at
      most, the excess a line that a base may leave, and how sharply.
    """

    temperature: float
    form: float
    parameter: float
    chance: float
    none_level: float
    none_slope: float
    named_level: float
    named_excess: float
    named_left: float
    named_open: float
    nonsynchronous: float
    left_unknown: float
    left_unknown_width: float
    misfit_unknown: float
    misfit_unknown_width: float
    provenance: str
    widening: Mapping[str, float] = dataclasses.field(default_factory=dict)
    widening_provenance: str = ""
    reliability: tuple[Mapping[str, Any], ...] = ()
    hysteresis: float = 0.0
    second: float = 0.0
    determinant: float = 0.0
    law: float = 0.0
    most_unlisted: float = 1.0

    @classmethod
    def from_dict(cls, value: dict[str, Any]) -> "Calibration":
        """From what `to_dict` gave."""
        if value.get("schema") != SCHEMA:
            raise ValueError(f"Argument `value` must have the schema {SCHEMA}.")
        fields: dict[str, Any] = {k: v for k, v in value.items() if k != "schema"}
        fields["reliability"] = tuple(fields.get("reliability", ()))
        return cls(**fields)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, for a file."""
        return {"schema": SCHEMA, **dataclasses.asdict(self)}


@cache
def load_calibration() -> Calibration:
    """The calibration that this version comes with."""
    text = (
        files("fitting.diagnosis.which.evidence")
        .joinpath("calibration.json")
        .read_text(encoding="utf-8")
    )
    return Calibration.from_dict(json.loads(text))
