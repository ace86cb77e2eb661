"""A simulated Keysight oscilloscope: the commands that the driver needs, and a memory."""

import math
import re
import time
from collections.abc import Callable

import numpy as np

from hardware.simulated.laser._digitizer import Digitizer

from ._infiniivision_states import InfiniiVisionStates
from ._infiniivision_transfer import Transfer
from ._messages import Unit
from ._scpi_instrument import AbstractScpiInstrument, Handler, number
from ._status import ScpiFault

IDENTITY = "KEYSIGHT TECHNOLOGIES,DSO-X 3034T,MY00000001,07.50.2021102830"
Light = Callable[[float, float, int, float], dict[int, np.ndarray] | None]
_BITS = 12
_DIVISIONS = 10  # of the time base
_LADDER = (1.0, 2.0, 5.0)
_TTL_V = 3.3  # of the pulses at its external trigger
_ELSEWHERE_S = 3.7e-3  # about that pulse, where a record begins by another trigger


class SimulatedInfiniiVision(AbstractScpiInstrument):
    """The oscilloscope as a state machine, triggered by what `light` plays.

    - `light(now_s, first_s, count, sample_hz)` gives what the inputs see from `first_s` about the
      next trigger after `now_s`: volts by connector; or nothing where no trigger comes.
    - `clock`: gives the time, s. `memory`: samples of a record, at most.
    """

    def __init__(
        self,
        light: Light,
        *,
        clock: Callable[[], float] = time.monotonic,
        memory: int = 4_000_000,
        fastest_hz: float = 50e6,
        identity: str = IDENTITY,
    ) -> None:
        self._light, self._clock = light, clock
        self._memory, self._fastest = memory, fastest_hz
        self._set = {"range": 1e-3, "position": 0.0, "level": 0.0, "external": 1.0}
        self.states = InfiniiVisionStates()
        self._transfer = Transfer()
        self._armed_s: float | None = None
        self._record: dict[int, np.ndarray] = {}
        super().__init__(identity, self.states.inputs)

    @property
    def sample_hz(self) -> float:
        """The fastest rate of a 1-2-5 ladder whose record fits in the memory."""
        most = min(self._memory / self._set["range"], self._fastest)
        decade = 10.0 ** math.floor(math.log10(most))
        return max(step * decade for step in _LADDER if step * decade <= most * (1 + 1e-9))

    @property
    def first_s(self) -> float:
        """Time of the first sample about the trigger, s: a whole number of sampling intervals."""
        first = self._set["position"] - self.states.reference * self._set["range"]
        return round(first * self.sample_hz) / self.sample_hz

    def commands(self) -> dict[str, Handler]:
        """Those that the driver needs."""

        def put(name: str, most: float, quantity: str = "", low: float | None = None) -> Handler:
            least = -most if low is None else low
            return lambda n, unit: self._set.update({name: number(unit, least, most, quantity)})

        def taken(n: int, unit: Unit) -> None:
            del n, unit

        commands: dict[str, Handler] = dict.fromkeys(("STOP", "RUN"), taken)
        commands |= {
            "TIMebase:SCALe": lambda n, unit: self._set.update(
                range=_DIVISIONS * number(unit, 2e-9, 50.0, "S")
            ),
            "TIMebase:SCALe?": lambda n, unit: f"{self._set['range'] / _DIVISIONS:+.5E}",
            "TIMebase?": self._timebase,
            "TIMebase:RANGe": put("range", 500.0, "S", 2e-8),
            "TIMebase:RANGe?": lambda n, unit: f"{self._set['range']:+.5E}",
            "TIMebase:POSition": put("position", 500.0, "S"),
            "TIMebase:POSition?": lambda n, unit: f"{self._set['position']:+.5E}",
            "EXTernal:PROBe": put("external", 1e4, low=1e-3),
            "EXTernal:PROBe?": lambda n, unit: f"{self._set['external']:+.5E}",
            "TRIGger:EDGE:LEVel": put("level", 8.0, "V"),
            "TRIGger:EDGE:LEVel?": lambda n, unit: f"{self._set['level']:+.5E}",
            "ACQuire:SRATe?": lambda n, unit: f"{self.sample_hz:+.5E}",
            "SINGle": self._arm,
            "DIGitize": self._digitize,
            "OPERegister:CONDition?": lambda n, unit: str(8 * self._waiting()),
            "WAVeform:PREamble?": self._preamble,
            "WAVeform:DATA?": self._data,
        }
        return commands | self._transfer.commands(_connector) | self.states.commands()

    def _arm(self, n: int, unit: Unit) -> None:
        del n, unit
        self._armed_s, self._record = self._clock(), {}

    def _digitize(self, n: int, unit: Unit) -> None:
        """`SINGle`, for the inputs that are named; what is asked next is answered when it is over.

        All of them where none is named.
        """
        for source in unit.parameters:
            _connector(source)
        self._arm(n, unit)
        self._busy_s += self._set["range"]
        self._take()

    def _waiting(self) -> bool:
        """Whether the record asked for is not there yet."""
        if self._armed_s is None:
            return False
        if self._clock() < self._armed_s + self._set["range"]:
            return True
        return not self._take()

    def _take(self) -> bool:
        """Take the record that was armed for, once its time has passed; whether it came."""
        if self._armed_s is None:
            return False
        external, first_s = self.states.external, self.first_s
        if external and not 0.0 < self._set["level"] / self._set["external"] < _TTL_V:
            return False
        first_s += 0.0 if external else _ELSEWHERE_S
        count = int(self._set["range"] * self.sample_hz)
        record = self._light(self._armed_s, first_s, count, self.sample_hz)
        if record is None:
            return False
        record = {n: self.states.acquire(n, v, self.sample_hz) for n, v in record.items()}
        self._record, self._armed_s = record, None
        return True

    def _timebase(self, n: int, unit: Unit) -> str:
        words, at = self.states.words, self._set
        return (
            f":TIM:MODE {words['TIMebase:MODE']};REF {words['TIMebase:REFerence']};"
            f"MAIN:RANG {at['range']:+.5E};POS {at['position']:+.5E}"
        )

    def _converter(self) -> Digitizer:
        at = self.states.inputs[self._transfer.source]
        half = at.range_v / 2
        return Digitizer(self.sample_hz, _BITS, at.offset_v - half, at.offset_v + half)

    def _volts(self) -> np.ndarray:
        self._waiting()
        if self._transfer.source not in self._record:
            raise ScpiFault(-221, "no record")
        return self._record[self._transfer.source]

    def _preamble(self, n: int, unit: Unit) -> str:
        del n, unit
        return self._transfer.preamble(self._volts(), self._converter(), self.first_s)

    def _data(self, n: int, unit: Unit) -> bytes:
        del n, unit
        return self._transfer.data(self._volts(), self._converter())


def _connector(source: str) -> int:
    found = re.fullmatch(r"(?i)CHAN(?:nel)?([1-4])", source)
    if not found:
        raise ScpiFault(-224, source)
    return int(found[1])
