"""Effects undone: from the response wanted back to what the operator must answer.

A linear effect is undone in the frequency domain, a static one point by point, a law by the numbers
it gives. What a coupling adds depends on the drive that is sent, which is what is looked for: it is
taken from the last drive found, in rounds, each corrected by the frequency response of the whole
loop, without which the rounds would grow wherever the coupling outweighs the device.
"""

from collections.abc import Sequence
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from rapi_jax._ecdl import ECDL
from rapi_jax._errors import NotInvertible
from rapi_jax._precision import as_float64
from rapi_jax.effects import (
    AbstractCouplingEffect,
    AbstractDriveEffect,
    AbstractEffect,
    AbstractInvertible,
    AbstractLagEffect,
    AbstractLawEffect,
    AbstractLinearEffect,
    AbstractOpticalEffect,
    Law,
    Modes,
)
from rapi_jax.effects.base._linear import Past
from rapi_jax.sampling._corners import corners

from ._thresholds import THRESHOLDS


def refuse(effects: Sequence[AbstractEffect]) -> None:
    """Raise `NotInvertible` where one of `effects` cannot be undone."""
    for effect in effects:
        coupled = isinstance(effect, AbstractCouplingEffect) and effect.steady
        if not (coupled or isinstance(effect, AbstractInvertible | AbstractLawEffect)):
            raise NotInvertible(
                f"the effect {effect.name} cannot be undone, so no drive allows for it. Leave it "
                f"out to compensate the others (`--without {effect.name}`, in Python "
                f'`ecdl.without("{effect.name}")`).'
            )


def drive_effects(ecdl: ECDL) -> list[AbstractEffect]:
    """Those before the operator, in order."""
    return [e for e in ecdl.effects if isinstance(e, AbstractDriveEffect)]


def response_effects(ecdl: ECDL) -> list[AbstractEffect]:
    """Those behind the operator, in order."""
    return [e for e in ecdl.effects if not isinstance(e, AbstractDriveEffect | AbstractLawEffect)]


def law_of(ecdl: ECDL, freq: float, u_pp: float, bias: float) -> Law:
    """What the operator's laws see of a run with the drive sent that is described."""
    law = Law.of(as_float64(freq), as_float64(u_pp))
    for effect in ecdl.effects:
        if isinstance(effect, AbstractLawEffect):
            law = effect(law, as_float64(bias))
    if not float(law.gain) > 0:
        raise NotInvertible(
            f"the laws give a gain of {float(law.gain):.4g} at {u_pp:.4g} V peak to peak centred "
            f"on {bias:.4g} V, which must be positive. Scan nearer to what was identified."
        )
    return law


def undo_effects(
    effects: Sequence[AbstractEffect], time: Array, signal: Array, sent: np.ndarray | None = None
) -> Array:
    """One period of `signal` before the effects, which act in order.

    `sent`: the drive that couples into the response; without it couplings are passed over.
    """
    for effect in reversed(effects):
        if isinstance(effect, AbstractCouplingEffect):
            signal = signal if sent is None else _uncoupled(effect, time, signal, sent)
        elif isinstance(effect, AbstractInvertible):
            signal = effect.inverse(time, signal)
    return signal


def _uncoupled(
    effect: AbstractCouplingEffect, time: Array, signal: Array, sent: np.ndarray
) -> Array:
    """The response that `effect`, with `sent` at hand, changes into `signal`."""
    size, wanted = signal.size, np.asarray(signal)
    clock = np.asarray(time)[0] + (np.arange(3 * size) - size) * float(time[1] - time[0])
    before = wanted
    for _ in range(THRESHOLDS.effect_iterations):
        three = (jnp.asarray(np.tile(x, 3)) for x in (before, sent))
        answer = np.asarray(effect(jnp.asarray(clock), *three))[size : 2 * size]
        off = wanted - answer
        before = before + off
        if np.abs(off).max() <= 1e-12 * np.ptp(wanted):
            return jnp.asarray(before)
    raise NotInvertible(
        f"the effect {effect.name} adds a part that grows with the response itself, and could not "
        "be taken off. Leave it out to compensate the others "
        f'(`--without {effect.name}`, in Python `ecdl.without("{effect.name}")`).'
    )


def loop(ecdl: ECDL, time: Array, sent: np.ndarray, slope: float) -> Complex[np.ndarray, " freq"]:
    """How a change of `sent` comes back through the couplings, by harmonic.

    `slope`: mean slope of the operator, response unit per drive unit.
    """
    step = float(time[1] - time[0])
    hertz = np.asarray(jnp.fft.rfftfreq(sent.size, step))
    turn = 2 * np.pi * hertz
    rise = (np.roll(sent, -1) - np.roll(sent, 1)) / (2 * step)
    inverse = np.ones(hertz.size, dtype=complex)
    total = np.zeros(hertz.size, dtype=complex)
    for effect in [*drive_effects(ecdl), *response_effects(ecdl)]:
        if isinstance(effect, AbstractLinearEffect):
            inverse = inverse / effect.transfer(hertz)
        elif isinstance(effect, AbstractCouplingEffect):
            none = as_float64(np.zeros(sent.size))
            added = -np.asarray(_uncoupled(effect, time, none, sent))
            size = float(rise @ added) / float(rise @ rise)
            derivative = 1j * np.sin(turn * step) / step
            total = total + size / slope * derivative * inverse
    return total


def from_minimum(value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One period from its minimum, with the sharp turning points between its samples.

    **Returns** the values, and at which of them the samples stand, in the order of `value`.
    """
    size = value.size
    at, height = corners(np.tile(value, 3))
    at = at - size
    inside = (at >= 0) & (at < size)
    phase = np.concatenate([np.arange(float(size)), at[inside]])
    levels = np.concatenate([value, height[inside]])
    first = int(np.argmin(levels))
    order = np.argsort((phase - phase[first]) % size, kind="stable")
    place = np.empty(order.size, dtype=int)
    place[order] = np.arange(order.size)
    return levels[order], place[:size]


class Steady(AbstractOpticalEffect, AbstractLagEffect):
    """A linear effect of the response that has long been driven, whatever its history says."""

    effect: AbstractLagEffect

    name: ClassVar = "steady"
    session: ClassVar = False

    @classmethod
    def initial_guesses(cls, evidence: object) -> list[AbstractEffect]:
        """None: it is no effect of its own."""
        del evidence
        return []

    def modes(self) -> Modes:
        return self.effect.modes()

    def past(self) -> Past:
        return Past.of(1.0)

    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        return self.effect(t, nu)  # type: ignore[operator]


def steady(ecdl: ECDL) -> ECDL:
    """The device long after its drive began."""
    effects = [
        Steady.at(effect=e) if isinstance(e, AbstractLagEffect) and e.session else e
        for e in ecdl.effects
    ]
    return ECDL(ecdl.operator, tuple(effects))
