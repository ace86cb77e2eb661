"""One output of the simulated generator: levels, clamp, load, relay, and the load's voltages."""

import dataclasses
import math

from hardware.simulated.instruments._status import ScpiFault

from ._playback import Playback

_OPEN_V = 10.0  # most into high impedance, either sign
_LEAST_PP = 0.002  # V into high impedance


@dataclasses.dataclass
class Seen:
    """Voltages that a load has seen, V at the load itself, whatever load the instrument is set to.

    - `low_v`, `high_v`: extremes while the output was on. `jump_v`: the largest change of a level
      meanwhile. `relay_v`: the largest voltage at which the relay opened or closed.
    - `fastest_hz`: the highest rate at which the waveform was repeated meanwhile, Hz.
    """

    low_v: float = math.inf
    high_v: float = -math.inf
    jump_v: float = 0.0
    relay_v: float = 0.0
    times_on: int = 0
    fastest_hz: float = 0.0


class AfgOutput:
    """Settings of one channel, in volts at the load that is set, and their rules.

    `play`: how the waveform is played; after a change of it, `record` keeps what the load saw.
    """

    def __init__(self, load_ohm: float, digits: int) -> None:
        """`load_ohm`: what is really connected; `digits`: of a level."""
        self._true_ohm = load_ohm
        self._digits = digits
        self.on = False
        self.seen = Seen()
        self.reset()

    def reset(self) -> None:
        """Settings as after `*RST`: off, set for 50 ohm, 1 V peak to peak."""
        self.switch(False)
        self.set_ohm = 50.0
        self.shape = "SIN"
        self.unit = "VPP"
        self.play = Playback()
        self._volts = {"low": -0.5, "high": 0.5, "clamp_low": -5.0, "clamp_high": 5.0}

    def level(self, name: str) -> float:
        """`low`, `high`, `clamp_low`, `clamp_high`, `offset` or `amplitude`, V."""
        low, high = self._volts["low"], self._volts["high"]
        if name == "offset":
            return (low + high) / 2
        return high - low if name == "amplitude" else self._volts[name]

    def at_load(self) -> tuple[float, float]:
        """The levels at what is really connected, V."""
        gain = _share(self._true_ohm) / _share(self.set_ohm)
        return self._volts["low"] * gain, self._volts["high"] * gain

    def set_level(self, name: str, value: float) -> None:
        """Set it, or leave it and raise `ScpiFault`.

        An offset keeps the amplitude, and an amplitude the offset: both move the two levels.
        """
        if name in ("offset", "amplitude"):
            offset = value if name == "offset" else self.level("offset")
            half = (value if name == "amplitude" else self.level("amplitude")) / 2
            self._set({"low": self._round(offset - half), "high": self._round(offset + half)})
        else:
            self._set({name: self._round(value)})

    def set_load(self, ohm: float) -> None:
        """Set another load: the same source, other voltages."""
        before = self.at_load()
        ratio = _share(ohm) / _share(self.set_ohm)
        self._volts = {name: value * ratio for name, value in self._volts.items()}
        self.set_ohm = ohm
        self.record(before)

    def switch(self, on: bool) -> None:
        """Close or open the relay."""
        if on != self.on:
            self.seen.relay_v = max(self.seen.relay_v, *map(abs, self.at_load()))
            self.seen.times_on += on
        self.on = on
        if on:
            self.record()

    def record(self, before: tuple[float, float] | None = None) -> None:
        """Keep what the load sees now; `before`: the levels that it has just left, V."""
        if not self.on:
            return
        low, high = self.at_load()
        before = (low, high) if before is None else before
        seen = self.seen
        seen.low_v, seen.high_v = min(seen.low_v, low), max(seen.high_v, high)
        seen.jump_v = max(seen.jump_v, abs(low - before[0]), abs(high - before[1]))
        seen.fastest_hz = max(seen.fastest_hz, self.play.fastest_hz)

    def _set(self, volts: dict[str, float]) -> None:
        new, share = self._volts | volts, _share(self.set_ohm)
        for value in volts.values():
            if abs(value) > _OPEN_V * share * (1 + 1e-9):
                raise ScpiFault(-222, f"{value:g} V")
        if not new["clamp_low"] < new["clamp_high"]:
            raise ScpiFault(-221, "limits cross")
        if new["high"] - new["low"] < _LEAST_PP * share * (1 - 1e-9):
            raise ScpiFault(-221, "high level below low level")
        if new["low"] < new["clamp_low"] or new["high"] > new["clamp_high"]:
            clamped = any("clamp" in name for name in volts)
            raise ScpiFault(-221 if clamped else -222, "voltage limit")
        before = self.at_load()
        self._volts = new
        self.record(before)

    def _round(self, value: float) -> float:
        return round(float(f"{value:.{self._digits}g}"), 4)


def _share(ohm: float) -> float:
    return 1.0 if math.isinf(ohm) else ohm / (ohm + 50.0)
