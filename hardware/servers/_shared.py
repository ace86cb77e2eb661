"""One instrument that several clients address: whole messages, one at a time."""

import threading
from collections.abc import Iterator

from ._instrument import AbstractInstrument, Answer


class SharedInstrument:
    """Gives each client's messages to the instrument whole, so that none mixes with another's."""

    def __init__(self, instrument: AbstractInstrument) -> None:
        self.instrument = instrument
        self._lock = threading.Lock()

    def connected(self) -> None:
        """A client connects, or clears the instrument."""
        with self._lock:
            self.instrument.connected()

    def feed(self, message: bytes) -> Iterator[Answer]:
        """Answers to one message, each computed while no other client is heard."""
        with self._lock:
            answers = iter(self.instrument.feed(message))
        while True:
            with self._lock:
                answer = next(answers, None)
            if answer is None:
                return
            yield answer
