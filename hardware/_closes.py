"""Context managers that are closed when their block is left, however it is left."""

import abc
import contextlib
from types import TracebackType


class ClosesOnExit(contextlib.AbstractContextManager):
    """A context manager by its `close`."""

    @abc.abstractmethod
    def close(self) -> None:
        """Release what is held."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
