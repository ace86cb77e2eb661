"""Quantities that follow from fitted parameters, with their standard errors."""

from typing import Any

import numpy as np

from fitting.diagnosis.refit._effect_vector import Effects
from rapi_jax import Recording
from rapi_jax.effects import ScanRange


def derive_quantities(
    effects: Effects, found: dict[str, dict[str, Any]], recording: Recording
) -> dict[str, dict[str, Any]]:
    """`{name: {value, stderr, unit}}` from parameters `found`; with several effects as these are.

    The standard error is half the difference between one standard error more and less, so that
    it holds where the quantity bends; it is infinite where a pole lies between them. What is not
    finite is left out.
    """
    drives = recording.drives
    whole = max(float(d.value.max()) for d in drives) - min(float(d.value.min()) for d in drives)
    scan = ScanRange(whole, max(recording.rates))
    several, out = len(effects) > 1, {}
    for effect in effects:
        for derived in effect.derived(scan):
            prefix = f"{effect.name}." if several else ""
            p = found.get(prefix + derived.parameter)
            if p is None or (derived.optical and recording.response_unit != "GHz"):
                continue
            error = p["stderr"]
            with np.errstate(all="ignore"):
                value = float(derived.of(np.float64(p["value"])))
                ends = [
                    float(derived.of(np.float64(p["value"] + sign * error))) for sign in (1, -1)
                ]
            # A quantity that is not between its ends has a pole there: the data do not tell it.
            between = min(ends) <= value <= max(ends)
            spread = abs(ends[0] - ends[1]) / 2.0 if between and np.isfinite(error) else np.inf
            if np.isfinite(value):
                out[prefix + derived.name] = {
                    "value": value,
                    "stderr": spread if np.isfinite(spread) else float("inf"),
                    "unit": derived.unit,
                }
    return out
