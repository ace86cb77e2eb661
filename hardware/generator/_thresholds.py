"""Numbers that decide how an output is moved, and which setting counts as taken."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class GeneratorThresholds:
    """Numbers that decide how an output is moved, and which setting counts as taken."""

    ramp_step_v: float = threshold(
        0.05,
        unit="V",
        origin="largest change of a level at once while the output is on; set by trial",
    )
    least_step_v: float = threshold(
        1e-3,
        unit="V",
        origin="smallest step of that ramp, whatever the limits: ten steps of the instrument's "
        "grid",
    )
    step_share: float = threshold(
        0.5,
        unit="of `step_v`",
        origin="the ramp stays below the device's limit by this; set by trial",
    )
    park_pp_v: float = threshold(
        0.004,
        unit="V",
        origin="what the output still moves by when it is parked: twice the least the instrument "
        "can set",
    )
    grid_rounding: float = threshold(1e-6, unit="steps of the grid", origin="rounding of floats")
    slope_rounding: float = threshold(
        1e-9, unit="of the limits' range", origin="rounding of floats"
    )
    least_frequency_hz: float = threshold(
        1e-3, unit="Hz", origin="lowest rate that is played; set by trial"
    )
    upload_bytes_per_s: float = threshold(
        5e4, unit="bytes/s", origin="a slow line: what an upload may take beyond the usual time"
    )
    load_tolerance: float = threshold(
        1e-3, unit="of the load", origin="a load is read back with four digits"
    )
    level_tolerance: float = threshold(
        1.01, unit="steps of the grid", origin="a level may be rounded inward by one step"
    )
    clamp_tolerance_v: float = threshold(
        1e-6, unit="V", origin="a clamp must be exact but for rounding of floats"
    )
    frequency_tolerance: float = threshold(
        1e-6,
        unit="of the rate, and Hz",
        origin="the instrument sets rates in steps of 1 uHz, or six digits",
    )


THRESHOLDS = GeneratorThresholds()
