"""Whether the replies on a connection still belong to the queries that were sent."""

import contextlib
from collections.abc import Iterator

from hardware._errors import InstrumentError, LinkError


class Synchronisation:
    """`lost` after any call that did not end well: an answer to it may still be on its way."""

    def __init__(self, resource: str) -> None:
        self._resource = resource
        self.lost = False

    @contextlib.contextmanager
    def call(self, command: str) -> Iterator[None]:
        """One exchange that `command` names. Raises `InstrumentError` for a `LinkError`."""
        try:
            yield
        except LinkError as error:
            self.lost = True
            raise InstrumentError(
                self._resource, command, error.received, why=error.why, cure=error.cure
            ) from error
        except BaseException:  # an interrupt too
            self.lost = True
            raise
