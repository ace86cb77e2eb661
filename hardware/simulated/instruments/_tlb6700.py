"""A simulated TLB-6700 with its head: the commands, its limits, its faults, its slow motor."""

import math
import re
import time
from collections.abc import Callable

from hardware.laser import _commands as table
from hardware.servers._instrument import AbstractInstrument, Answer, Lines

from ._messages import header_pattern
from ._motor import Motor

IDENTITY = "New_Focus 6700 v2.4 03/19/14 SN1012"
_MOST = 1024  # bytes without an end that it takes in
_QUEUE = 32  # faults that wait, at most
_RANGES = {"wavelength": (765.0, 781.0), "piezo": (0.0, 100.0), "current": (0.0, 165.0)}
_TRACK_NM_S = 8.0  # the motor, when it follows the set wavelength
_SETTLES = 1e-4  # of what was asked: how far sensed values lie off


class SimulatedTLB6700(AbstractInstrument):
    """The controller as a state machine: lines in, one line out for each.

    - `clock`: gives the time, s; that of a `SimulatedLink` for one in the same process.
    - `head`, `identity`: what it says they are. `key`: the key switch. `interlock`: closed or not.
    - `emits`: whether the diode is on at first.
    - `stray_every`: after so many answers it adds its identity to one, as real ones do; 0: never.
    - `stray_ok`: "before" or "after": an `OK` that it adds to values. `cut_identities`: so many of
      its first answers to `*IDN?` lack their beginning. `on_delay_s`: until it emits, s.

    `trip` reports a fault as if it had happened, and does what the controller does then.
    """

    def __init__(
        self,
        *,
        clock: Callable[[], float] = time.monotonic,
        identity: str = IDENTITY,
        head: str = "TLB-6712",
        key: bool = True,
        interlock: bool = True,
        emits: bool = False,
        stray_every: int = 0,
        stray_ok: str = "",
        cut_identities: int = 0,
        on_delay_s: float = 0.0,
    ) -> None:
        self.identity, self.head = identity, head
        self.key, self.interlock = key, interlock
        self.diode_c, self.cavity_c = 20.0, 30.0
        self.stray_every, self.stray_ok = stray_every, stray_ok
        self.on_delay_s = on_delay_s
        self._cut, self._on_s = cut_identities, -math.inf
        self.output, self.tracking, self.remote = emits, False, False
        self.set = {
            "wavelength": 770.0, "piezo": 50.0, "current": 120.0,
            "from": 768.0, "to": 772.0, "forth": 1.0, "back": 1.0,
        }  # fmt: skip
        self.flags = {"wavelength_input": False, "constant_power": False, "scan_option": False}
        self.scans = 1
        self._clock = clock
        self._motor = Motor(770.0, _TRACK_NM_S, clock)
        self._faults: list[int] = []
        self._buffer = bytearray()
        self._answered = 0
        self._table = [(header_pattern(spec), run) for spec, run in self._commands().items()]

    def splitter(self) -> Lines:
        """Of one client's lines."""
        return Lines(_MOST + 2)

    def connected(self) -> None:
        """Drop a line that was not complete."""
        self._buffer.clear()

    def feed(self, data: bytes) -> list[Answer]:
        """Answers to the lines that `data` completes."""
        answers = []
        for byte in data:
            if byte in b"\r\n":
                line, self._buffer = bytes(self._buffer), bytearray()
                if line.strip():
                    answers.append(self._answer(line.decode("ascii", "replace").strip()))
            elif len(self._buffer) < _MOST:
                self._buffer.append(byte)
        return answers

    @property
    def emits(self) -> bool:
        """Whether there is light."""
        return self.output and self._clock() >= self._on_s

    def trip(self, code: int) -> None:
        """A fault happens."""
        self._report(code)
        if code in (424, 501, 502, 514, 524, 902, 919):
            self.output = False
        if code in (802, 803):
            self.tracking = False
            self._motor.stop()
        if code == 804:
            self.set["piezo"] = 0.0

    def wavelength(self) -> float:
        """Where the motor is now, nm."""
        return self._motor.place()

    def _answer(self, line: str) -> Answer:
        header, _, parameter = line.partition(" ")
        reply = self._execute(header.upper(), parameter.strip())
        self._answered += 1
        data = f"{reply}\r\n"[: table.MOST_BYTES]
        if reply != "OK":
            before, after = ("OK\r\n" if self.stray_ok == at else "" for at in ("before", "after"))
            data = before + data + after
        if self.stray_every and self._answered % self.stray_every == 0:
            data += f"{self.identity}\r\n"
        return Answer(data.encode("ascii"))

    def _execute(self, header: str, parameter: str) -> str:
        for pattern, run in self._table:
            if pattern.fullmatch(header):
                try:
                    return run(parameter) or "OK"
                except _Refused as refused:
                    self._report(refused.code)
                    return table.FAULTS[refused.code]
        self._report(116)
        return "COMMAND NOT VALID"

    def _commands(self) -> dict[str, Callable[[str], str | None]]:
        def setting(name: str) -> tuple[Callable[[str], None], Callable[[str], str]]:
            def put(parameter: str) -> None:
                self._put(name, parameter)

            return put, lambda _: f"{self.set[name]:.2f}"

        commands: dict[str, Callable[[str], str | None]] = {
            "*IDN?": lambda _: self._identify(),
            "ONDELAY?": lambda _: f"{1e3 * self.on_delay_s:.0f}",
            "*OPC?": lambda _: str(int(not self._motor.moves())),
            "*STB?": lambda _: str(table.FAULTS_WAITING if self._waiting() else 0),
            "*RST": lambda _: None,
            "LOCKOUT": lambda _: None,
            "ERRSTR?": lambda _: self._oldest(),
            "SYSTem:LASer:MODEL?": lambda _: self.head,
            "SYSTem:MCONtrol": self._control,
            "SYSTem:MCONtrol?": lambda _: "REM" if self.remote else "LOC",
            "OUTPut:STATe": self._switch,
            "OUTPut:STATe?": lambda _: str(int(self.emits)),
            "OUTPut:TRACk": self._track,
            "OUTPut:TRACk?": lambda _: str(int(self.tracking)),
            "SOURce:WAVE:DESSCANS": self._set_scans,
            "SOURce:WAVE:DESSCANS?": lambda _: str(self.scans),
            "OUTPut:SCAN:START": self._scan,
            "OUTPut:SCAN:STOP": lambda _: self._motor.stop(),
            "OUTPut:SCAN:RESET": self._to_begin,
            "SENSe:WAVElength": lambda _: f"{self.wavelength():.3f}",
            "SENSe:VOLTage:PIEZo": lambda _: f"{self.set['piezo'] * (1 + _SETTLES):.2f}",
            "SENSe:CURRent:DIODe": lambda _: f"{self.set['current'] * self.emits:.2f}",
            "SENSe:TEMPerature:DIODe": lambda _: f"{self.diode_c:.2f}",
            "SENSe:TEMPerature:CAVity": lambda _: f"{self.cavity_c:.2f}",
        }
        for header, name in {
            "SYSTem:WINPut": "wavelength_input",
            "SOURce:CPOWer": "constant_power",
            "SOURce:WAVE:SCANCFG": "scan_option",
        }.items():
            commands[header], commands[f"{header}?"] = self._flagged(name)
        for header, name in {
            "SOURce:WAVElength": "wavelength",
            "SOURce:VOLTage:PIEZo": "piezo",
            "SOURce:CURRent:DIODe": "current",
            "SOURce:WAVE:START": "from",
            "SOURce:WAVE:STOP": "to",
            "SOURce:WAVE:SLEW:FORWard": "forth",
            "SOURce:WAVE:SLEW:RETurn": "back",
        }.items():
            commands[header], commands[f"{header}?"] = setting(name)
        return commands

    def _put(self, name: str, parameter: str) -> None:
        if not re.fullmatch(r"[+-]?\d{1,6}(\.\d{0,6})?", parameter):
            raise _Refused(126 if not parameter else 116)
        value = float(parameter)
        ranges = {"from": "wavelength", "to": "wavelength"}
        low, high = _RANGES.get(ranges.get(name, name), (0.01, 20.0))
        if not low <= value <= high:
            raise _Refused(201)
        self.set[name] = value
        if name == "wavelength" and self.tracking:
            self._motor.go(_TRACK_NM_S, value)

    def _control(self, parameter: str) -> None:
        if parameter.upper() not in ("REM", "LOC"):
            raise _Refused(201)
        self.remote = parameter.upper() == "REM"

    def _switch(self, parameter: str) -> None:
        on = self._flag(parameter)
        if on and not self.key:
            raise _Refused(902)
        if on and not self.interlock:
            raise _Refused(501)
        if on and not self.output:
            self._on_s = self._clock() + self.on_delay_s
        self.output = on

    def _track(self, parameter: str) -> None:
        self.tracking = self._flag(parameter)
        if self.tracking:
            self._motor.go(_TRACK_NM_S, self.set["wavelength"])
        else:
            self._motor.stop()

    def _scan(self, parameter: str) -> None:
        del parameter
        self._motor.go(self.set["forth"], *(self.set["to"], self.set["from"]) * self.scans)

    def _to_begin(self, parameter: str) -> None:
        del parameter
        self._motor.go(_TRACK_NM_S, self.set["from"])

    def _waiting(self) -> bool:
        """Whether there are faults; an open interlock is one for as long as it is open."""
        if not self.interlock and 501 not in self._faults:
            self.trip(501)
        return bool(self._faults)

    def _report(self, code: int) -> None:
        if len(self._faults) < _QUEUE:  # one that is not read does not grow for ever
            self._faults.append(code)

    def _oldest(self) -> str:
        code = self._faults.pop(0) if self._faults else 0
        text = table.FAULTS.get(code, "NO ERROR")
        return f'{code},"{text}"'

    def _identify(self) -> str:
        self._cut, cut = max(self._cut - 1, 0), self._cut > 0
        return self.identity[len(self.identity) // 2 :] if cut else self.identity

    def _flagged(self, name: str) -> tuple[Callable[[str], None], Callable[[str], str]]:
        def put(parameter: str) -> None:
            self.flags[name] = self._flag(parameter)

        return put, lambda _: str(int(self.flags[name]))

    def _set_scans(self, parameter: str) -> None:
        if not re.fullmatch(r"\d{1,4}", parameter) or not int(parameter):
            raise _Refused(201)
        self.scans = int(parameter)

    def _flag(self, parameter: str) -> bool:
        if parameter not in ("0", "1"):
            raise _Refused(201)
        return parameter == "1"


class _Refused(Exception):
    """A command that is not carried out."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code
