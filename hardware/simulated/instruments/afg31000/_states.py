"""Commands of the simulated generator for what a user may leave switched on.

Headers as in the AFG31000 series' programmer manual.
"""

import math
from collections.abc import Mapping

from hardware.simulated.instruments._messages import Unit
from hardware.simulated.instruments._scpi_instrument import Handler, boolean, number, one, word
from hardware.simulated.instruments._status import ScpiFault

from ._amplitude import amplitude_text, amplitude_volts
from ._output import AfgOutput

_MODULATIONS = {"AM": "AM:STATe", "FM": "FM:STATe", "PM": "PM:STATe", "FSK": "FSKey[:STATe]"}
_MODULATIONS |= {"PWM": "PWM:STATe"}
_VALUES = {  # header: field of `Playback`, smallest, largest, unit
    "PHASe[:ADJust]": ("phase_rad", -math.pi, math.pi, "RAD"),
    "AM:INTernal:FREQuency": ("modulation_hz", 2e-3, 1e6, "HZ"),
    "FM:INTernal:FREQuency": ("modulation_hz", 2e-3, 1e6, "HZ"),
    "PM:INTernal:FREQuency": ("modulation_hz", 2e-3, 1e6, "HZ"),
    "FSKey:INTernal:RATE": ("modulation_hz", 2e-3, 1e6, "HZ"),
    "FM[:DEViation]": ("fm_hz", 0.0, 25e6, "HZ"),
    "PM[:DEViation]": ("pm_rad", 0.0, math.pi, "RAD"),
    "FSKey:FREQuency": ("fsk_hz", 1e-6, 25e6, "HZ"),
    "FREQuency:STARt": ("sweep_from_hz", 1e-6, 25e6, "HZ"),
    "FREQuency:STOP": ("sweep_to_hz", 1e-6, 25e6, "HZ"),
    "SWEep:TIME": ("sweep_s", 1e-3, 500.0, "S"),
    "BURSt:TDELay": ("burst_delay_s", 0.0, 85.0, "S"),
}


