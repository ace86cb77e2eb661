"""Levels and clamp of a channel moved in steps that are legal, small and slow enough."""

from hardware._errors import InstrumentError
from rapi_jax import DriveLimits

from ._levels import Levels, ramp_levels
from ._port import AfgPort
from ._restore import require_states
from ._states import COUPLINGS
from ._thresholds import THRESHOLDS


def ramp(port: AfgPort, goal: Levels, limits: DriveLimits) -> None:
    """The levels to `goal`, in steps and at a slew that `limits` allow; read back at the end."""
    step_v = min(THRESHOLDS.ramp_step_v, limits.step_v * THRESHOLDS.step_share)
    step_v = max(THRESHOLDS.least_step_v, step_v)
    now = port.levels()
    for levels in ramp_levels(now, goal, step_v):
        began = port.scpi.now()
        port.move_levels(now, levels)
        moved = max(abs(levels.low_v - now.low_v), abs(levels.high_v - now.high_v))
        port.scpi.sleep(moved / limits.slew_v_per_s - (port.scpi.now() - began))
        now = levels
    port.set_levels(now, goal)  # nothing is left to move: they are read back


def ramp_to_park(port: AfgPort, park: Levels, limits: DriveLimits) -> None:
    """To park; where that fails and another user had coupled the channels, decoupled first.

    A level that the other channel cannot take is refused for both.
    """
    try:
        ramp(port, park, limits)
    except InstrumentError:
        if not require_states(port, COUPLINGS):
            raise
        ramp(port, park, limits)


def move_clamp(port: AfgPort, limits: DriveLimits, park: Levels) -> None:
    """The instrument's clamp to `limits`, and the levels to `park`; both are read back."""
    clamp = port.clamp()
    if limits.low_v < clamp.low_v:  # widen, move the levels, narrow: legal at every step
        port.set_clamp_low(limits.low_v)
    if limits.high_v > clamp.high_v:
        port.set_clamp_high(limits.high_v)
    port.set_levels(port.levels(), park)
    if limits.low_v > clamp.low_v:
        port.set_clamp_low(limits.low_v)
    if limits.high_v < clamp.high_v:
        port.set_clamp_high(limits.high_v)
    port.check_clamp(limits.low_v, limits.high_v)
