"""One channel of the generator, setting by setting: each is sent, checked and read back."""

import math

import numpy as np

from hardware._errors import InstrumentError
from hardware.links._scpi import Scpi

from . import _commands as commands
from ._levels import Levels, level_step, setting_order
from ._states import UNDEFINED, State
from ._thresholds import THRESHOLDS


class AfgPort:
    """Settings of channel `n` without any policy; `AfgChannel` decides what may be set when."""

    def __init__(self, scpi: Scpi, n: int) -> None:
        self.scpi = scpi
        self.n = n
        self._absent: set[str] = set()  # optional headers that the instrument does not know

    def name(self, template: str) -> str:
        """A command for this channel."""
        return template.format(n=self.n)

    def output(self) -> bool:
        """Whether the output is on."""
        return self.output_of(self.n)

    def output_of(self, n: int) -> bool:
        """Whether the output of channel `n` is on."""
        return self.scpi.text(commands.OUTPUT.format(n=n) + "?", r"[01]") == "1"

    def tell(self, state: State) -> str:
        """The instrument's answer; `UNDEFINED` where it does not know an optional header."""
        query = self.name(state.header) + "?"
        if not state.optional:
            return self.scpi.text(query)
        answer = None if query in self._absent else self.scpi.text_if_known(query)
        if answer is None:
            self._absent.add(query)
            return UNDEFINED
        return answer

    def has(self, state: State) -> bool:
        """Whether the instrument is in this state, or can be in no other."""
        return state.holds(self.tell(state))

    def require(self, state: State) -> bool:
        """Bring the instrument into this state; whether it was in another one."""
        if self.has(state):
            return False
        self._set(state.header, state.value)
        read = self.tell(state)
        if not state.holds(read):
            raise self._differs(state.header, read, state.value)
        return True

    def switch(self, on: bool) -> None:
        """Output on or off, and queried back."""
        self._set(commands.OUTPUT, "ON" if on else "OFF")
        if self.output() != on:
            raise self._differs(commands.OUTPUT, "OFF" if on else "ON", "ON" if on else "OFF")

    def set_load(self, ohm: float) -> None:
        """The load that the instrument reckons with, ohm; infinite for high impedance."""
        self._set(commands.LOAD, commands.ohms(ohm))
        self.check_load(ohm)

    def check_load(self, ohm: float) -> None:
        """Refuse another load: a 50 ohm setting doubles the voltage into high impedance."""
        read = self.scpi.number(self.name(commands.LOAD) + "?")
        if not (read == ohm or math.isclose(read, ohm, rel_tol=THRESHOLDS.load_tolerance)):
            raise InstrumentError(
                self.scpi.resource,
                self.name(commands.LOAD) + "?",
                f"{read:g}",
                why=f"The load must be {ohm:g} ohm. Set for 50 ohm, the instrument gives twice its "
                "stated voltage into a high impedance.",
                cure="The output was not switched on. Set the load at the instrument and see why "
                "it does not take it from here.",
            )

    def levels(self) -> Levels:
        """The levels as the instrument has them."""
        return Levels(self._read(commands.LOW), self._read(commands.HIGH))

    def set_levels(self, now: Levels, then: Levels) -> Levels:
        """Go from `now` to `then` in an order that is legal between; read back what was taken."""
        self.move_levels(now, then)
        read = self.levels()
        for template, got, asked in (
            (commands.LOW, read.low_v, then.low_v),
            (commands.HIGH, read.high_v, then.high_v),
        ):
            if not abs(got - asked) <= level_step(asked) * THRESHOLDS.level_tolerance:
                raise self._differs(template, f"{got:g}", commands.volts(asked))
        return read

    def move_levels(self, now: Levels, then: Levels) -> None:
        """The same, without reading back."""
        for which in setting_order(now, then):
            template, value = (
                (commands.LOW, then.low_v) if which == "low" else (commands.HIGH, then.high_v)
            )
            if value != (now.low_v if which == "low" else now.high_v):
                self._set(template, commands.volts(value))

    def clamp(self) -> Levels:
        """The instrument's own limits for the levels."""
        return Levels(self._read(commands.CLAMP_LOW), self._read(commands.CLAMP_HIGH))

    def set_clamp_low(self, value: float) -> None:
        """The lowest level that the instrument accepts, V."""
        self._set(commands.CLAMP_LOW, commands.volts(value))

    def set_clamp_high(self, value: float) -> None:
        """The highest level that the instrument accepts, V."""
        self._set(commands.CLAMP_HIGH, commands.volts(value))

    def check_clamp(self, low: float, high: float) -> None:
        """Refuse a clamp that lets more through than `low` to `high`, or less."""
        got = self.clamp()
        for template, read, asked in (
            (commands.CLAMP_LOW, got.low_v, low),
            (commands.CLAMP_HIGH, got.high_v, high),
        ):
            if not abs(read - asked) < THRESHOLDS.clamp_tolerance_v:
                raise self._differs(template, f"{read:g}", commands.volts(asked))

    def set_frequency(self, hertz: float) -> None:
        """Periods a second, Hz."""
        self._set(commands.FREQUENCY, commands.hertz(hertz))
        read = self._read(commands.FREQUENCY)
        near = THRESHOLDS.frequency_tolerance
        if not abs(read - hertz) <= near * hertz + near:
            raise self._differs(commands.FREQUENCY, f"{read:g}", commands.hertz(hertz))

    def frequency(self) -> float:
        """Periods a second as the instrument has them, Hz."""
        return self._read(commands.FREQUENCY)

    def set_number(self, template: str, value: int) -> None:
        """A setting that is counted, or zero; read back."""
        self._set(template, str(value))
        read = self._read(template)
        if read != value:
            raise self._differs(template, f"{read:g}", str(value))

    def upload(self, codes: np.ndarray) -> None:
        """Fill this channel's memory; the length is read back."""
        content = commands.block(codes)
        seconds = self.scpi.timeout_s + len(content) / THRESHOLDS.upload_bytes_per_s
        self.scpi.command(self.name(commands.UPLOAD), content, timeout_s=seconds)
        points = self.scpi.number(self.name(commands.POINTS))
        if points != codes.size:
            raise self._differs(commands.UPLOAD, f"{points:g} points", f"{codes.size} points")

    def select(self) -> None:
        """Play this channel's memory."""
        self._set(commands.SHAPE, f"EMEM{self.n}")
        self.scpi.text(self.name(commands.SHAPE) + "?", commands.memory_pattern(self.n))

    def read_back(self, points: int) -> np.ndarray:
        """The codes in this channel's memory; some models of the series cannot."""
        query, size = self.name(commands.READ_BACK), 2 * points
        return commands.codes(self.scpi.block(query, limit=size, size=size))

    def align(self) -> None:
        """Start both channels' periods together."""
        self.scpi.command(self.name(commands.ALIGN))

    def _set(self, template: str, value: str) -> None:
        self.scpi.command(f"{self.name(template)} {value}")

    def _read(self, template: str) -> float:
        query = self.name(template) + "?"
        value = self.scpi.number(query)
        if math.isinf(value):
            raise InstrumentError(
                self.scpi.resource,
                query,
                "infinity",
                why="A level or rate is never infinite.",
                cure="Look at the instrument.",
            )
        return value

    def _differs(self, template: str, read: str, asked: str) -> InstrumentError:
        return InstrumentError(
            self.scpi.resource,
            f"{self.name(template)} {asked}",
            read,
            why="The instrument has another setting than the one it was given.",
            cure="See whether someone else operates it, and whether its firmware rounds or clamps "
            "the setting.",
        )
