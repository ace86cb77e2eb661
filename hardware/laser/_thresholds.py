"""Numbers that decide how a laser is moved, and which setting counts as taken."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class LaserThresholds:
    """Numbers that decide how a laser is moved, and which setting counts as taken."""

    piezo_step_percent: float = threshold(
        1.0,
        unit="% of the range",
        origin="largest change of the piezo at once: one that jumps creeps; set by trial",
    )
    piezo_rounding_percent: float = threshold(
        1e-9, unit="% of the range", origin="rounding of floats"
    )
    wavelength_error_nm: float = threshold(
        0.02, unit="nm", origin="how near the sensed wavelength must come; set by trial"
    )
    wavelength_tolerance_nm: float = threshold(
        5.1e-3, unit="nm", origin="half a step of 0.01 nm, in which it is written"
    )
    piezo_tolerance_percent: float = threshold(
        0.051,
        unit="% of the range",
        origin="half a step of 0.1 % and rounding; set by trial",
    )
    current_tolerance_ma: float = threshold(
        0.11, unit="mA", origin="one step of 0.1 mA, in which it is written"
    )
    switch_s: float = threshold(
        30.0, unit="s", origin="longest that the head may take to switch; set by trial"
    )
    on_delay_s: float = threshold(
        60.0,
        unit="s",
        origin="longest delay of emission that the controller can be set to (`ONDELAY`)",
    )
    identity_tries: int = threshold(
        3, unit="queries", origin="of an identity that comes cut; set by trial"
    )
    poll_s: float = threshold(
        0.05, unit="s", origin="between two queries whether a move is done; set by trial"
    )
    wrong_token_s: float = threshold(
        1.0, unit="s", origin="before a bridge answers a wrong token: slows down guessing"
    )
    most_faults: int = threshold(
        100, unit="faults", origin="a longer queue is taken for one without end; set by trial"
    )


THRESHOLDS = LaserThresholds()
