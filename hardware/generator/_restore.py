"""A generator that another user has left somehow, brought into the states that a scan needs."""

from collections.abc import Iterable

from hardware._errors import InstrumentError

from . import _commands as commands
from ._port import AfgPort
from ._states import SEQUENCE, State


def require_states(port: AfgPort, states: Iterable[State]) -> tuple[str, ...]:
    """Bring the channel into `states`, each read back; the headers of those that differed."""
    return tuple(port.name(state.header) for state in states if port.require(state))


def leave_sequence_mode(port: AfgPort) -> tuple[str, ...]:
    """Back to basic mode, with the output off; as `require_states`.

    Raises `InstrumentError` where a sequence plays on another channel, which this would end.
    """
    if port.has(SEQUENCE):
        return ()
    for n in commands.CHANNELS:
        if n != port.n and port.output_of(n):
            raise InstrumentError(
                port.scpi.resource,
                f"{SEQUENCE.header}?",
                "1",
                why=f"The instrument plays a sequence on channel {n}, and basic mode would end it.",
                cure="Nothing was set. Ask who uses it; then switch that output off, or leave "
                "sequence mode at the front panel.",
            )
    port.switch(False)  # its levels are not those of basic mode: there is nothing to ramp
    return require_states(port, (SEQUENCE,))
