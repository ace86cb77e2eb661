"""Errors of instruments and of the connections to them."""

from rapi_jax.io import printable

_SHOWN = 120  # characters of a command or reply in a message


def escape(data: bytes | str) -> str:
    """`data` on one line for a log or a terminal: control characters escaped, the middle cut."""
    if isinstance(data, bytes):
        head, tail = data[: 2 * _SHOWN], data[-2 * _SHOWN :]
        data = (head if len(data) <= 2 * _SHOWN else head + tail).decode(
            "ascii", "backslashreplace"
        )
    return printable(data.rstrip("\r\n"), _SHOWN)


class InstrumentError(Exception):
    """An instrument failed, or did not obey.

    - `resource`: address of the instrument. `command`: what was sent to it, empty where nothing
      was sent.
    - `reply`: what came back, empty where nothing did.

    All three are safe to print: control characters are escaped and long texts are cut.

    >>> from hardware import InstrumentError
    >>> error = InstrumentError("GEN", "*IDN?", "", why="it did not answer", cure="Switch it on.")
    >>> error.resource, error.command
    ('GEN', '*IDN?')
    """

    def __init__(
        self, resource: str, command: bytes | str, reply: bytes | str, *, why: str, cure: str
    ) -> None:
        """`why`: the likely cause; `cure`: what to do. Both are sentences."""
        self.resource = escape(resource)
        self.command = escape(command)
        self.reply = escape(reply)
        came = f"and '{self.reply}' came back" if self.reply else "and nothing usable came back"
        sent = f"sent '{self.command}', {came}. " if self.command else ""
        super().__init__(f"{self.resource}: {sent}{why} {cure}")


class LinkError(Exception):
    """A connection that failed; a session turns it into an `InstrumentError`.

    `why` and `cure` are sentences; `received` is what had come before.

    >>> from hardware import LinkError
    >>> error = LinkError("the connection was closed", "Connect again.")
    >>> isinstance(error, Exception)
    True
    """

    def __init__(self, why: str, cure: str, received: bytes = b"") -> None:
        super().__init__(why)
        self.why, self.cure, self.received = why, cure, received


def timed_out(seconds: float, received: bytes = b"") -> LinkError:
    """The error of a deadline that has passed."""
    part = "only a part of an answer" if received else "no answer"
    return LinkError(
        f"There was {part} within {seconds:g} s: the instrument is busy, off or not connected.",
        "Look at its display and cable, or allow a longer `timeout_s`.",
        received,
    )


def disconnected(received: bytes = b"") -> LinkError:
    """The error of a connection that the other side has closed."""
    return LinkError(
        "The connection was closed by the other side, or nothing listens there.",
        "Check the address, and that no other program holds the instrument; then connect again.",
        received,
    )