class AfgStates:
    """Coupling of the channels, and how each plays; `outputs`: by number."""

    def __init__(self, outputs: Mapping[int, AfgOutput]) -> None:
        self._outputs = outputs
        self.reset()

    def reset(self) -> None:
        """Nothing is coupled; basic mode; the internal reference."""
        self._coupled: dict[str, set[int]] = {"VOLTage": set(), "FREQuency": set()}
        self.sequence = False
        self.reference = "INT"

    def set_level(self, name: str, n: int, value: float) -> None:
        """A level of a channel, and of the other where their voltages are coupled."""
        for each in self._follow("VOLTage", n):
            self._outputs[each].set_level(name, value)

    def set_frequency(self, n: int, hertz: float) -> None:
        """The rate of a channel, and of the other where their rates are coupled."""
        for each in self._follow("FREQuency", n):
            self._outputs[each].play.frequency_hz = hertz
            self._outputs[each].record()

    def commands(self) -> dict[str, Handler]:
        """By header."""
        table: dict[str, Handler] = {
            "OUTPut{n}:POLarity": self._set_polarity,
            "OUTPut{n}:POLarity?": lambda n, _: "INV" if self._play(n).inverted else "NORM",
            "SOURce{n}:FREQuency:MODE": self._set_mode,
            "SOURce{n}:FREQuency:MODE?": lambda n, unit: self._play(n).mode,
            "SOURce{n}:BURSt[:STATe]": self._set_burst,
            "SOURce{n}:BURSt[:STATe]?": lambda n, unit: str(int(self._play(n).burst)),
            "SOURce{n}:BURSt:MODE": self._set_burst_mode,
            "SOURce{n}:BURSt:MODE?": lambda n, unit: self._play(n).burst_mode,
            "SOURce{n}:BURSt:IDLE": self._set_idle,
            "SOURce{n}:BURSt:IDLE?": lambda n, unit: self._play(n).burst_idle,
            "SOURce{n}:COMBine:FEED": self._set_feed,
            "SOURce{n}:COMBine:FEED?": lambda n, unit: f'"{self._play(n).added}"',
            "SOURce{n}:POWer[:LEVel][:IMMediate][:AMPLitude]": self._set_share("noise_share", 50.0),
            "SOURce{n}:POWer[:LEVel][:IMMediate][:AMPLitude]?": self._tell_share("noise_share"),
            "SOURce{n}:VOLTage:UNIT": self._set_unit,
            "SOURce{n}:VOLTage:UNIT?": lambda n, unit: self._outputs[n].unit,
            "SOURce{n}:AM[:DEPTh]": self._set_share("am_depth", 120.0),
            "SOURce{n}:AM[:DEPTh]?": self._tell_share("am_depth"),
            "SOURce{n}:FUNCtion:RAMP:SYMMetry": self._set_share("symmetry"),
            "SOURce{n}:FUNCtion:RAMP:SYMMetry?": self._tell_share("symmetry"),
            "SOURce{n}:PULSe:DCYCle": self._set_share("duty", 99.999, 0.001),
            "SOURce{n}:PULSe:DCYCle?": self._tell_share("duty"),
            "SOURce{n}:PULSe:PERiod": lambda n, unit: self.set_frequency(
                n, 1 / number(unit, 4e-8, 1e6, "S")
            ),
            "SOURce{n}:PULSe:PERiod?": lambda n, unit: _told(1 / self._play(n).frequency_hz),
            "SOURce{n}:PULSe:WIDTh": self._set_width,
            "SOURce{n}:PULSe:WIDTh?": lambda n, unit: _told(
                self._play(n).duty / self._play(n).frequency_hz
            ),
            "SOURce{n}:BURSt:NCYCles": self._set_cycles,
            "SOURce{n}:BURSt:NCYCles?": lambda n, unit: _told(self._play(n).burst_cycles),
            "SOURce{n}:FREQuency:CENTer": self._set_sweep(True),
            "SOURce{n}:FREQuency:CENTer?": lambda n, unit: _told(self._play(n).sweep_hz[0]),
            "SOURce{n}:FREQuency:SPAN": self._set_sweep(False),
            "SOURce{n}:FREQuency:SPAN?": lambda n, unit: _told(self._play(n).sweep_hz[1]),
            "SEQControl[:STATe]": lambda n, unit: setattr(self, "sequence", boolean(unit)),
            "SEQControl[:STATe]?": lambda n, unit: str(int(self.sequence)),
            "[SOURce:]ROSCillator:SOURce": self._set_reference,
            "[SOURce:]ROSCillator:SOURce?": lambda n, unit: self.reference,
        }
        for quantity in self._coupled:
            header = f"SOURce{{n}}:{quantity}:CONCurrent[:STATe]"
            table[header], table[f"{header}?"] = self._coupling(quantity)
        for name, header in _MODULATIONS.items():
            header = f"SOURce{{n}}:{header}"
            table[header], table[f"{header}?"] = self._modulation(name)
        for header, value in _VALUES.items():
            header = f"SOURce{{n}}:{header}"
            table[header], table[f"{header}?"] = self._value(*value)
        header = "SOURce{n}:VOLTage[:LEVel][:IMMediate]"
        table[f"{header}:OFFSet"] = lambda n, unit: self.set_level(
            "offset", n, number(unit, quantity="V")
        )
        table[f"{header}:OFFSet?"] = lambda n, unit: f"{self._outputs[n].level('offset'):.4E}"
        table[f"{header}[:AMPLitude]"] = lambda n, unit: self.set_level(
            "amplitude", n, amplitude_volts(self._outputs[n], unit)
        )
        table[f"{header}[:AMPLitude]?"] = lambda n, unit: amplitude_text(self._outputs[n])
        return table

    def _play(self, n: int):
        return self._outputs[n].play

    def _follow(self, quantity: str, n: int) -> tuple[int, ...]:
        return tuple(self._outputs) if self._coupled[quantity] else (n,)

    def _coupling(self, quantity: str) -> tuple[Handler, Handler]:
        def put(n: int, unit: Unit) -> None:
            if not boolean(unit):
                self._coupled[quantity].discard(n)
                return
            self._coupled[quantity].add(n)  # at once the other takes what this channel has
            if quantity == "FREQuency":
                self.set_frequency(n, self._play(n).frequency_hz)
                return
            for name in ("offset", "amplitude"):
                self.set_level(name, n, self._outputs[n].level(name))

        return put, lambda n, unit: str(int(n in self._coupled[quantity]))

    def _modulation(self, name: str) -> tuple[Handler, Handler]:
        def put(n: int, unit: Unit) -> None:
            (self._play(n).modulation.add if boolean(unit) else self._play(n).modulation.discard)(
                name
            )
            self._outputs[n].record()

        return put, lambda n, unit: str(int(name in self._play(n).modulation))

    def _value(self, field: str, low: float, high: float, quantity: str) -> tuple[Handler, Handler]:
        def put(n: int, unit: Unit) -> None:
            setattr(self._play(n), field, number(unit, low, high, quantity))
            self._outputs[n].record()

        return put, lambda n, unit: f"{getattr(self._play(n), field):.10E}"

    def _set_polarity(self, n: int, unit: Unit) -> None:
        self._play(n).inverted = word(unit, ("NORMal", "INVerted")) == "INV"

    def _set_mode(self, n: int, unit: Unit) -> None:
        mode = word(unit, ("CW", "FIXed", "SWEep"))
        self._play(n).mode = "SWE" if mode == "SWE" else "CW"
        self._outputs[n].record()

    def _set_burst(self, n: int, unit: Unit) -> None:
        self._play(n).burst = boolean(unit)
        self._play(n).fired_s = -math.inf

    def _set_burst_mode(self, n: int, unit: Unit) -> None:
        self._play(n).burst_mode = word(unit, ("TRIGgered", "GATed"))

    def _set_idle(self, n: int, unit: Unit) -> None:
        self._play(n).burst_idle = word(unit, ("STARt", "DC", "END"))

    def _set_feed(self, n: int, unit: Unit) -> None:
        given = one(unit).strip("\"'")
        unit = unit._replace(parameters=(given,))
        self._play(n).added = word(unit, ("NOISe", "EXTernal", "BOTH")) if given else ""

    def _set_unit(self, n: int, unit: Unit) -> None:
        self._outputs[n].unit = word(unit, ("VPP", "VRMS", "DBM"))

    def _set_share(self, field: str, most: float = 100.0, least: float = 0.0) -> Handler:
        def put(n: int, unit: Unit) -> None:
            setattr(self._play(n), field, number(unit, least, most, "PCT") / 100)

        return put

    def _tell_share(self, field: str) -> Handler:
        return lambda n, unit: _told(100 * getattr(self._play(n), field))

    def _set_width(self, n: int, unit: Unit) -> None:
        period_s = 1 / self._play(n).frequency_hz
        self._play(n).duty = number(unit, 1e-5 * period_s, 0.99999 * period_s, "S") / period_s

    def _set_cycles(self, n: int, unit: Unit) -> None:
        endless = unit.parameters and unit.parameters[0].upper() in ("INF", "INFINITY")
        self._play(n).burst_cycles = math.inf if endless else float(int(number(unit, 1.0, 1e6)))

    def _set_sweep(self, centre: bool) -> Handler:
        def put(n: int, unit: Unit) -> None:
            play, value = self._play(n), number(unit, 0.0, 25e6, "HZ")
            middle, span = play.sweep_hz
            middle, span = (value, span) if centre else (middle, value)
            ends = middle - span / 2, middle + span / 2
            if not 1e-6 <= ends[0] <= ends[1] <= 25e6:
                raise ScpiFault(-222, f"{value:g}")
            play.sweep_from_hz, play.sweep_to_hz = ends
            self._outputs[n].record()

        return put

    def _set_reference(self, n: int, unit: Unit) -> None:
        del n
        self.reference = word(unit, ("INTernal", "EXTernal"))


def _told(value: float) -> str:
    return "9.9E+37" if math.isinf(value) else f"{value:.10E}"
