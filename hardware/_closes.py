"""What is closed when its block is left, however it is left."""

import abc
import contextlib
from types import TracebackType


class ClosesOnExit(contextlib.AbstractContextManager):
    """A context manager by its `close`."""

    @abc.abstractmethod
    def close(self) -> None:
        """Let go of what is held."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
