"""The exact inverse one sample at a time: a response wanted in, the drive for it out."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from rapi_jax._arguments import takes
from rapi_jax._ecdl import ECDL
from rapi_jax._errors import NotInvertible
from rapi_jax._precision import as_float64, float64
from rapi_jax.operators import AbstractOperator, InverseRAPI

from .._exact_inverse import at_maximum, at_minimum, extremes
from .._root import Scalar
from .._thresholds import THRESHOLDS as INVERSION
from ..certificate._certify import certify
from ._frozen_operator import FrozenOperator, operator_of, response_rounding
from ._thresholds import THRESHOLDS


class StreamingState(NamedTuple):
    """All that the next sample depends on, float64.

    - `drive`: the last one, where the next root is looked for first.
    - `plays`: the outputs of the plays, the whole memory (Eq. 9).
    - `error`: the largest |response - target| so far, response unit: rounding, unless a target was
      out of reach; NaN after one that was not a number.
    """

    drive: Float[Array, ""]
    plays: Float[Array, " plays"]
    error: Float[Array, ""]


class StreamingCompensator(eqx.Module):
    r"""Desired optical frequency in, drive out, causally, one sample at a time.

    After any past the response is an increasing function of the next drive,
    $y(u) = \sum_i p_i \max(u - r_i, \min(U_i(u), v_i)) + G(u)$ with the plays' last outputs $v_i$
    (Eqs. 9, 12, 16). So the drive turns where the target does, and a sample is one scalar root,
    found by a fixed number of Newton's steps inside a bracket. Scan rate, peak-to-peak drive and
    minimum being the same, these are the roots of `exact_inverse`.

    A target out of reach of the drives allowed gives the nearest of these; one that is not a number
    holds the last drive. Both show in `StreamingState.error`.

    >>> import numpy as np
    >>> from rapi_jax import StreamingCompensator, StreamingOperator, linear_scan
    >>> from rapi_jax.examples import paper_device
    >>> stream = StreamingCompensator.of(paper_device(), 10.0, within=(0.75, 5.25))
    >>> wanted = 50.0 + 10.0 * np.sin(np.linspace(0.0, 6.0, 50))  # GHz
    >>> _, drive = stream.run(wanted)
    >>> model = StreamingOperator(stream.frozen, stream.low)
    >>> float(np.abs(model.run(drive)[1] - wanted).max()) < 1e-9  # GHz
    True
    """

    frozen: FrozenOperator
    low: Float[Array, ""]
    high: Float[Array, ""]
    rounding: Float[Array, ""]

    @classmethod
    @takes(model=ECDL | AbstractOperator)
    @float64
    def of(
        cls,
        model: ECDL | AbstractOperator,
        freq: Any,
        *,
        within: tuple[Any, Any],
        u_pp: Any | None = None,
    ) -> "StreamingCompensator":
        """For drives `within` a lowest and a highest one, at scan rate `freq` (Hz).

        `u_pp` is the peak-to-peak drive in the thresholds (Eq. 11), by default the whole range. The
        device starts at rest at the lowest drive (Eq. 13).

        Raises `ValueError` where effects stand around the operator, or it is an `InverseRAPI`,
        which `StreamingOperator` applies as it is; `NotInvertible` where `certify` does not prove
        it monotone.
        """
        operator = _forward(model)
        low, high = float(within[0]), float(within[1])
        u_pp = high - low if u_pp is None else float(u_pp)
        certify(operator, low, high, float(freq), u_pp=u_pp).require()
        frozen = FrozenOperator.of(operator, freq, u_pp)
        rounding = response_rounding(frozen, low, high)
        return cls(frozen, *(as_float64(x) for x in (low, high, rounding)))

    @classmethod
    @takes(model=ECDL | AbstractOperator)
    @float64
    def for_scan(
        cls,
        model: ECDL | AbstractOperator,
        freq: Any,
        y: Float[ArrayLike, " time"],
        *,
        within: tuple[Any, Any],
    ) -> "StreamingCompensator":
        """For the scan `y`, known ahead: thresholds and start are those of its own drive.

        Fed with `y` it gives `exact_inverse(operator, y, freq, within=within)`. Raises as `of`, and
        `NotInvertible` where `y` leaves what the operator reaches `within`.
        """
        operator = _forward(model)
        y, rate = as_float64(y), as_float64(freq)
        low, high = (as_float64(x) for x in within)
        bottom, top = jnp.min(y), jnp.max(y)
        u_min, u_max = extremes(operator, bottom, top, rate, low, high, as_float64(1.0))
        plays = operator.plays(u_max - u_min, rate)
        off = jnp.abs(at_minimum(operator, u_min, plays) - bottom)
        off = jnp.maximum(off, jnp.abs(at_maximum(operator, u_max, u_min, plays) - top))
        if not float(off) <= INVERSION.inverse_error * float(top - bottom):
            raise NotInvertible(
                f"no drive between {float(low):g} and {float(high):g} takes the operator from "
                f"{float(bottom):g} to {float(top):g}: the nearest is {float(off):.3g} off."
            )
        return cls.of(operator, freq, within=(u_min, u_max))

    @float64
    def initial(self) -> StreamingState:
        """At rest at the lowest drive (Eq. 13)."""
        return StreamingState(self.low, self.frozen.rest(self.low), as_float64(0.0))

    @float64
    def step(
        self, state: StreamingState, target: Float[Array, ""]
    ) -> tuple[StreamingState, Float[Array, ""]]:
        """The state after, and the drive for, one `target` in the response's unit.

        Pure and without branches, for `jit`, `vmap` and the body of `lax.scan`; where the host has
        64-bit types off, JAX hands over targets as float32. For derivatives take `exact_inverse`.
        """
        target = target.astype(jnp.float64)
        found = self._root(state.plays, target, state.drive)
        drive = jnp.where(jnp.isnan(target), state.drive, found)
        error = self.frozen.respond(drive, state.plays)[0] - target
        plays = self.frozen.clamped(drive, state.plays)
        return StreamingState(drive, plays, jnp.maximum(state.error, jnp.abs(error))), drive

    @float64
    def run(
        self, targets: Float[ArrayLike, " time"], state: StreamingState | None = None
    ) -> tuple[StreamingState, Float[Array, " time"]]:
        """The state after, and the drives for, all `targets`; from `initial` unless given one."""
        state = self.initial() if state is None else state
        return _run(self, state, as_float64(targets))

    def _root(self, plays: Float[Array, " plays"], target: Scalar, u: Scalar) -> Scalar:
        """The drive whose response is `target`, looked for from `u`."""
        slack = INVERSION.inverse_error * (self.high - self.low)  # so that an end lies inside
        below, above = self.low - slack, self.high + slack
        for _ in range(THRESHOLDS.newton_steps):
            value, slope = self.frozen.respond(u, plays)
            off = value - target
            below, above = jnp.where(off <= 0.0, u, below), jnp.where(off >= 0.0, u, above)
            newton = jnp.clip(u - off / slope, self.low, self.high)
            inside = (newton > below) & (newton < above)  # false for NaN too
            # A bracket that rounding has closed leads nowhere.
            settled = (jnp.abs(off) <= self.rounding) & ~jnp.isnan(newton)
            middle = jnp.clip((below + above) / 2.0, self.low, self.high)
            u = jnp.where(inside | settled, newton, middle)
        return u


def _forward(model: ECDL | AbstractOperator) -> AbstractOperator:
    operator = operator_of(model)
    if isinstance(operator, InverseRAPI):
        raise ValueError(
            "Argument `model` must go from drive to response, but is an InverseRAPI, which gives "
            "the drive itself: `StreamingOperator` applies it."
        )
    return operator


@eqx.filter_jit
def _run(compensator, state, targets):
    # A bound method would be hashed by `scan`, and arrays have no hash.
    return jax.lax.scan(lambda state, target: compensator.step(state, target), state, targets)
