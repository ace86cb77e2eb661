"""A connection to a simulated instrument in the same process, on a simulated clock."""

from collections.abc import Iterator

from hardware._errors import disconnected, timed_out
from hardware.links._link import AbstractLink, Received
from hardware.servers._instrument import AbstractInstrument, Answer

_PIECE = 4096  # bytes fed at once, as a network cuts them


class Clock:
    """A simulation's own time, s: that of one link, or shared by several."""

    def __init__(self) -> None:
        self.s = 0.0

    def __call__(self) -> float:
        """The time now, s."""
        return self.s

    def sleep(self, seconds: float) -> None:
        """Time passes at once."""
        self.s += max(seconds, 0.0)


class SimulatedLink(AbstractLink):
    """A connection to `instrument`; waiting moves its clock on.

    - `clock`: shared with others; by default one of its own.
    - `per_byte_s`: of traffic either way. `ends`: whether the transport marks where messages end,
      as HiSLIP and USB do and a raw socket does not.
    - `sent`: every byte sent, in order, where `keep` is set: a dry run's record.
    """

    def __init__(
        self,
        instrument: AbstractInstrument,
        *,
        resource: str = "SIM::INSTR",
        clock: Clock | None = None,
        per_byte_s: float = 0.0,
        ends: bool = False,
        keep: bool = False,
    ) -> None:
        self.resource = resource
        self.clock = Clock() if clock is None else clock
        self.sent = bytearray()
        self.connections = 1
        self._instrument = instrument
        self._per_byte_s, self._ends, self._keep = per_byte_s, ends, keep
        self._fresh()

    @property
    def clock_s(self) -> float:
        """The time now, s."""
        return self.clock.s

    @clock_s.setter
    def clock_s(self, value: float) -> None:
        self.clock.s = value

    def now(self) -> float:
        """The simulation's own time, s."""
        return self.clock_s

    def sleep(self, seconds: float) -> None:
        """Time passes at once."""
        self.clock.sleep(seconds)

    def send(self, data: bytes, deadline: float) -> None:
        """Feed the instrument."""
        began = self.clock_s
        for at in range(0, len(data), _PIECE):
            piece = data[at : at + _PIECE]
            self._arrive()
            if self._hung_up:
                raise disconnected()
            self._pass(self._per_byte_s * len(piece), began, deadline)
            if self._deaf:
                self._pass(deadline - self.clock_s + 1e-9, began, deadline)
            if self._keep:
                self.sent += piece
            self._queue(self._instrument.feed(piece))

    def receive(self, count: int, deadline: float) -> Received:
        """What has come; where nothing has, time passes until something does."""
        began = self.clock_s
        self._arrive()
        while not self._inbox:
            if self._hung_up:
                raise disconnected()
            if self._next is None or self._due > deadline:
                self._pass(deadline - self.clock_s + 1e-9, began, deadline)
            self.clock_s = max(self.clock_s, self._due)
            self._arrive()
        data = bytes(self._inbox[:count])
        self._pass(self._per_byte_s * len(data), began, deadline)
        del self._inbox[:count]
        end = self._ends and not self._inbox and self._next is None and data.endswith(b"\n")
        return Received(data, end)

    def unread(self) -> bytes:
        """What has come and was not read."""
        self._arrive()
        if self._hung_up and not self._inbox:
            raise disconnected()
        return bytes(self._inbox[:64])

    def reconnect(self, deadline: float) -> None:
        """A new connection; late answers go to the old one."""
        self._fresh()
        self.connections += 1

    def close(self) -> None:
        """Hang up."""
        self._fresh()
        self._hung_up = True

    def _fresh(self) -> None:
        self._inbox = bytearray()
        self._answers: list[Iterator[Answer]] = []
        self._next: Answer | None = None
        self._due = 0.0
        self._hung_up = self._deaf = False
        self._instrument.connected()

    def _queue(self, answers) -> None:
        self._answers.append(iter(answers))
        self._look()

    def _look(self) -> None:
        """Draw the next answer, where none waits."""
        while self._next is None and self._answers:
            self._next = next(self._answers[0], None)
            if self._next is None:
                self._answers.pop(0)
            else:
                self._due = self.clock_s + self._next.after_s

    def _arrive(self) -> None:
        """Take in what is due; an endless peer fills only what a socket would hold."""
        while self._next is not None and self._due <= self.clock_s and len(self._inbox) < 1 << 16:
            answer, self._next = self._next, None
            self._inbox += answer.data
            self._hung_up |= answer.hang_up
            self._deaf |= answer.deaf
            due = self._due
            self._look()
            if self._next is not None:
                self._due = max(due, self.clock_s) + self._next.after_s

    def _pass(self, seconds: float, began: float, deadline: float) -> None:
        self.clock_s += max(seconds, 0.0)
        if self.clock_s > deadline:
            raise timed_out(deadline - began)
