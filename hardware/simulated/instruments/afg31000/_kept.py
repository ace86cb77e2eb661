"""Settings of the simulated generator that are kept and told, and change nothing it plays.

A program that sets them finds what it has set. Headers, ranges and values after `*RST` as in the
AFG31000 series' programmer manual.
"""

from collections.abc import Collection

from hardware.simulated.instruments._messages import Unit
from hardware.simulated.instruments._scpi_instrument import Handler, number, word

_SOURCES = ("INTernal", "EXTernal")
_FUNCTIONS = (
    "SINusoid", "SQUare", "TRIangle", "RAMP", "NRAMp", "PRNoise", "USER", "EMEMory", "EFILe",
)  # fmt: skip
_MODULATIONS = ("AM", "FM", "PM", "PWM")
_NUMBERS = {  # smallest, largest, after `*RST`, unit
    "SOURce{n}:PULSe:DELay": (0.0, 1e6, 0.0, "S"),
    "SOURce{n}:PULSe:TRANsition[:LEADing]": (2.5e-9, 1e3, 5e-9, "S"),
    "SOURce{n}:PULSe:TRANsition:TRAiling": (2.5e-9, 1e3, 5e-9, "S"),
    "SOURce{n}:SWEep:HTIMe": (0.0, 500.0, 0.0, "S"),
    "SOURce{n}:SWEep:RTIMe": (0.0, 500.0, 1e-3, "S"),
    "SOURce{n}:PWM[:DEViation]:DCYCle": (0.0, 50.0, 5.0, "PCT"),
    "SOURce{n}:PWM:INTernal:FREQuency": (2e-3, 1e6, 10e3, "HZ"),
    "TRIGger[:SEQuence]:TIMer": (1e-6, 500.0, 1e-3, "S"),
    "DISPlay:BRIGhtness": (0.0, 1.0, 1.0, ""),
}
_WORDS = {  # the first after `*RST`
    "SOURce{n}:PULSe:HOLD": ("DUTY", "WIDTh"),
    "SOURce{n}:SWEep:MODE": ("AUTO", "MANual"),
    "SOURce{n}:SWEep:SPACing": ("LINear", "LOGarithmic"),
    "SOURce{n}:FSKey:SOURce": _SOURCES,
    "TRIGger[:SEQuence]:SLOPe": ("POSitive", "NEGative"),
    **{f"SOURce{{n}}:{name}:SOURce": _SOURCES for name in _MODULATIONS},
    **{f"SOURce{{n}}:{name}:INTernal:FUNCtion[:SHAPe]": _FUNCTIONS for name in _MODULATIONS},
}

_FILES = (
    "SOURce{n}:FUNCtion:EFILe",
    *(f"SOURce{{n}}:{name}:INTernal:FUNCtion:EFILe" for name in _MODULATIONS),
)  # names of waveform files, of which there are none


class KeptSettings:
    """Numbers and words by header and channel."""

    def __init__(self, channels: Collection[int]) -> None:
        self._channels = channels
        self.reset()

    def reset(self) -> None:
        """As after `*RST`."""
        each = [(n, header) for n in self._channels for header in (*_NUMBERS, *_WORDS)]
        self._values: dict[tuple[int, str], float | str] = {
            (n, header): _NUMBERS[header][2] if header in _NUMBERS else _short(_WORDS[header][0])
            for n, header in each
        }

    def commands(self) -> dict[str, Handler]:
        """By header."""
        table: dict[str, Handler] = {}
        for header in (*_NUMBERS, *_WORDS):
            table[header], table[f"{header}?"] = self._pair(header)
        table |= {f"{header}?": lambda n, unit: '""' for header in _FILES}
        return table

    def _pair(self, header: str) -> tuple[Handler, Handler]:
        def put(n: int, unit: Unit) -> None:
            if header in _WORDS:
                self._values[n, header] = word(unit, _WORDS[header])
                return
            low, high, _, quantity = _NUMBERS[header]
            self._values[n, header] = number(unit, low, high, quantity)

        def tell(n: int, unit: Unit) -> str:
            value = self._values[n, header]
            return value if isinstance(value, str) else f"{value:.10E}"

        return put, tell


def _short(name: str) -> str:
    return "".join(c for c in name if not c.islower())
