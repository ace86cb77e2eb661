"""The controller's side of a TLB-6700: every command is answered, and looked at for faults."""

import re

from hardware._errors import InstrumentError
from hardware.links import _reply

from . import _commands as commands
from ._link import AbstractLaserLink
from ._thresholds import THRESHOLDS


class LaserPort:
    """Commands and queries without any policy; `TLB6700` decides what may be set when."""

    def __init__(self, link: AbstractLaserLink) -> None:
        self.link = link

    def set(
        self,
        template: str,
        value: str = "",
        expected: float | None = None,
        tolerance: float = 0.0,
    ) -> None:
        """Send, see `OK` and no fault, and read back where a number is `expected`."""
        command = f"{template} {value}".rstrip()
        reply = self.link.query(command)
        if reply != "OK":
            faults = self.faults()
            raise self.error(
                command, "; ".join([reply, *map(_format_fault, faults)]), *_remedy(faults)
            )
        self.check_status(command)
        if expected is not None:
            read = self.number(f"{template}?")
            if not abs(read - expected) <= tolerance:
                raise self.error(
                    command,
                    f"{read:g}",
                    "The controller has another setting than the one it was given.",
                    "See whether someone else operates it.",
                )

    def check_status(self, command: str) -> None:
        """Raise where a fault waits."""
        status = self.text(
            commands.STATUS, r"\+?\d{1,3}", "The status must be a number from 0 to 255."
        )
        if int(status):
            faults = self.faults()
            listed = "; ".join(map(_format_fault, faults)) or f"{commands.STATUS} {status}"
            raise self.error(command, listed, *_remedy(faults))

    def faults(self) -> list[tuple[int, str]]:
        """Take all entries out of the fault queue."""
        found = []
        for _ in range(THRESHOLDS.most_faults):
            line = self.link.query(commands.ERROR)
            try:
                entry = commands.fault(line)
            except ValueError as error:
                raise self.error(
                    commands.ERROR,
                    line,
                    f"The answer cannot be used: {error}.",
                    "Read the display of the controller, and connect again.",
                ) from None
            if entry[0] == 0:
                return found
            found.append(entry)
        raise self.error(
            commands.ERROR, "", "The fault queue does not end.", "Restart the controller."
        )

    def wait_until_done(self, seconds: float) -> None:
        """Until nothing moves any more, `seconds` at the longest."""
        until = self.link.now() + seconds
        while self.text(commands.DONE, r"[01]", "The answer must be 0 or 1.") != "1":
            self.check_status(commands.DONE)
            if self.link.now() >= until:
                raise self.error(
                    commands.DONE, "0", f"It is still moving after {seconds:g} s.", "Wait longer."
                )
            self.link.sleep(THRESHOLDS.poll_s)
        self.check_status(commands.DONE)

    def identify(self) -> str:
        """The identity; asked for again where a part of one comes."""
        for _ in range(THRESHOLDS.identity_tries - 1):
            line = self.link.query("*IDN?").strip()
            if re.fullmatch(commands.IDENTITY, line, re.IGNORECASE):
                return line
            if not commands.is_stray(line):
                break
        return self.text("*IDN?", commands.IDENTITY, "This is another instrument.")

    def number(self, query: str) -> float:
        """The answer as a number."""
        line = self.link.query(query)
        try:
            return _reply.number(line.strip())
        except ValueError as error:
            raise self.error(
                query, line, f"The answer cannot be used: {error}.", "Ask again."
            ) from None

    def texts(self, queries: dict[str, str]) -> dict[str, str]:
        """The answers to several queries, by name."""
        return {name: self.text(query, r".+", "") for name, query in queries.items()}

    def text(self, query: str, pattern: str, why: str) -> str:
        """The answer, which must match `pattern`; `why`: what it means where it does not."""
        line = self.link.query(query).strip()
        if not re.fullmatch(pattern, line, re.IGNORECASE):
            raise self.error(
                query, line, why, "Check the address, the laser head and the cable, then try again."
            )
        return line

    def error(self, command: str, reply: str, why: str, cure: str) -> InstrumentError:
        """An error of this controller."""
        return InstrumentError(self.link.resource, command, reply, why=why, cure=cure)


def _format_fault(fault: tuple[int, str]) -> str:
    return f'{fault[0]},"{fault[1]}"'


def _remedy(faults: list[tuple[int, str]]) -> tuple[str, str]:
    cures = [commands.CURES[code] for code, _ in faults if code in commands.CURES]
    return (
        "The controller refuses the command, or reports a fault.",
        " ".join(cures) or "Check the value against the head's range.",
    )
