"""A simulated Tektronix AFG31052: the commands of basic mode, its limits and its rounding."""

import math
from collections.abc import Callable

import numpy as np

from rapi_jax import AfgWaveform
from rapi_jax._afg import FULL, POINTS

from ..servers._instrument import AbstractInstrument, Answer
from ._afg_output import AfgOutput, Seen
from ._messages import Messages, TooLong, Unit, header_pattern, units
from ._status import ScpiFault, Status

Handler = Callable[[int, Unit], str | bytes | None]  # channel and unit to reply
IDENTITY = "TEKTRONIX,AFG31052,C000001,SCPI:99.0 FV:1.6.2"


class SimulatedAFG31052(AbstractInstrument):
    """The generator as a state machine.

    - `identity`: what it says it is. `load_ohm`: what is really connected to both outputs.
    - `upload_s`: how long it is busy with an upload, so that `*OPC?` answers later.
    - `digits`: levels are rounded to 0.1 mV or so many digits; 5 for 0.1 mV up to 10 V.
    - `ignores`: headers (upper case, as sent) of commands that it silently does not obey.

    `seen` tells, for each channel, what its load has felt: the extremes while the output was on,
    and the largest jump by a level or a relay.
    """

    def __init__(
        self,
        *,
        identity: str = IDENTITY,
        load_ohm: float = math.inf,
        upload_s: float = 0.0,
        digits: int = 4,
        ignores: tuple[str, ...] = (),
    ) -> None:
        self.identity = identity
        self.upload_s = upload_s
        self.ignores = ignores
        self.status = Status()
        self.trigger = {"source": "TIM", "output": "TRIG"}
        self._outputs = {n: AfgOutput(load_ohm, digits) for n in (1, 2)}
        self._memory = {n: np.full(1000, FULL // 2, np.uint16) for n in (1, 2)}
        self._messages = Messages()
        self._busy_s = 0.0
        self._found: dict[str, tuple[int, Handler]] = {}
        self._handlers = [(header_pattern(spec), run) for spec, run in self._table().items()]

    @property
    def seen(self) -> dict[int, Seen]:
        """What each channel's load has felt so far."""
        return {n: output.seen for n, output in self._outputs.items()}

    def output(self, n: int) -> AfgWaveform | None:
        """What channel `n` puts into its load, `None` while it is off."""
        out = self._outputs[n]
        if not out.on or out.shape != f"EMEM{n}":
            return None
        low, high = out.at_load()
        return AfgWaveform(self._memory[n], low, high, out.frequency_hz)

    def connected(self) -> None:
        """Drop a message that was not complete."""
        self._messages.clear()

    def feed(self, data: bytes) -> list[Answer]:
        """Answers to the messages that `data` completes."""
        answers = []
        try:
            for message in self._messages.feed(data):
                replies = [r for unit in units(message) if (r := self._do(unit)) is not None]
                if replies:
                    wait, self._busy_s = self._busy_s, 0.0
                    answers.append(Answer(b";".join(replies) + b"\n", wait))
        except TooLong:
            self.status.report(-223)
        return answers

    def _do(self, unit: Unit | None) -> bytes | None:
        try:
            if unit is None:
                raise ScpiFault(-102)
            if unit.header in self.ignores:
                return None
            n, run = self._find(unit.header)
            reply = run(n, unit)
            return reply.encode("latin-1") if isinstance(reply, str) else reply
        except ScpiFault as fault:
            self.status.report(fault.code, fault.detail)
            return None

    def _find(self, header: str) -> tuple[int, Handler]:
        known = self._found.get(header)
        if known is None:
            for pattern, run in self._handlers:
                if found := pattern.fullmatch(header):
                    known = int(found.groupdict().get("n") or 1), run
                    break
            if known is None or known[0] not in self._outputs:
                raise ScpiFault(-113, header)
            self._found[header] = known
        return known

    def _table(self) -> dict[str, Handler]:
        def level(name: str) -> Callable[[int, Unit], None]:
            return lambda n, unit: self._outputs[n].set_level(name, _number(unit))

        def told(name: str) -> Callable[[int, Unit], str]:
            return lambda n, unit: f"{self._outputs[n].level(name):.4E}"

        return {
            "*IDN?": lambda n, unit: self.identity,
            "*CLS": lambda n, unit: self.status.clear(),
            "*RST": self._reset,
            "*OPC?": lambda n, unit: "1",
            "*ESR?": lambda n, unit: self.status.event(),
            "SYSTem:ERRor[:NEXT]?": lambda n, unit: self.status.error(),
            "OUTPut{n}[:STATe]": self._switch,
            "OUTPut{n}[:STATe]?": lambda n, unit: str(int(self._outputs[n].on)),
            "OUTPut{n}:IMPedance": self._set_load,
            "OUTPut{n}:IMPedance?": self._told_load,
            "OUTPut:TRIGger[:MODE]": self._choose("output", ("TRIG", "SYNC")),
            "OUTPut:TRIGger[:MODE]?": lambda n, unit: self.trigger["output"],
            "TRIGger[:SEQuence]:SOURce": self._choose("source", ("TIM", "EXT")),
            "TRIGger[:SEQuence]:SOURce?": lambda n, unit: self.trigger["source"],
            "SOURce{n}:PHASe:INITiate": lambda n, unit: None,
            "SOURce{n}:FUNCtion[:SHAPe]": self._set_shape,
            "SOURce{n}:FUNCtion[:SHAPe]?": lambda n, unit: self._outputs[n].shape,
            "SOURce{n}:FREQuency[:CW]": self._set_frequency,
            "SOURce{n}:FREQuency[:CW]?": lambda n, u: f"{self._outputs[n].frequency_hz:.10E}",
            "SOURce{n}:VOLTage[:LEVel][:IMMediate]:HIGH": level("high"),
            "SOURce{n}:VOLTage[:LEVel][:IMMediate]:HIGH?": told("high"),
            "SOURce{n}:VOLTage[:LEVel][:IMMediate]:LOW": level("low"),
            "SOURce{n}:VOLTage[:LEVel][:IMMediate]:LOW?": told("low"),
            "SOURce{n}:VOLTage:LIMit:HIGH": level("clamp_high"),
            "SOURce{n}:VOLTage:LIMit:HIGH?": told("clamp_high"),
            "SOURce{n}:VOLTage:LIMit:LOW": level("clamp_low"),
            "SOURce{n}:VOLTage:LIMit:LOW?": told("clamp_low"),
            "DATA[:DATA]": self._upload,
            "DATA[:DATA]?": self._read_back,
            "DATA:POINts?": lambda n, unit: str(self._memory[_memory(unit)].size),
        }

    def _reset(self, n: int, unit: Unit) -> None:
        for output in self._outputs.values():
            output.reset()

    def _switch(self, n: int, unit: Unit) -> None:
        state = _one(unit).upper()
        if state not in ("ON", "OFF", "1", "0"):
            raise ScpiFault(-224, state)
        self._outputs[n].switch(state in ("ON", "1"))

    def _set_load(self, n: int, unit: Unit) -> None:
        word = _one(unit).upper()
        ohm = math.inf if word in ("INF", "INFINITY") else _number(unit)
        if not 1 <= ohm <= 10_000 and not math.isinf(ohm):
            raise ScpiFault(-222, word)
        self._outputs[n].set_load(ohm)

    def _told_load(self, n: int, unit: Unit) -> str:
        ohm = self._outputs[n].set_ohm
        return "9.9E+37" if math.isinf(ohm) else f"{ohm:.4E}"

    def _choose(self, name: str, known: tuple[str, ...]) -> Callable[[int, Unit], None]:
        def choose(n: int, unit: Unit) -> None:
            word = _one(unit).upper()[:4]
            short = word if word in known else word[:3]
            if short not in known:
                raise ScpiFault(-224, word)
            self.trigger[name] = short

        return choose

    def _set_shape(self, n: int, unit: Unit) -> None:
        word = _one(unit).upper()
        memory = word.replace("EMEMORY", "EMEM")
        if memory not in ("EMEM1", "EMEM2", "SIN", "SINUSOID", "DC", "RAMP"):
            raise ScpiFault(-224, word)
        self._outputs[n].shape = memory

    def _set_frequency(self, n: int, unit: Unit) -> None:
        hertz = _number(unit)
        if not 1e-6 <= hertz <= 25e6:
            raise ScpiFault(-222)
        self._outputs[n].frequency_hz = round(hertz, 6)

    def _upload(self, n: int, unit: Unit) -> None:
        number, content = _memory(unit), unit.block
        if content is None:
            raise ScpiFault(-109)
        if len(content) % 2:
            raise ScpiFault(-161, "odd number of bytes")
        codes = np.frombuffer(content, ">u2").astype(np.uint16)
        if not 2 <= codes.size <= POINTS:
            raise ScpiFault(-223, f"{codes.size} points")
        if codes.max() > FULL:
            raise ScpiFault(-222, f"code {codes.max()}")
        self._memory[number] = codes
        self._busy_s += self.upload_s

    def _read_back(self, n: int, unit: Unit) -> bytes:
        content = self._memory[_memory(unit)].astype(">u2").tobytes()
        size = str(len(content)).encode()
        return b"#" + str(len(size)).encode() + size + content


def _one(unit: Unit) -> str:
    if len(unit.parameters) != 1 or unit.block is not None:
        raise ScpiFault(-108 if unit.parameters else -109)
    return unit.parameters[0]


def _number(unit: Unit) -> float:
    try:
        value = float(_one(unit))
    except ValueError:
        raise ScpiFault(-224, _one(unit)) from None
    if not math.isfinite(value):
        raise ScpiFault(-222)
    return value


def _memory(unit: Unit) -> int:
    word = unit.parameters[0].upper().replace("EMEMORY", "EMEM") if unit.parameters else ""
    if word not in ("EMEM", "EMEM1", "EMEM2"):
        raise ScpiFault(-224, word)
    return 2 if word == "EMEM2" else 1
