"""The base of simulated SCPI instruments: messages, handlers by header, status, answers."""

import abc
import math
from collections.abc import Callable, Collection

from hardware.servers._instrument import AbstractInstrument, Answer

from ._messages import Messages, MessageSplitter, TooLong, Unit, header_pattern, units
from ._quantities import parse_quantity
from ._status import ScpiFault, Status

# Bytes of answers that wait at once: four of the longest records. A message that asks for more is
# answered by nothing, and error -430.
MOST_ANSWERED = 1 << 25
Handler = Callable[[int, Unit], str | bytes | None]  # channel and unit to reply


class AbstractScpiInstrument(AbstractInstrument):
    """A state machine that obeys a table of commands.

    - `identity`: what it says it is. `channels`: the numbers that `{n}` in a header may be.
    - `ignores`: headers (upper case, as sent) of commands that it silently does not obey.
    - `lacks`: headers (the same) that it does not know.
    """

    def __init__(
        self,
        identity: str,
        channels: Collection[int],
        *,
        ignores: tuple[str, ...] = (),
        lacks: tuple[str, ...] = (),
    ) -> None:
        self.identity = identity
        self.ignores = ignores
        self._lacks = lacks
        self.status = Status()
        self._channels = channels
        self._messages = Messages()
        self._busy_s = 0.0  # its next answer comes so much later
        self._waiting_bytes = 0  # of answers to the message that is obeyed
        self._found: dict[str, tuple[int, Handler]] = {}
        common: dict[str, Handler] = {
            "*IDN?": lambda n, unit: self.identity,
            "*CLS": lambda n, unit: self.status.clear(),
            "*OPC?": lambda n, unit: "1",
            "*OPC": lambda n, unit: self.status.complete(),
            "*WAI": lambda n, unit: None,
            "*OPT?": lambda n, unit: "0",
            "*STB?": lambda n, unit: self.status.byte(self._waiting_bytes > 0),
            "*ESE": lambda n, unit: setattr(self.status, "event_mask", _mask(unit)),
            "*ESE?": lambda n, unit: str(self.status.event_mask),
            "*SRE": lambda n, unit: setattr(self.status, "service_mask", _mask(unit)),
            "*SRE?": lambda n, unit: str(self.status.service_mask),
            "*ESR?": lambda n, unit: self.status.event(),
            "SYSTem:ERRor[:NEXT]?": lambda n, unit: self.status.error(),
        }
        table = common | self.commands()
        self._handlers = [(header_pattern(spec), run) for spec, run in table.items()]

    @abc.abstractmethod
    def commands(self) -> dict[str, Handler]:
        """Handlers of its own by header, as manuals write it; `{n}` is the channel."""

    def splitter(self) -> MessageSplitter:
        """Of one client's program messages."""
        return MessageSplitter()

    def connected(self) -> None:
        """Drop a message that was not complete."""
        self._messages.clear()

    def feed(self, data: bytes) -> list[Answer]:
        """Answers to the messages that `data` completes; `MOST_ANSWERED` bytes at most."""
        answers, size = [], 0
        try:
            for message in self._messages.feed(data):
                reply = self._obey(message, MOST_ANSWERED - size)
                if reply:
                    size += len(reply)
                    wait, self._busy_s = self._busy_s, 0.0
                    answers.append(Answer(reply + b"\n", wait))
        except TooLong:
            self.status.report(-223)
        return answers

    def _obey(self, message: bytes, room: int) -> bytes:
        """The answers to a message, joined; none where they are longer than `room`."""
        replies: list[bytes] = []
        self._waiting_bytes, full = 0, False
        for unit in units(message):
            if full and unit is not None and unit.header.endswith("?"):
                continue
            reply = self._execute(unit)
            if reply is None:
                continue
            replies.append(reply)
            self._waiting_bytes += len(reply) + 1
            if self._waiting_bytes > room:
                self.status.report(-430)
                replies, full = [], True
        return b";".join(replies)

    def _execute(self, unit: Unit | None) -> bytes | None:
        try:
            if unit is None:
                raise ScpiFault(-102)
            if unit.header in self.ignores:
                return None
            n, run = self._find(unit.header)
            reply = run(n, unit)
            return reply.encode("latin-1") if isinstance(reply, str) else reply
        except ScpiFault as fault:
            self.status.report(fault.code, fault.detail)
            return None

    def _find(self, header: str) -> tuple[int, Handler]:
        known = self._found.get(header)
        if known is None:
            for pattern, run in self._handlers:
                if found := pattern.fullmatch(header):
                    known = int(found.groupdict().get("n") or 1), run
                    break
            if known is None or known[0] not in self._channels or header in self._lacks:
                raise ScpiFault(-113, header)
            self._found[header] = known
        return known


def one(unit: Unit) -> str:
    """The only parameter of a unit. Raises `ScpiFault`."""
    if len(unit.parameters) != 1 or unit.block is not None:
        raise ScpiFault(-108 if unit.parameters else -109)
    return unit.parameters[0]


def _mask(unit: Unit) -> int:
    return int(number(unit, 0.0, 255.0))


def number(unit: Unit, low: float = -math.inf, high: float = math.inf, quantity: str = "") -> float:
    """The only parameter, as a finite number from `low` to `high`, or one of these by name.

    `quantity`: the unit that may stand behind it (`parse_quantity`). Raises `ScpiFault`.
    """
    given = one(unit)
    ends = {"MIN": low, "MINIMUM": low, "MAX": high, "MAXIMUM": high}
    value = ends[given.upper()] if given.upper() in ends else parse_quantity(given, quantity)
    if not math.isfinite(value) or not low <= value <= high:
        raise ScpiFault(-222, f"{value:g}")
    return value


def boolean(unit: Unit) -> bool:
    """The only parameter, as on or off. Raises `ScpiFault`."""
    state = one(unit).upper()
    if state not in ("ON", "OFF", "1", "0"):
        raise ScpiFault(-224, state)
    return state in ("ON", "1")


def word(unit: Unit, known: Collection[str]) -> str:
    """The only parameter, one of `known` in its long or short form; the short form.

    The short form is the upper-case part, as manuals write it. Raises `ScpiFault`.
    """
    given = one(unit).upper()
    for name in known:
        short = "".join(c for c in name if not c.islower())
        if given in (name.upper(), short):
            return short
    raise ScpiFault(-224, given)
