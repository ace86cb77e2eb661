"""Keysight InfiniiVision oscilloscopes (2000 X to 6000 X series) as a digitizer.

Commands after the series' programmer's guide. A record of one trigger is read from the memory of
the acquisition ("raw"), 16 bits a sample.
"""

import math
import re

import numpy as np

from hardware._driver import AbstractConnector, AbstractReadBack, Address, Backend
from hardware._errors import InstrumentError
from hardware.links import _reply
from hardware.links._scpi import Scpi

from . import _infiniivision_states as states
from ._base import AbstractDigitizer, AbstractDigitizerTable, Acquisition, Samples
from ._thresholds import THRESHOLDS

IDENTITY = r"(KEYSIGHT|AGILENT) TECHNOLOGIES,[DM]SO-?X? ?[2346]\d{3}[A-Z]?,[^,]{1,64},[^,]{1,64}"
_RUNNING = 8  # in the operation status


class InfiniiVisionTable(AbstractDigitizerTable):
    """A Keysight oscilloscope at a VISA resource."""

    resource: Address
    backend: Backend = "@py"

    @property
    def resources(self) -> tuple[str, ...]:
        """Its address."""
        return (self.resource,)


class InfiniiVision(AbstractDigitizer, AbstractReadBack):
    """An oscilloscope over a `Scpi` session, triggered at its external input.

    Its memory decides how many samples a second a record of given length has; what came of it is
    in the record.

    >>> import numpy as np
    >>> from hardware import Acquisition, Input, InfiniiVision, Scpi
    >>> from hardware.simulated import Clock, SimulatedInfiniiVision, SimulatedLink
    >>> def light(now_s, first_s, count, sample_hz):  # a ramp at input 1, 100 V/s
    ...     return {1: 0.5 + 100.0 * (first_s + np.arange(count) / sample_hz)}
    >>> clock = Clock()
    >>> there = SimulatedInfiniiVision(light, clock=clock)
    >>> asked = Acquisition({"interferometer": Input(1, -0.2, 1.2)}, before_s=1e-4, after_s=2e-3)
    >>> with InfiniiVision(Scpi(SimulatedLink(there, clock=clock))) as scope:
    ...     scope.configure(asked)
    ...     scope.arm()
    ...     samples = scope.fetch(timeout_s=1.0).check(asked)
    >>> round(float(np.ptp(samples.volts("interferometer"))), 1) >= 0.2  # V in 2.1 ms
    True
    """

    kind = "infiniivision"
    Table = InfiniiVisionTable
    supports_dry_run = True

    @classmethod
    def open(cls, table: InfiniiVisionTable, connector: AbstractConnector) -> "InfiniiVision":
        """Connect and identify it."""
        link = connector.connect(table.resource, backend=table.backend)
        return cls(Scpi(link, timeout_s=THRESHOLDS.oscilloscope_reply_s))

    def __init__(self, scpi: Scpi) -> None:
        """Raises `InstrumentError` for any other instrument."""
        self.resource = scpi.resource
        self._scpi = scpi
        self._taken: list[str] = []  # headers of what `configure` has set
        self._identity = scpi.identify(IDENTITY)
        self._asked: Acquisition | None = None
        scpi.clear()

    @property
    def identity(self) -> str:
        """Its `*IDN?`."""
        return self._identity

    def configure(self, asked: Acquisition) -> None:
        """Inputs, time base, acquisition and trigger; each is read back."""
        self._asked, self._taken = None, []
        self._scpi.command(":STOP")
        self._choose(states.ACQUISITION)
        span = (asked.before_s + asked.after_s) * THRESHOLDS.span_reserve
        self._set(":TIM:RANG", span)
        # The reference stands a tenth from the left, and `position` is the time there.
        before_s = asked.before_s * THRESHOLDS.before_reserve
        self._set(":TIM:POS", self._scpi.number(":TIM:RANG?") / 10 - before_s)
        for one in asked.inputs.values():
            channel = f":CHAN{one.connector}"
            self._choose(states.of_input(one.connector))
            self._set(f"{channel}:PROB", 1.0)  # a range is in volts at the probe's tip
            self._set(f"{channel}:PROB:SKEW", 0.0)
            self._set(f"{channel}:RANG", one.high_v - one.low_v, at_least=True)
            self._set(f"{channel}:OFFS", (one.high_v + one.low_v) / 2)
        self._choose(states.TRIGGER)
        self._set(":TRIG:HOLD", states.HOLDOFF_S)
        self._set(":EXT:PROB", 1.0)  # else the level is not that at the connector
        self._set(":TRIG:EDGE:LEV", THRESHOLDS.trigger_level_v)
        self._asked = asked

    def arm(self) -> None:
        """One record, at the next trigger."""
        self._configured()
        self._scpi.command(":SING")

    def fetch(self, timeout_s: float) -> Samples:
        """The record, when it has come."""
        asked = self._configured()
        until = self._scpi.now() + timeout_s
        while int(self._scpi.text(":OPER:COND?", r"\+?\d{1,5}")) & _RUNNING:
            if self._scpi.now() >= until:
                self._scpi.command(":STOP")
                raise InstrumentError(
                    self._scpi.resource,
                    ":OPER:COND?",
                    "still waiting",
                    why=f"No trigger came within {timeout_s:g} s.",
                    cure="Connect the generator's trigger output to the external trigger input, "
                    "and see that the generator plays.",
                )
            self._scpi.sleep(THRESHOLDS.poll_s)
        read = {name: self._read(one.connector) for name, one in asked.inputs.items()}
        first = next(iter(read.values()))
        return Samples(
            codes={name: one[0] for name, one in read.items()},
            volts_per_code={name: one[1] for name, one in read.items()},
            zero_v={name: one[2] for name, one in read.items()},
            sample_hz=1 / first[3],
            start_s=first[4],
        )

    def snapshot(self) -> dict[str, str]:
        """Acquisition, time base, trigger, and each input."""
        return {"identity": self.identity} | self.settings()

    def settings(self) -> dict[str, str]:
        """Everything that `configure` has set, with the sampling rate and the inputs' impedance."""
        headers = [*self._taken, ":ACQ:SRAT"]
        headers += [f":CHAN{one.connector}:IMP" for one in self._configured().inputs.values()]
        return {header.strip(":"): self._scpi.text(f"{header}?") for header in headers}

    def close(self) -> None:
        """Stop waiting, and disconnect."""
        try:
            self._scpi.command(":STOP")
        finally:
            self._scpi.close()

    def _read(self, connector: int) -> tuple[np.ndarray, float, float, float, float]:
        """Codes, V a code, V at code 0, s a sample, s of the first sample."""
        for command in (
            f":WAV:SOUR CHAN{connector}", ":WAV:POIN:MODE RAW", ":WAV:POIN MAX",
            ":WAV:FORM WORD", ":WAV:BYT MSBF", ":WAV:UNS 0",
        ):  # fmt: skip
            self._scpi.command(command)
        line = self._scpi.text(":WAV:PRE?")
        numbers = _finite_numbers(line)
        if len(numbers) != 10 or not (0 < numbers[2] <= THRESHOLDS.most_samples and numbers[4] > 0):
            raise InstrumentError(
                self._scpi.resource,
                ":WAV:PRE?",
                line,
                why="The record's description has not ten numbers, or no samples.",
                cure="Arm it again; see that the input is switched on.",
            )
        _, _, points, _, step_s, origin_s, reference, per_code, origin_v, middle = numbers
        size = 2 * int(points)
        seconds = self._scpi.timeout_s + size / THRESHOLDS.bytes_per_s
        data = self._scpi.block(":WAV:DATA?", limit=size, size=size, timeout_s=seconds)
        codes = np.frombuffer(data, dtype=">i2").astype(np.int16)
        start_s = origin_s - reference * step_s
        return codes, per_code, origin_v - middle * per_code, step_s, start_s

    def _choose(self, states: dict[str, str]) -> None:
        for header, value in states.items():
            self._scpi.command(f"{header} {value}")
            read = self._scpi.text(f"{header}?")
            if not re.fullmatch(rf"{value}[a-zA-Z]*|\+{value}", read, re.IGNORECASE):
                raise self._differs(f"{header} {value}", read)
            self._taken.append(header)

    def _set(self, header: str, value: float, *, at_least: bool = False) -> None:
        self._scpi.command(f"{header} {value:.6E}")
        read = self._scpi.number(f"{header}?")
        near = max(abs(value), THRESHOLDS.setting_floor) * THRESHOLDS.setting_tolerance
        if not (value - near <= read and (at_least or read <= value + near)):
            raise self._differs(f"{header} {value:.6E}", f"{read:g}")
        self._taken.append(header)

    def _differs(self, command: str, read: str) -> InstrumentError:
        return InstrumentError(
            self._scpi.resource,
            command,
            read,
            why="The oscilloscope has another setting than the one it was given.",
            cure="Ask for a range or a time that it has, and see whether somebody operates it.",
        )

    def _configured(self) -> Acquisition:
        if self._asked is None:
            raise ValueError("The digitizer is not set up: call `configure` first.")
        return self._asked


def _finite_numbers(line: str) -> list[float]:
    """The numbers between commas; none where one of them is no finite number."""
    try:
        numbers = [_reply.number(part.strip()) for part in line.split(",")]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []
