"""The streaming inverse in integers, as a gate array computes it, bit by bit."""

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from rapi_jax._precision import as_float64, float64

from ._compensator import StreamingCompensator
from ._fixed_formats import choose

Word = Int[Array, ""]
State = Int[Array, " plays"]


class Shifts(NamedTuple):
    """By how many bits a product moves right: after slope, weight and drive; and the guard bits."""

    slope: Word
    weight: Word
    drive: Word
    guard: Word


class FixedPointCompensator(eqx.Module):
    """Target word in, drive word out; the state is the plays' outputs, in words.

    The drive is found by successive approximation: from the highest bit down, a bit is kept where
    the response does not exceed the target, then the nearer of two neighbours is taken. So every
    sample takes the same `iterations`, without a division. Products are of 64 bits, and rounded to
    nearest, halves up, as they are shifted back; sums of the response carry guard bits. That
    nothing overflows, whatever the targets, is proved when it is made.

    - `r` to `high`: the operator in words, as in `Words`. `shifts`: where their points stand.
    - `bits`: of a word. `iterations`: for each sample. `widest`: bits of the widest intermediate.
    - `step_drive`, `origin`: what a word of drive is worth, and where 0 is, drive unit (V).
    - `step_response`, `centre`: the same of the response (GHz).

    >>> import numpy as np
    >>> from rapi_jax import FixedPointCompensator, StreamingCompensator
    >>> from rapi_jax.examples import paper_device
    >>> stream = StreamingCompensator.of(paper_device(), 10.0, within=(0.75, 5.25))
    >>> words = FixedPointCompensator.of(stream, bits=24)
    >>> wanted = 50.0 + 10.0 * np.sin(np.linspace(0.0, 6.0, 50))  # GHz
    >>> off = words.run(wanted)[1] - stream.run(wanted)[1]
    >>> int(words.bits), float(np.abs(off).max()) < 1e-5  # V
    (24, True)
    """

    r: Int[Array, " plays"]
    p: Int[Array, " plays"]
    lam: Int[Array, " plays"]
    offset: Int[Array, " plays"]
    bow: Word
    d: Int[Array, " terms"]
    start: Int[Array, " plays"]
    low: Word
    high: Word
    shifts: Shifts
    bits: Word
    iterations: Word
    widest: Word
    step_drive: Float[Array, ""]
    step_response: Float[Array, ""]
    origin: Float[Array, ""]
    centre: Float[Array, ""]

    @classmethod
    @float64
    def of(cls, compensator: StreamingCompensator, *, bits: int) -> "FixedPointCompensator":
        """`compensator` in words of `bits` bits, sign included.

        Raises `ValueError` where these do not do: a word or an intermediate of 64 bits would
        overflow in some history within the range of the drive.
        """
        frozen = compensator.frozen
        low, high = float(compensator.low), float(compensator.high)
        formats, words, widest = choose(frozen, low, high, bits)
        weight = formats.weight + formats.volts - formats.response - formats.guard
        shifts = (formats.slope, weight, bits - 1, formats.guard)
        return cls(
            **{name: _integer(value) for name, value in dataclasses.asdict(words).items()},
            shifts=Shifts(*(_integer(x) for x in shifts)),
            bits=_integer(bits),
            iterations=_integer((words.high - words.low).bit_length()),
            widest=_integer(widest),
            step_drive=as_float64(2.0**-formats.volts),
            step_response=as_float64(2.0**-formats.response),
            origin=frozen.origin,
            centre=as_float64(formats.centre),
        )

    @float64
    def initial(self) -> State:
        """At rest at the lowest drive (Eq. 13)."""
        return self.start

    @float64
    def step(self, state: State, target: Word) -> tuple[State, Word]:
        """The state after, and the drive for, one target, all in words."""
        wanted = target << self.shifts.guard
        reach = self.high - self.low

        def decide(i, kept):
            trial = kept + (jnp.ones_like(reach) << (self.iterations - 1 - i))
            stays = (trial <= reach) & (self._respond(self.low + trial, state) <= wanted)
            return jnp.where(stays, trial, kept)

        kept = jax.lax.fori_loop(0, self.iterations, decide, jnp.zeros_like(reach))
        x = self.low + kept
        above = jnp.minimum(x + 1, self.high)
        short = wanted - self._respond(x, state)
        x = jnp.where(self._respond(above, state) - wanted < short, above, x)
        return self._clamped(x, state), x

    @float64
    def encode(self, targets: Float[ArrayLike, " time"]) -> Int[Array, " time"]:
        """Targets in the response's unit as words, saturated at the ends; `ValueError` for NaN."""
        scaled = (np.asarray(targets, float) - float(self.centre)) / float(self.step_response)
        if np.isnan(scaled).any():
            raise ValueError("Argument `targets` must be numbers, but holds NaN.")
        point = 2.0 ** (int(self.bits) - 1)
        return _integer(np.clip(np.floor(scaled + 0.5), -point, point - 1.0))

    @float64
    def decode(self, drive: Int[Array, " time"]) -> Float[Array, " time"]:
        """Words of drive in the drive's unit, exactly."""
        return drive.astype(jnp.float64) * self.step_drive + self.origin

    @float64
    def run(
        self, targets: Float[ArrayLike, " time"], state: State | None = None
    ) -> tuple[State, Float[Array, " time"]]:
        """The state after, and the drives for, all `targets`, in the model's units."""
        first = self.initial() if state is None else state
        last, drive = _run(self, first, self.encode(targets))
        return last, self.decode(drive)

    def _respond(self, x: Word, before: State) -> Word:
        """Response to `x` after `before`, from `centre`, with guard bits (Eq. 16)."""
        value = self.d[-1]
        for k in range(self.d.shape[0] - 2, -1, -1):
            value = _shifted(value * x, self.shifts.drive) + self.d[k]  # Eq. (15)
        products = self.p * self._clamped(x, before)
        return value + jnp.sum(_shifted(products, self.shifts.weight))  # Eq. (14)

    def _clamped(self, x: Word, before: State) -> State:
        slope = self.lam + _shifted(self.bow * x, self.shifts.drive)
        upper = _shifted(slope * x, self.shifts.slope) + self.offset  # Eq. (12)
        return jnp.maximum(x - self.r, jnp.minimum(upper, before))  # Eq. (9)


def _shifted(value: Any, by: Word) -> Any:
    """`value / 2^by` to the nearest integer, halves up; `by` is at least 1."""
    return (value + (jnp.ones_like(by) << (by - 1))) >> by


def _integer(value: Any) -> Array:
    return jnp.asarray(np.asarray(value).astype(np.int64))


@eqx.filter_jit
def _run(compensator, state, targets):
    return jax.lax.scan(lambda state, target: compensator.step(state, target), state, targets)
