"""How the simulated oscilloscope gives a record: source, points, format; as its guide has it."""

from collections.abc import Callable

import numpy as np

from hardware.simulated.laser._digitizer import Digitizer

from ._messages import Unit
from ._scpi_instrument import Handler, boolean, number, one, word
from ._status import ScpiFault

_FORMATS = {"BYTE": 0, "WORD": 1, "ASC": 4}  # their numbers in a preamble
_BITS, _SHIFT = 12, 16  # codes stand at the upper end of 16 bits
_FEW = 62_500  # most points but for the raw record
_ASCII = 100_000  # most points as text


class Transfer:
    """Settings of `WAVeform`, and records in them; after `*RST` 8 bits and 1000 points."""

    def __init__(self) -> None:
        self.source = 1
        self._format, self._mode = "BYTE", "NORM"
        self._points, self._lsb_first, self._unsigned = 1000.0, False, True

    def commands(self, connector: Callable[[str], int]) -> dict[str, Handler]:
        """By header; `connector` reads the name of an input."""

        def choose(n: int, unit: Unit) -> None:
            self.source = connector(one(unit))

        def put(field: str, *known: str) -> Handler:
            return lambda n, unit: setattr(self, field, word(unit, known))

        def points(n: int, unit: Unit) -> None:
            self._points = number(unit, 100.0, 8e6)

        return {
            "WAVeform:SOURce": choose,
            "WAVeform:SOURce?": lambda n, unit: f"CHAN{self.source}",
            "WAVeform:FORMat": put("_format", "BYTE", "WORD", "ASCii"),
            "WAVeform:FORMat?": lambda n, unit: self._format,
            "WAVeform:POINts": points,
            "WAVeform:POINts?": lambda n, unit: f"{self._points:+.0f}",
            "WAVeform:POINts:MODE": put("_mode", "NORMal", "MAXimum", "RAW"),
            "WAVeform:POINts:MODE?": lambda n, unit: self._mode,
            "WAVeform:BYTeorder": lambda n, unit: setattr(
                self, "_lsb_first", word(unit, ("LSBFirst", "MSBFirst")) == "LSBF"
            ),
            "WAVeform:BYTeorder?": lambda n, unit: "LSBF" if self._lsb_first else "MSBF",
            "WAVeform:UNSigned": lambda n, unit: setattr(self, "_unsigned", boolean(unit)),
            "WAVeform:UNSigned?": lambda n, unit: str(int(self._unsigned)),
        }

    def preamble(self, volts: np.ndarray, converter: Digitizer, first_s: float) -> str:
        """The description of a record of `volts`."""
        every, count = self._thinned(volts.size)
        shift, zero = self._code(), float(converter.volts(np.zeros(1))[0])
        origin = self._offset()
        numbers = (
            _FORMATS[self._format], 0, count, 1, every / converter.sample_hz, first_s, 0,
            converter.volts_per_code / shift, zero, origin,
        )  # fmt: skip
        return ",".join(f"{x:+.10E}" if isinstance(x, float) else str(x) for x in numbers)

    def data(self, volts: np.ndarray, converter: Digitizer) -> bytes:
        """The record itself, as a block."""
        every, count = self._thinned(volts.size)
        volts = volts[: every * count : every].copy()
        codes = converter.codes(volts)
        if self._format == "ASC":
            if count > _ASCII:
                raise ScpiFault(-223, f"{count} points as text")
            data = ",".join(f"{v:+.5E}" for v in converter.volts(codes.astype(float))).encode()
        else:
            wide = (codes.astype(np.int64) * _SHIFT if self._format == "WORD" else codes // 16) + (
                self._offset()
            )
            kind = ("<" if self._lsb_first else ">") + ("u" if self._unsigned else "i")
            data = wide.astype(kind + ("2" if self._format == "WORD" else "1")).tobytes()
        return b"#8%08d" % len(data) + data

    def _code(self) -> float:
        """Codes of the format for one of the converter."""
        return 1 / 16 if self._format == "BYTE" else float(_SHIFT)

    def _offset(self) -> int:
        """The code of the format at the converter's zero."""
        return (128 if self._format == "BYTE" else 32768) * self._unsigned

    def _thinned(self, size: int) -> tuple[int, int]:
        """Every which sample is given, and how many."""
        most = self._points if self._mode == "RAW" else min(self._points, _FEW)
        every = max(1, int(np.ceil(size / most)))
        return every, size // every
