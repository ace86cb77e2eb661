"""One period of a laser's frequency from one period of a generator's waveform."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rapi_jax import ECDL, AfgWaveform
from rapi_jax.internal import (
    POINTS,
    DriveBatch,
    drive_side,
    float64,
    laws,
    needs_spare_nodes,
    on_device,
    optical_side,
    with_spare_nodes,
)

from ._abstract_device import AbstractDevice
from ._drift import State
from ._dynamics import AbstractPhysics, Amplifier
from ._scan import Scan


def _played(u: np.ndarray, rate: float, begin_s: float, periods: int) -> DriveBatch:
    """One period `u` from its minimum, played from `begin_s` on after a lead-in of one period."""
    size, period = u.size, 1.0 / rate
    low, u_pp = float(u.min()), float(np.ptp(u))
    node_time = begin_s + (np.arange(2 * size) - 2 * size) * (period / size)
    time = begin_s + (np.arange(size * (periods + 1)) - size) * (period / size)
    lead = np.array([size])
    return on_device(
        {
            "node_time": node_time[None, :],
            "node_u": np.tile(u, 2)[None, :],
            "node_lead": lead,
            "time": time[None, :],
            "place": np.tile(np.arange(size, 2 * size), periods + 1)[None, :],
            "lead": lead,
            "period_s": np.array([period]),
            "gap_s": np.array([np.inf]),
            "freq": np.array([rate]),
            "u_pp": np.array([u_pp]),
            "u_min": np.array([low]),
            "bias": np.array([low + u_pp / 2.0]),
        }
    )


@eqx.filter_jit
def _parts(device: ECDL, drives: DriveBatch) -> tuple[Any, Any]:
    """Memory and memoryless function (Eq. 16) on the nodes, as drive effects and laws have them."""
    spare = needs_spare_nodes(device.effects)
    reached = drive_side(device.effects, with_spare_nodes(drives) if spare else drives)
    operator, u = device.operator, reached.node_u[0]
    law = laws(device.effects, drives)
    law = jax.tree_util.tree_map(lambda x: x[0], law)
    constant = getattr(operator, operator.fields.constant)
    memory = operator.hysteresis(u, law.freq, None, law.u_pp, jnp.min(u))
    every = 2 if spare else 1
    memory, memoryless = memory[::every], operator.memoryless(u)[::every]
    return law.gain * memory, law.after(memoryless, constant)


@eqx.filter_jit
def _optical(device: ECDL, drives: DriveBatch, nu: Any) -> Any:
    return optical_side(device.effects, drives, nu[None, :])[0]


@dataclasses.dataclass(frozen=True, eq=False)
class Device(AbstractDevice):
    """Amplifier and laser: volts of a generator to optical frequency, in the steady state.

    - `ecdl`: a model taken for the truth. Its effects see the session's time. Linear ones are in
      their periodic state from the start; creep begins with the drive, `settling + 1` periods
      before the record, as its own history says. It goes on within a measurement, and is not
      carried from one measurement to the next.
    - `amplifier`: before it. `after`: physics of the mirror and of the light behind it, in order.
    - `settling`: periods played before a record, for effects that take time to settle. A device
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

    @property
    def repeats(self) -> bool:
        """Whether nothing in it remembers more than one period."""
        return not self.ecdl.effects

    def provenance(self) -> dict[str, str]:
        """Operator, amplifier, physics behind them."""
        return {
            "device": type(self.ecdl.operator).__name__,
            "amplifier": repr(self.amplifier),
            "physics": repr(self.after),
        }

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
        before = self.settling + 1 if effects else 0  # one early: the record begins inside
        begin_s = start_s - before / rate + (first + 0.5) / sample_hz
        # Without effects the nodes alone are needed.
        drives = _played(np.roll(u, -first), rate, begin_s, before + periods + 1 if effects else 0)
        memory, memoryless = (np.asarray(x) for x in _parts(self.ecdl, drives))
        nu = state.response(memory, memoryless)
        if effects:
            nu = np.asarray(_optical(self.ecdl, drives, jnp.asarray(nu[drives.place[0]])))
        nu = nu[u.size :]  # less the period that comes before, on nodes and samples alike
        for physics in self.after:
            nu = physics(nu, sample_hz)
        if not effects:
            return Scan(np.roll(nu, first), rate, 1, not self.dynamic)
        begin = u.size * before - first
        return Scan(nu[begin : begin + u.size * periods], rate, periods, False)
