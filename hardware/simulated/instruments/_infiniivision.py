"""A simulated Keysight oscilloscope: the commands that the driver needs, and a memory."""

import math
import re
import time
from collections.abc import Callable

import numpy as np

from hardware.simulated.laser._digitizer import Digitizer

from ._infiniivision_states import InfiniiVisionStates
from ._messages import Unit
from ._scpi_instrument import AbstractScpiInstrument, Handler, number, one
from ._status import ScpiFault

IDENTITY = "KEYSIGHT TECHNOLOGIES,DSO-X 3034T,MY00000001,07.50.2021102830"
Light = Callable[[float, float, int, float], dict[int, np.ndarray] | None]
_BITS, _SHIFT = 12, 16  # codes stand at the upper end of 16 bits
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
        self._source = 1
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

        obeyed = (
            "STOP", "RUN", "WAVeform:POINts", "WAVeform:POINts:MODE", "WAVeform:FORMat",
            "WAVeform:BYTeorder", "WAVeform:UNSigned",
        )  # fmt: skip
        commands: dict[str, Handler] = dict.fromkeys(obeyed, taken)
        commands |= {
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
            "WAVeform:SOURce": self._choose,
            "WAVeform:PREamble?": self._preamble,
            "WAVeform:DATA?": self._data,
        }
        return commands | self.states.commands()

    def _arm(self, n: int, unit: Unit) -> None:
        del n, unit
        self._armed_s, self._record = self._clock(), {}

    def _digitize(self, n: int, unit: Unit) -> None:
        """`SINGle`, for the inputs that are named; all of them where none is."""
        for source in unit.parameters:
            _connector(source)
        self._arm(n, unit)

    def _waiting(self) -> bool:
        """Whether the record asked for is not there yet."""
        if self._armed_s is None:
            return False
        if self._clock() < self._armed_s + self._set["range"]:
            return True
        external, first_s = self.states.external, self.first_s
        if external and not 0.0 < self._set["level"] / self._set["external"] < _TTL_V:
            return True
        first_s += 0.0 if external else _ELSEWHERE_S
        count = int(self._set["range"] * self.sample_hz)
        record = self._light(self._armed_s, first_s, count, self.sample_hz)
        if record is None:
            return True
        record = {n: self.states.acquire(n, v, self.sample_hz) for n, v in record.items()}
        self._record, self._armed_s = record, None
        return False

    def _choose(self, n: int, unit: Unit) -> None:
        del n
        self._source = _connector(one(unit))

    def _converter(self) -> Digitizer:
        at = self.states.inputs[self._source]
        half = at.range_v / 2
        return Digitizer(self.sample_hz, _BITS, at.offset_v - half, at.offset_v + half)

    def _volts(self) -> np.ndarray:
        if self._source not in self._record:
            raise ScpiFault(-221, "no record")
        return self._record[self._source]

    def _preamble(self, n: int, unit: Unit) -> str:
        del n, unit
        converter = self._converter()
        per_code = converter.volts_per_code / _SHIFT
        zero = float(converter.volts(np.zeros(1))[0])
        step = 1 / self.sample_hz
        numbers = (1, 0, self._volts().size, 1, step, self.first_s, 0, per_code, zero, 0)
        return ",".join(f"{x:+.10E}" if isinstance(x, float) else str(x) for x in numbers)

    def _data(self, n: int, unit: Unit) -> bytes:
        del n, unit
        codes = self._converter().codes(self._volts().copy()) * np.int16(_SHIFT)
        data = codes.astype(">i2").tobytes()
        return b"#8%08d" % len(data) + data


def _connector(source: str) -> int:
    found = re.fullmatch(r"(?i)CHAN(?:nel)?([1-4])", source)
    if not found:
        raise ScpiFault(-224, source)
    return int(found[1])
