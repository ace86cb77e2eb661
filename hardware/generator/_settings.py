"""All settings that an output depends on: read from the instrument, compared with those due."""

import math
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from hardware._errors import InstrumentError
from hardware.links import _reply

from . import _commands as commands
from ._levels import Levels, level_step
from ._port import AfgPort
from ._states import BURST_OFF, CONTINUOUS, COUPLINGS, SEQUENCE, State
from ._thresholds import THRESHOLDS

STATES = (SEQUENCE, *COUPLINGS, *CONTINUOUS)
_NUMBERS = (
    commands.FREQUENCY, commands.LOW, commands.HIGH, commands.CLAMP_LOW, commands.CLAMP_HIGH,
    commands.LOAD,
)  # fmt: skip
_TEXTS = (
    commands.OUTPUT, commands.SHAPE, commands.TRIGGER_SOURCE, commands.TRIGGER_OUTPUT,
    commands.REFERENCE,
)  # fmt: skip


class Due(NamedTuple):
    """A number that a setting must be: within `tolerance`, of its own unit."""

    header: str
    value: float
    tolerance: float


def read_settings(port: AfgPort, more: Iterable[str] = ()) -> dict[str, str]:
    """Every setting that the output depends on, by its header, as the instrument tells it.

    `more`: headers beside those of an output without a burst.
    """
    settings = {port.name(state.header): port.tell(state) for state in STATES}
    for header in (*_NUMBERS, *_TEXTS, *more):
        name = port.name(header)
        if name not in settings:
            settings[name] = port.scpi.text(name + "?")
    points = port.name(commands.POINTS)
    return settings | {points.replace("?", ""): port.scpi.text(points)}


def check_states(port: AfgPort, settings: Mapping[str, str], states: Iterable[State]) -> None:
    """Raise `InstrumentError` for a state that another user has changed."""
    for state in states:
        header = port.name(state.header)
        if not state.holds(settings[header]):
            raise _changed(port, header, settings[header], state.value, state.otherwise)


def check_numbers(port: AfgPort, settings: Mapping[str, str], due: Iterable[Due]) -> None:
    """Raise `InstrumentError` for a number that another user has changed."""
    for one in due:
        header = port.name(one.header).replace("?", "")
        try:
            read = _reply.number(settings[header].replace(" ", ""))
        except ValueError:
            read = math.nan
        same = read == one.value or abs(read - one.value) <= one.tolerance
        if not same:
            wrong = "The scan would be another one than was asked for."
            raise _changed(port, header, settings[header], f"{one.value:g}", wrong)


def due_states(port: AfgPort, on: bool, burst: Collection[State] = ()) -> tuple[State, ...]:
    """The states of an output that plays its own memory, or will once it is switched `on`.

    `burst`: those of a burst, where it plays one.
    """
    pattern = commands.memory_pattern(port.n)
    other = "The waveform that is played is not the loaded one."
    memory = State(commands.SHAPE, f"EMEM{port.n}", pattern, other)
    value = str(int(on))
    states = [one for one in STATES if not (burst and one is BURST_OFF)]
    return (
        *states,
        *burst,
        memory,
        State(commands.OUTPUT, value, value, "The output was switched."),
    )


def due_levels(levels: Levels) -> tuple[Due, Due]:
    """The levels, to a step of the instrument's grid."""
    near = THRESHOLDS.level_tolerance
    return (
        Due(commands.LOW, levels.low_v, near * level_step(levels.low_v)),
        Due(commands.HIGH, levels.high_v, near * level_step(levels.high_v)),
    )


def due_waveform(frequency_hz: float, points: int) -> tuple[Due, Due]:
    """The rate, and the length of the memory that is played."""
    near = THRESHOLDS.frequency_tolerance
    return (
        Due(commands.FREQUENCY, frequency_hz, near * frequency_hz + near),
        Due(commands.POINTS, points, 0.0),
    )


def due_limits(low_v: float, high_v: float, load_ohm: float) -> tuple[Due, Due, Due]:
    """The instrument's clamp, and the load that it reckons with."""
    near_ohm = 0.0 if math.isinf(load_ohm) else THRESHOLDS.load_tolerance * load_ohm
    return (
        Due(commands.LOAD, load_ohm, near_ohm),
        Due(commands.CLAMP_LOW, low_v, THRESHOLDS.clamp_tolerance_v),
        Due(commands.CLAMP_HIGH, high_v, THRESHOLDS.clamp_tolerance_v),
    )


def _changed(port: AfgPort, header: str, read: str, due: str, otherwise: str) -> InstrumentError:
    return InstrumentError(
        port.scpi.resource,
        f"{header}?",
        read,
        why=f"It should be {due}: somebody else has changed the setting. {otherwise}",
        cure="The output is parked and off, and this scan is not kept. See who else "
        "operates the generator, at its front panel or over the network, and measure again.",
    )
