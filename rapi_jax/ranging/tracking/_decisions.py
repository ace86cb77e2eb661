"""Decisions on scans: sign and outliers as the other scans have them, and a filter's columns."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from . import _kalman
from ._hypotheses import Best


@dataclasses.dataclass(frozen=True, eq=False)
class ScanVerdict:
    """Of each scan, by the others: its sign, whether that is open, whether it is an outlier."""

    sign: np.ndarray
    open_sign: np.ndarray
    outlier: np.ndarray


def judge_scans(apparent, expected, spread, limits) -> ScanVerdict:
    """Judge each scan by what the others expect of it (`leave_one_out`)."""
    from scipy import special

    sign = np.where(expected < 0, -1, 1)
    # Odds of the two signs: normal densities at +-y about the expected value.
    open_sign = 2.0 * apparent * np.abs(expected) / spread < np.log(limits.fold_odds)
    gate = 2.0 * special.erfcinv(limits.gate) ** 2  # chi-square of one degree of freedom
    misfit = (sign * apparent - expected) ** 2 / spread
    # An outlier spoils its neighbours, so that they are judged once it is gone.
    around = np.lib.stride_tricks.sliding_window_view(np.pad(misfit, 2), 5).max(axis=1)
    return ScanVerdict(sign, open_sign, (misfit > gate) & (misfit == around))


def to_choice(apparent, sign, use, best: Best, size, limits) -> _kalman.Choice:
    """Decisions as padded columns; motion is free across gated scans beside a change."""
    change = best.change.copy()
    silent = ~best.use
    for k in np.flatnonzero(best.change):  # the change may have come at any scan gated before it
        j = k - 1
        while j > 0 and silent[j]:
            change[j] = 1
            j -= 1
    j = size - 1
    while j > 0 and silent[j]:  # at the end: nothing later says whether the motion went on
        change[j] = 1
        j -= 1
    change[0] = 0
    more = (0, apparent.size - size)
    signed = apparent * jnp.asarray(np.pad(sign.astype(float), more))
    manoeuvre = np.pad(np.where(change > 0, limits.velocity_spread, 0.0), more)
    jump = np.pad(np.where(change == 2, limits.distance_spread, 0.0), more)
    return _kalman.Choice(
        signed, jnp.asarray(np.pad(use, more)), jnp.asarray(manoeuvre), jnp.asarray(jump)
    )
