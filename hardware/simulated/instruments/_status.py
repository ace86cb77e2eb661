"""IEEE 488.2 status of a simulated instrument: event register and error queue."""

_DETAIL = 80  # characters of an entry about what was wrong; a header may have a million
_QUEUE = 32  # entries; the last becomes "Queue overflow"

COMMAND, EXECUTION, DEVICE, QUERY = 32, 16, 8, 4  # bits of the event register

ERRORS = {
    -102: "Syntax error",
    -108: "Parameter not allowed",
    -109: "Missing parameter",
    -131: "Invalid suffix",
    -113: "Undefined header",
    -161: "Invalid block data",
    -221: "Settings conflict",
    -222: "Data out of range",
    -223: "Too much data",
    -224: "Illegal parameter value",
    -430: "Query DEADLOCKED",
    -350: "Queue overflow",
}


class ScpiFault(Exception):
    """A command that cannot be carried out; `code` is its SCPI number."""

    def __init__(self, code: int, detail: str = "") -> None:
        super().__init__(detail)
        self.code, self.detail = code, detail


class Status:
    """Event register (`*ESR?`), status byte (`*STB?`) and error queue (`SYSTem:ERRor?`).

    `event_mask`, `service_mask`: what `*ESE` and `*SRE` have set.
    """

    def __init__(self) -> None:
        self._event = 128  # power on
        self.event_mask = 0
        self.service_mask = 0
        self._queue: list[tuple[int, str]] = []

    def report(self, code: int, detail: str = "") -> None:
        """An error happened."""
        text = ERRORS.get(code, "Device-specific error")
        if len(self._queue) == _QUEUE:
            self._queue[-1] = (-350, ERRORS[-350])
        else:
            self._queue.append((code, f"{text}; {detail[:_DETAIL]}" if detail else text))
        hundreds = -code // 100
        self._event |= {1: COMMAND, 2: EXECUTION, 4: QUERY}.get(hundreds, DEVICE)

    def clear(self) -> None:
        """`*CLS`."""
        self._event = 0
        self._queue.clear()

    def complete(self) -> None:
        """`*OPC`: nothing is under way."""
        self._event |= 1

    def byte(self, answers_wait: bool) -> str:
        """`*STB?`: errors in the queue, an answer that waits, an event, and a request for service.

        After IEEE 488.2; bit 2 is SCPI's for the error queue.
        """
        value = 4 * bool(self._queue) + 16 * answers_wait + 32 * bool(self._event & self.event_mask)
        return str(value + 64 * bool(value & self.service_mask & ~64))

    def event(self) -> str:
        """`*ESR?`, which clears it."""
        value, self._event = self._event, 0
        return str(value)

    def error(self) -> str:
        """`SYSTem:ERRor?`, which takes the oldest entry away."""
        code, text = self._queue.pop(0) if self._queue else (0, "No error")
        quoted = text.replace('"', "'")
        return f'{code},"{quoted}"'
