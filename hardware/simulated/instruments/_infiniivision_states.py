"""States of the simulated oscilloscope, and what they make of what its inputs see."""

import dataclasses
from collections.abc import Callable

import numpy as np

from ._messages import Unit
from ._scpi_instrument import Handler, number, one, word
from ._status import ScpiFault

CONNECTORS = (1, 2, 3, 4)
_SMOOTHED = 16  # samples that an average or a high-resolution sample is made of
_DIVISIONS = 8  # of an input's range
_LABEL = 10  # characters
_SWITCH = ("0", "1", "OFF", "ON")
_INPUT = {
    "DISPlay": _SWITCH, "COUPling": ("DC", "AC"), "INVert": _SWITCH, "BWLimit": _SWITCH,
    "UNITs": ("VOLT", "AMPere"), "IMPedance": ("ONEMeg", "FIFTy"),
}  # fmt: skip
_WHOLE = {
    "ACQuire:MODE": ("RTIMe", "SEGMented"),
    "ACQuire:TYPE": ("NORMal", "AVERage", "HRESolution", "PEAK"),
    "TIMebase:MODE": ("MAIN", "WINDow", "XY", "ROLL"),
    "TIMebase:REFerence": ("LEFT", "CENTer", "RIGHt"),
    "TRIGger:MODE": ("EDGE", "GLITch", "PATTern"),
    "TRIGger:EDGE:SOURce": (*(f"CHANnel{n}" for n in CONNECTORS), "EXTernal", "LINE"),
    "TRIGger:EDGE:SLOPe": ("POSitive", "NEGative", "EITHer"),
    "TRIGger:EDGE:COUPling": ("DC", "AC", "LFReject"),
    "TRIGger:EDGE:REJect": ("OFF", "LFReject", "HFReject"),
    "TRIGger:HFReject": _SWITCH,
    "TRIGger:NREJect": _SWITCH,
    "TRIGger:SWEep": ("AUTO", "NORMal"),
}
_REFERENCES = {"LEFT": 0.1, "CENT": 0.5, "RIGH": 0.9}  # of the span, from the left


@dataclasses.dataclass
class InputState:
    """One input: `range_v` and `offset_v` at the probe's tip, and its words by header."""

    range_v: float = 8.0
    offset_v: float = 0.0
    probe: float = 1.0
    skew_s: float = 0.0
    label: str = ""
    words: dict[str, str] = dataclasses.field(
        default_factory=lambda: {name: _first(known) for name, known in _INPUT.items()}
    )

    def see(self, volts: np.ndarray, sample_hz: float) -> np.ndarray:
        """What is sampled of `volts` at the connector, V at the probe's tip."""
        volts = volts * self.probe
        if self.words["IMPedance"] == "FIFT":
            volts = volts / 2  # a source of 50 ohm into 50 ohm
        if self.words["COUPling"] == "AC":
            volts = volts - volts.mean()
        if self.words["INVert"] == "1":
            volts = -volts
        return np.roll(volts, round(self.skew_s * sample_hz)) if self.skew_s else volts


