"""Faulty peers: wrappers around an instrument, each with one fault."""

import abc
import dataclasses
import itertools
from collections.abc import Iterable, Iterator

from hardware.servers._instrument import AbstractInstrument, AbstractSplitter, Answer


class AbstractFault(abc.ABC):
    """A change of an instrument's answers."""

    @abc.abstractmethod
    def __call__(self, answers: Iterable[Answer]) -> Iterable[Answer]:
        """The answers that are given instead."""


@dataclasses.dataclass(frozen=True)
class Silent(AbstractFault):
    """Nothing is answered."""

    def __call__(self, answers: Iterable[Answer]) -> Iterable[Answer]:
        """Obey, and answer nothing."""
        for _ in answers:
            pass
        return ()


@dataclasses.dataclass(frozen=True)
class Slow(AbstractFault):
    """Every answer comes late, `pieces` bytes at a time, each `seconds` after the one before."""

    seconds: float
    pieces: int = 1 << 30

    def __call__(self, answers: Iterable[Answer]) -> Iterator[Answer]:
        """The same bytes, later."""
        for answer in answers:
            for at in range(0, len(answer.data), self.pieces):
                yield Answer(answer.data[at : at + self.pieces], answer.after_s + self.seconds)


@dataclasses.dataclass(frozen=True)
class Closing(AbstractFault):
    """The connection ends after `kept` bytes of the answer."""

    kept: int = 0

    def __call__(self, answers: Iterable[Answer]) -> Iterator[Answer]:
        """A part, and the end."""
        data = b"".join(answer.data for answer in answers)
        yield Answer(data[: self.kept], hang_up=True)


@dataclasses.dataclass(frozen=True)
class Cut(AbstractFault):
    """Only `kept` bytes of the answer come: half a line, half a block."""

    kept: int

    def __call__(self, answers: Iterable[Answer]) -> Iterator[Answer]:
        """A part, and silence."""
        data = b"".join(answer.data for answer in answers)
        yield Answer(data[: self.kept])


@dataclasses.dataclass(frozen=True)
class Instead(AbstractFault):
    """Other bytes come: a lying block header, noise, an answer to something else."""

    data: bytes

    def __call__(self, answers: Iterable[Answer]) -> Iterator[Answer]:
        """What was given, whatever was asked."""
        for _ in answers:
            pass
        yield Answer(self.data)


@dataclasses.dataclass(frozen=True)
class Endless(AbstractFault):
    """Bytes without end, a piece every `seconds`."""

    piece: bytes = b"7" * 512
    seconds: float = 0.0

    def __call__(self, answers: Iterable[Answer]) -> Iterator[Answer]:
        """For ever."""
        for _ in answers:
            pass
        return itertools.repeat(Answer(self.piece, self.seconds))


class Faulty(AbstractInstrument):
    """An instrument whose answer is spoilt when it is asked something.

    - `when`: the fault strikes at bytes that hold this, from the `after`-th time on, `times` times.
    """

    def __init__(
        self,
        instrument: AbstractInstrument,
        fault: AbstractFault,
        *,
        when: bytes = b"",
        after: int = 0,
        times: int = 1 << 30,
    ) -> None:
        self.instrument = instrument
        self._fault = fault
        self._when, self._left, self._times = when, after, times

    def splitter(self) -> AbstractSplitter:
        """The instrument's."""
        return self.instrument.splitter()

    def connected(self) -> None:
        """A new connection."""
        self.instrument.connected()

    def feed(self, data: bytes) -> Iterable[Answer]:
        """The instrument's answers, or the fault's."""
        answers = self.instrument.feed(data)
        if self._when not in data or not self._times:
            return answers
        if self._left:
            self._left -= 1
            return answers
        self._times -= 1
        return self._fault(answers)


class Unplugged(AbstractInstrument):
    """An instrument that is gone after it has taken `bytes_taken` bytes, in the midst of a message.

    `deaf`: it stops reading instead of hanging up. With `comes_back` it works again when connected
    to anew.
    """

    def __init__(
        self,
        instrument: AbstractInstrument,
        bytes_taken: int,
        *,
        deaf: bool = False,
        comes_back: bool = False,
    ) -> None:
        self.instrument = instrument
        self._left: float = bytes_taken
        self._deaf, self._comes_back = deaf, comes_back
        self._gone = False

    def connected(self) -> None:
        """A new connection."""
        if self._gone and self._comes_back:
            self._left, self._gone = float("inf"), False
        self.instrument.connected()

    def feed(self, data: bytes) -> Iterable[Answer]:
        """Answers as long as it is there."""
        if len(data) < self._left:
            self._left -= len(data)
            return self.instrument.feed(data)
        if not self._gone:
            self.instrument.feed(data[: int(self._left)])
            self._left, self._gone = 0.0, True
        return [Answer(b"", hang_up=not self._deaf, deaf=self._deaf)]
