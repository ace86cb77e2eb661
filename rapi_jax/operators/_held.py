"""Parameters of the RA-PI family that a recording cannot determine, and that a fit holds."""

import jax.numpy as jnp

from rapi_jax._recording import Recording

from ._base import AbstractOperator
from ._thresholds import THRESHOLDS


def one_kind_of_scan(recording: Recording) -> bool:
    """Whether all runs have one scan rate and one amplitude."""
    digits = THRESHOLDS.amplitude_digits
    return len({(d.rate, round(d.u_pp, digits)) for d in recording.drives}) == 1


def held_thresholds(operator: AbstractOperator, recording: Recording) -> set[str]:
    """`eta` or `alpha`, and `zeta`, where the recording leaves the scale of thresholds open.

    Only `r (1 + eta)` and `b r` are seen in one scan, up to an offset. So with one rate and
    amplitude, or an origin of its own for every run, `eta` is held (where it has a value for each
    play, `alpha`). Where no run has a scan rate, `zeta` is held too.
    """
    held = set()
    if one_kind_of_scan(recording) or recording.response_origin == "run":
        held.add("alpha" if jnp.ndim(getattr(operator, "eta")) > 0 else "eta")  # noqa: B009
    if max(recording.rates) == 0:
        held.add("zeta")
    return held