class InfiniiVisionStates:
    """Acquisition, trigger and inputs, by header; the first of each list after `*RST`."""

    def __init__(self) -> None:
        self.inputs = {n: InputState() for n in CONNECTORS}
        self.words = {header: _first(known) for header, known in _WHOLE.items()}
        self.words["TRIGger:EDGE:SOURce"] = "CHAN1"
        self.holdoff_s = 60e-9

    @property
    def reference(self) -> float:
        """Where the time reference stands, of the span from its left end."""
        return _REFERENCES[self.words["TIMebase:REFerence"]]

    @property
    def external(self) -> bool:
        """Whether each record begins at a rising edge of the external trigger input."""
        words = self.words
        return (
            words["TRIGger:MODE"] == "EDGE"
            and words["TRIGger:EDGE:SOURce"] == "EXT"
            and words["TRIGger:EDGE:SLOPe"] == "POS"
        )

    def acquire(self, n: int, volts: np.ndarray, sample_hz: float) -> np.ndarray:
        """What is in the memory of input `n`, V."""
        volts = self.inputs[n].see(volts, sample_hz)
        if self.words["ACQuire:TYPE"] in ("AVER", "HRES"):
            total = np.cumsum(np.concatenate([np.full(_SMOOTHED, volts[0]), volts]))
            return (total[_SMOOTHED:] - total[:-_SMOOTHED]) / _SMOOTHED
        return volts

    def commands(self) -> dict[str, Handler]:
        """By header."""
        table: dict[str, Handler] = {
            "TRIGger:HOLDoff": self._set_holdoff,
            "TRIGger:HOLDoff?": lambda n, unit: f"{self.holdoff_s:+.5E}",
        }
        table |= {
            "CHANnel{n}:SCALe": lambda n, unit: setattr(
                self.inputs[n], "range_v", _DIVISIONS * number(unit, 1e-3, 5.0, "V")
            ),
            "CHANnel{n}:SCALe?": lambda n, unit: f"{self.inputs[n].range_v / _DIVISIONS:+.5E}",
            "CHANnel{n}:LABel": self._set_label,
            "CHANnel{n}:LABel?": lambda n, unit: f'"{self.inputs[n].label}"',
            "CHANnel{n}?": self._tell_input,
        }
        for header, known in _WHOLE.items():
            table[header], table[f"{header}?"] = _word(lambda n: self.words, header, known)
        for name, known in _INPUT.items():
            header = f"CHANnel{{n}}:{name}"
            table[header], table[f"{header}?"] = _word(lambda n: self.inputs[n].words, name, known)
        for name, value in {
            "RANGe": ("range_v", 8e-3, 40.0, "V"),
            "OFFSet": ("offset_v", -40.0, 40.0, "V"),
            "PROBe": ("probe", 1e-3, 1e4, ""),
            "PROBe:SKEW": ("skew_s", -1e-7, 1e-7, "S"),
        }.items():
            header = f"CHANnel{{n}}:{name}"
            table[header], table[f"{header}?"] = self._value(*value)
        return table

    def _set_label(self, n: int, unit: Unit) -> None:
        given = one(unit)
        if len(given) < 2 or given[0] not in "\"'" or given[-1] != given[0]:
            raise ScpiFault(-224, "label")
        self.inputs[n].label = given[1:-1][:_LABEL].upper()

    def _tell_input(self, n: int, unit: Unit) -> str:
        at, words = self.inputs[n], self.inputs[n].words
        return (
            f":CHAN{n}:RANG {at.range_v:+.5E};OFFS {at.offset_v:+.5E};COUP {words['COUPling']};"
            f"IMP {words['IMPedance']};DISP {words['DISPlay']};BWL {words['BWLimit']};"
            f'INV {words["INVert"]};LAB "{at.label}";UNIT {words["UNITs"]};'
            f"PROB {at.probe:+.5E};PROB:SKEW {at.skew_s:+.5E};STYP SING"
        )

    def _set_holdoff(self, n: int, unit: Unit) -> None:
        del n
        self.holdoff_s = number(unit, 4e-8, 10.0, "S")

    def _value(self, field: str, low: float, high: float, quantity: str) -> tuple[Handler, Handler]:
        def put(n: int, unit: Unit) -> None:
            setattr(self.inputs[n], field, number(unit, low, high, quantity))

        return put, lambda n, unit: f"{getattr(self.inputs[n], field):+.5E}"


def _word(
    place: Callable[[int], dict[str, str]], name: str, known: tuple[str, ...]
) -> tuple[Handler, Handler]:
    def put(n: int, unit: Unit) -> None:
        try:
            given = word(unit, known)
        except ScpiFault:
            raise ScpiFault(-224, name) from None
        place(n)[name] = {"OFF": "0", "ON": "1"}.get(given, given) if known is _SWITCH else given

    return put, lambda n, unit: place(n)[name]


def _first(known: tuple[str, ...]) -> str:
    return "".join(c for c in known[0] if not c.islower())
