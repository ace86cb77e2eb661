"""A drive of counted periods: the instrument ends it by itself, whatever becomes of the computer.

Before and after its periods the output rests at the drive's first value, so that beginning and end
are steps of the drive itself.
"""

from . import _commands as commands
from ._port import AfgPort
from ._settings import Due
from ._states import BURST, BURST_OFF, BURST_ON, State


class Burst:
    """`cycles` periods after each `fire`, by triggered bursts of one channel."""

    states: tuple[State, ...] = (BURST_ON, *BURST)

    def __init__(self, port: AfgPort, cycles: int) -> None:
        self._port, self.cycles = port, cycles
        self._fired_s: float | None = None

    def due(self) -> tuple[Due, Due]:
        """The count, and no delay after the trigger."""
        return Due(commands.BURST_CYCLES, self.cycles, 0.0), Due(commands.BURST_DELAY, 0.0, 0.0)

    def arm(self) -> None:
        """Wait for `fire`, at rest; a burst that still goes on ends."""
        port, self._fired_s = self._port, None
        port.require(BURST_OFF)
        for state in BURST:
            port.require(state)
        port.set_number(commands.BURST_CYCLES, self.cycles)
        port.set_number(commands.BURST_DELAY, 0)
        port.require(BURST_ON)

    def fire(self) -> None:
        """Begin; nothing waits for the end."""
        self._fired_s = self._port.scpi.now()
        self._port.scpi.command(commands.TRIGGER, wait=False)

    def playing_s(self, frequency_hz: float) -> float:
        """How much longer it certainly plays at this rate, s; 0 before `fire`."""
        if self._fired_s is None:
            return 0.0
        return max(0.0, self._fired_s + self.cycles / frequency_hz - self._port.scpi.now())


def checked_cycles(cycles: int | None) -> int | None:
    """The count of a burst. Raises `ValueError` for one that the instrument cannot have."""
    if cycles is not None and not 1 <= cycles <= commands.MOST_CYCLES:
        raise ValueError(
            f"Argument `cycles` must be 1 to {commands.MOST_CYCLES}, but is {cycles}: the "
            "instrument counts no further."
        )
    return cycles
