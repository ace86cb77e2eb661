"""A simulated Tektronix AFG31052: the commands of basic mode, its limits and its rounding."""

import math
import time
from collections.abc import Callable

import numpy as np

from hardware.simulated.instruments._messages import Unit
from hardware.simulated.instruments._scpi_instrument import (
    AbstractScpiInstrument,
    Handler,
    boolean,
    number,
    one,
)
from hardware.simulated.instruments._scpi_instrument import word as choice
from hardware.simulated.instruments._status import ScpiFault
from rapi_jax import AfgWaveform
from rapi_jax.internal import FULL, POINTS

from ._kept import KeptSettings
from ._output import AfgOutput, Seen
from ._shapes import SHAPES, built_in
from ._states import AfgStates

IDENTITY = "TEKTRONIX,AFG31052,C000001,SCPI:99.0 FV:1.6.2"


class SimulatedAFG31052(AbstractScpiInstrument):
    """The generator as a state machine.

    - `identity`: what it says it is. `load_ohm`: what is really connected to both outputs.
    - `upload_s`: how long it is busy with an upload, so that `*OPC?` answers later.
    - `digits`: levels are rounded to 0.1 mV or so many digits; 5 for 0.1 mV up to 10 V.
    - `ignores`: headers (upper case, as sent) of commands that it silently does not obey.
    - `lacks`: headers (the same) that it does not know, as models and firmware differ.
    - `first_memory`: how it names the first memory in answers, "EMEM1" or "EMEM".
    - `clock`: gives the time, s, for bursts that a trigger from outside begins.

    `seen` holds, for each channel, the voltages that its load has seen: the extremes while the
    output was on, and the largest jump by a level or a relay.
    """

    def __init__(
        self,
        *,
        identity: str = IDENTITY,
        load_ohm: float = math.inf,
        upload_s: float = 0.0,
        digits: int = 4,
        ignores: tuple[str, ...] = (),
        lacks: tuple[str, ...] = (),
        first_memory: str = "EMEM1",
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._clock = clock
        self.upload_s = upload_s
        self._names = {"EMEM1": first_memory}
        self.trigger = {"source": "TIM", "output": "TRIG"}
        self._outputs = {n: AfgOutput(load_ohm, digits) for n in (1, 2)}
        self._states, self._kept = AfgStates(self._outputs), KeptSettings(self._outputs)
        self._memory = {n: np.full(1000, FULL // 2, np.uint16) for n in (1, 2)}
        super().__init__(identity, self._outputs, ignores=ignores, lacks=lacks)

    @property
    def seen(self) -> dict[int, Seen]:
        """Voltages that each channel's load has seen so far."""
        return {n: output.seen for n, output in self._outputs.items()}

    def output(self, n: int, at_s: float | None = None) -> AfgWaveform | None:
        """What channel `n` puts into its load, `None` while it is off.

        In sequence mode a sine comes out at the channel's levels, whatever its memory holds.
        `at_s`: the time that is meant, for bursts; by default now.
        """
        out = self._outputs[n]
        if not out.on:
            return None
        low, high = out.at_load()
        if self._states.sequence:
            return AfgWaveform(built_in("SIN", 0.5, 0.5), low, high, out.play.frequency_hz)
        memory = self._memory.get({"EMEM1": 1, "EMEM2": 2}.get(out.shape, 0))
        play = out.play
        codes = built_in(out.shape, play.symmetry, play.duty) if memory is None else memory
        begin, end = self._span_s(out)
        if not begin <= (self._clock() if at_s is None else at_s) < end:
            codes = play.rest(codes)
        return play.play(codes, low, high)

    def pulse_s(self, n: int, after_s: float) -> tuple[float, float] | None:
        """The next pulse at the trigger output, and the end of what is played, s; or none.

        Pulses come at the start of each period, in a burst of its own. Without one the time of a
        pulse is not followed: it comes at once.
        """
        begin, end = self._span_s(self._outputs[n])
        if not self._outputs[n].on or math.isinf(begin) and begin > 0:
            return None
        if math.isinf(end):
            return after_s, end
        step = 1 / self._outputs[n].play.frequency_hz
        at = begin + max(0, math.ceil((after_s - begin) / step)) * step
        return (at, end) if at < end - step / 2 else None

    def _span_s(self, out: AfgOutput) -> tuple[float, float]:
        """From when to when the channel plays, s."""
        if out.play.burst and not out.play.by_clock:
            return out.play.burst_span_s
        return -math.inf, math.inf

    def _fire(self, n: int, unit: Unit) -> None:
        for out in self._outputs.values():
            out.play.fired_s = self._clock()

    def commands(self) -> dict[str, Handler]:
        """Of basic mode."""

        def level(name: str) -> Callable[[int, Unit], None]:
            return lambda n, unit: self._states.set_level(name, n, number(unit, quantity="V"))

        def query(name: str) -> Callable[[int, Unit], str]:
            return lambda n, unit: f"{self._outputs[n].level(name):.4E}"

        return (
            self._kept.commands()
            | self._states.commands()
            | {
                "*RST": self._reset,
                "OUTPut{n}[:STATe]": self._switch,
                "OUTPut{n}[:STATe]?": lambda n, unit: str(int(self._outputs[n].on)),
                "OUTPut{n}:IMPedance": self._set_load,
                "OUTPut{n}:IMPedance?": self._query_load,
                "OUTPut:TRIGger[:MODE]": self._choose("output", ("TRIG", "SYNC")),
                "OUTPut:TRIGger[:MODE]?": lambda n, unit: self.trigger["output"],
                "TRIGger[:SEQuence]:SOURce": self._choose("source", ("TIM", "EXT")),
                "TRIGger[:SEQuence]:SOURce?": lambda n, unit: self.trigger["source"],
                "*TRG": self._fire,
                "SOURce{n}:PHASe:INITiate": lambda n, unit: None,
                "SOURce{n}:FUNCtion[:SHAPe]": self._set_shape,
                "SOURce{n}:FUNCtion[:SHAPe]?": lambda n, unit: self._shape(n),
                "SOURce{n}:FREQuency[:CW]": self._set_frequency,
                "SOURce{n}:FREQuency:FIXed": self._set_frequency,
                "SOURce{n}:FREQuency:FIXed?": lambda n, u: (
                    f"{self._outputs[n].play.frequency_hz:.10E}"
                ),
                "SOURce{n}:FREQuency[:CW]?": lambda n, u: (
                    f"{self._outputs[n].play.frequency_hz:.10E}"
                ),
                "SOURce{n}:VOLTage[:LEVel][:IMMediate]:HIGH": level("high"),
                "SOURce{n}:VOLTage[:LEVel][:IMMediate]:HIGH?": query("high"),
                "SOURce{n}:VOLTage[:LEVel][:IMMediate]:LOW": level("low"),
                "SOURce{n}:VOLTage[:LEVel][:IMMediate]:LOW?": query("low"),
                "SOURce{n}:VOLTage:LIMit:HIGH": level("clamp_high"),
                "SOURce{n}:VOLTage:LIMit:HIGH?": query("clamp_high"),
                "SOURce{n}:VOLTage:LIMit:LOW": level("clamp_low"),
                "SOURce{n}:VOLTage:LIMit:LOW?": query("clamp_low"),
                "DATA[:DATA]": self._upload,
                "DATA[:DATA]?": self._read_back,
                "DATA:POINts?": lambda n, unit: str(self._memory[_memory(unit)].size),
            }
        )

    def _reset(self, n: int, unit: Unit) -> None:
        for output in self._outputs.values():
            output.reset()
        self._states.reset()
        self._kept.reset()
        self.trigger |= {"source": "TIM", "output": "TRIG"}

    def _switch(self, n: int, unit: Unit) -> None:
        self._outputs[n].switch(boolean(unit))

    def _set_load(self, n: int, unit: Unit) -> None:
        word = one(unit).upper()
        ohm = math.inf if word in ("INF", "INFINITY") else number(unit, 1.0, 1e4, "OHM")
        self._outputs[n].set_load(ohm)

    def _query_load(self, n: int, unit: Unit) -> str:
        ohm = self._outputs[n].set_ohm
        return "9.9E+37" if math.isinf(ohm) else f"{ohm:.4E}"

    def _choose(self, name: str, known: tuple[str, ...]) -> Callable[[int, Unit], None]:
        def choose(n: int, unit: Unit) -> None:
            word = one(unit).upper()[:4]
            short = word if word in known else word[:3]
            if short not in known:
                raise ScpiFault(-224, word)
            self.trigger[name] = short
            for out in self._outputs.values():
                out.play.by_clock = self.trigger["source"] == "TIM"

        return choose

    def _set_shape(self, n: int, unit: Unit) -> None:
        word = one(unit).upper()
        memory = word.replace("EMEMORY", "EMEM")
        shape = "EMEM1" if memory == "EMEM" else memory
        if shape not in ("EMEM1", "EMEM2"):
            shape = choice(unit, SHAPES)
        self._outputs[n].shape = shape

    def _shape(self, n: int) -> str:
        shape = self._outputs[n].shape
        return self._names.get(shape, shape)

    def _set_frequency(self, n: int, unit: Unit) -> None:
        self._states.set_frequency(n, round(number(unit, 1e-6, 25e6, "HZ"), 6))

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


def _memory(unit: Unit) -> int:
    word = unit.parameters[0].upper().replace("EMEMORY", "EMEM") if unit.parameters else ""
    if word not in ("EMEM", "EMEM1", "EMEM2"):
        raise ScpiFault(-224, word)
    return 2 if word == "EMEM2" else 1
