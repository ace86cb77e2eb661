"""Numbers that decide how the places of jumps are searched."""

import dataclasses

from rapi_jax.internal import threshold

_TRIAL = "set by trial"


@dataclasses.dataclass(frozen=True)
class JumpThresholds:
    """Which jumps are segmented, and how finely their parameters are searched."""

    jump_size: float = threshold(
        5.0, unit="standard deviations of a reading", origin="a smaller jump hides in the noise"
    )
    pattern_steps: tuple[float, ...] = threshold(
        (3.0, 1.0, 0.5, 0.2, 0.06, 0.02, 0.006, 0.002, 0.0006, 0.0002, 6e-5, 2e-5),
        unit="of a parameter's size",
        origin=f"{_TRIAL}; steps of the coordinate search, about a factor of 3 apart",
    )
    zero_parameter_size: float = threshold(
        0.5, unit="of the parameter", origin=f"{_TRIAL}; size of one that is 0"
    )
    simplex_widths: tuple[float, ...] = threshold(
        (5e-4, 5e-5), unit="of a parameter's size", origin=f"{_TRIAL}; initial simplices"
    )
    simplex_tolerance: float = threshold(
        1e-8, unit="of a parameter's size", origin=f"{_TRIAL}; at which a simplex has converged"
    )
    simplex_evaluations: int = threshold(
        30, unit="evaluations a parameter", origin=f"{_TRIAL}; more cost time"
    )
    simplex_excess: float = threshold(
        0.7,
        unit="of the excess without the effect",
        origin=f"{_TRIAL}; what leaves more needs no exact jump",
    )


THRESHOLDS = JumpThresholds()
