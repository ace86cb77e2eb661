"""One period of a laser's frequency from one period of a generator's waveform."""

import dataclasses
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from rapi_jax import ECDL
from rapi_jax._afg import POINTS, AfgWaveform
from rapi_jax._precision import float64
from rapi_jax.effects import AbstractDriveEffect, AbstractOpticalEffect

from ._drift import State
from ._dynamics import AbstractPhysics, Amplifier


@dataclasses.dataclass(frozen=True, eq=False)
class Scan:
    """The laser's frequency over a stretch of time that repeats for ever.

    - `nu`: GHz, in even steps; `periods`: of the drive in it.
    - `held`: each value lasts a whole step (a static device behind a generator); otherwise values
      stand in the middle of their steps and are joined by straight lines.
    """

    nu: np.ndarray
    rate_hz: float
    periods: int
    held: bool

    @property
    def steps_per_s(self) -> float:
        """Values a second."""
        return self.nu.size / self.periods * self.rate_hz

    def at(self, time: np.ndarray) -> np.ndarray:
        """Frequency at times after the drive's start (s, increasing), GHz."""
        place = time * self.steps_per_s
        if not self.held:
            place -= 0.5
        place -= self.nu.size * np.floor(place[0] / self.nu.size)
        index = place.astype(np.int64)  # positive: the same as rounding down
        more = int(index[-1]) // self.nu.size + 1
        nu = np.tile(self.nu, more) if more > 1 else self.nu
        if self.held:
            return nu[index]
        place -= index
        here = nu[index]
        there = np.append(nu, nu[0])[index + 1]
        there -= here
        there *= place
        there += here
        return there


@eqx.filter_jit
def _parts(device: ECDL, t: Any, u: Any, freq: Any) -> tuple[Any, Any]:
    for effect in device.effects:
        if isinstance(effect, AbstractDriveEffect):
            u = effect(t, u)
    return device.operator.hysteresis(u, freq), device.operator.memoryless(u)


@eqx.filter_jit
def _optical(device: ECDL, t: Any, nu: Any) -> Any:
    for effect in device.effects:
        if isinstance(effect, AbstractOpticalEffect):
            nu = effect(t, nu)
    return nu


@dataclasses.dataclass(frozen=True, eq=False)
class Device:
    """Amplifier and laser: volts of a generator to optical frequency, in the steady state.

    - `ecdl`: a model taken for the truth. Its effects see `settling + periods` periods, of which
      only the last ones are given out; they may depend on session time.
    - `amplifier`: before it. `after`: physics of the mirror and of the light behind it, in order.
    - `settling`: periods played before a record, for effects with memory of their own. A device
      without effects is in its steady state after the first.
    """

    ecdl: ECDL
    amplifier: Amplifier = Amplifier()
    after: tuple[AbstractPhysics, ...] = ()
    settling: int = 1

    @property
    def dynamic(self) -> bool:
        """Whether anything but the operator has a memory."""
        physics = (self.amplifier, *self.after)
        return bool(self.ecdl.effects) or any(p.dynamic for p in physics)

    @float64
    def scan(self, waveform: AfgWaveform, *, periods: int, start_s: float, state: State) -> Scan:
        """The frequency while `waveform` plays, `periods` of it from session time `start_s` on.

        Without effects of its own the device repeats, and one period is given. Evaluated once a
        code, or finer where something is dynamic.
        """
        rate, effects = waveform.frequency_hz, bool(self.ecdl.effects)
        finer = max(1, -(-POINTS // waveform.codes.size)) if self.dynamic else 1
        sample_hz = rate * waveform.codes.size * finer
        u = self.amplifier(np.repeat(waveform.volts, finer), sample_hz)
        first = int(np.argmin(u))  # from the minimum, where Eq. 13 is the steady state
        before = self.settling if effects else 0
        played = np.tile(np.roll(u, -first), before + (periods + 2 if effects else 1))
        t = start_s - before / rate + (np.arange(played.size) + first + 0.5) / sample_hz
        if effects:  # one period early, so that the record begins inside
            t -= 1.0 / rate
        numbers = (jnp.asarray(x) for x in (t, played, np.float64(rate)))
        time, drive, freq = numbers
        memory, memoryless = (np.asarray(x) for x in _parts(self.ecdl, time, drive, freq))
        nu = state.response(memory, memoryless)
        if effects:
            nu = np.asarray(_optical(self.ecdl, time, jnp.asarray(nu)))
        for physics in self.after:
            nu = physics(nu, sample_hz)
        if not effects:
            return Scan(np.roll(nu, first), rate, 1, not self.dynamic)
        begin = u.size * (before + 1) - first
        return Scan(nu[begin : begin + u.size * periods], rate, periods, False)
