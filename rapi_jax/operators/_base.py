"""What every operator is: a map from drive to response at one scan rate, with memory."""

import abc
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax._precision import float64
from rapi_jax.plays._play import memory
from rapi_jax.plays._plays import Plays


class Fields(NamedTuple):
    """The names of an operator's fields with a part of their own in every operator.

    `polynomial`: the coefficients, from the first power on. `constant`: what is added to them.
    `origin`: the drive from which plays and polynomial count; `None` where that is 0.
    """

    polynomial: str
    constant: str
    origin: str | None = None


class AbstractOperator(eqx.Module):
    """Drive to response at one scan rate: a sum of plays and a polynomial.

    Subclasses declare their parameters by `parameter(...)`, say which of them are the polynomial's
    (`fields`), and how the plays of a run follow.
    """

    fields: eqx.AbstractClassVar[Fields]
    count: eqx.AbstractVar[int]  # the number of plays, N1

    @abc.abstractmethod
    def plays(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Plays:
        """The play operators of a run with peak-to-peak drive `u_pp` at scan rate `freq`."""

    @abc.abstractmethod
    def couplings(self, u_pp: list[float], freq: list[float]) -> dict[tuple[str, str], float]:
        """Bounds of one parameter that move with another, over the runs given.

        `{("zeta", "alpha"): -m}` reads: `zeta + m * alpha` is what the bounds of `zeta` hold for.
        """

    @property
    def coefficients(self) -> Float[Array, " order"]:
        """The polynomial's coefficients, from the first power on; their number is N2."""
        return getattr(self, self.fields.polynomial)

    @float64
    def centred(self, u: Float[Array, "*time"]) -> Float[Array, "*time"]:
        """The drive counted from the operator's origin, as plays and polynomial see it."""
        name = self.fields.origin
        return u if name is None else u - getattr(self, name)

    @float64
    def hysteresis(
        self,
        u: Float[Array, " time"],
        freq: Float[Array, ""],
        initial: Float[Array, " plays"] | None = None,
        u_pp: Float[Array, ""] | None = None,
        u_min: Float[Array, ""] | None = None,
    ) -> Float[Array, " time"]:
        """The memory function alone, `H` of Eq. 14."""
        plays = self.plays(jnp.ptp(u) if u_pp is None else u_pp, freq)
        u, u_min = self.centred(u), None if u_min is None else self.centred(u_min)
        start = plays.start(u, jnp.min(u) if u_min is None else u_min, initial)
        shape = (plays.r, plays.lam, plays.eta, plays.p)
        return memory(u, *shape, start, plays.bow, plays.u_0)  # Eq. (14)

    @float64
    def memoryless(self, u: Float[Array, " time"]) -> Float[Array, " time"]:
        """The memoryless function, `G` of Eq. 15, with the constant that the paper leaves out."""
        u = self.centred(u)
        total = jnp.zeros_like(u)
        for coefficient in self.coefficients[::-1]:
            total = (total + coefficient) * u  # Eq. (15)
        return total + getattr(self, self.fields.constant)

    @float64
    def __call__(
        self,
        u: Float[Array, " time"],
        freq: Float[Array, ""],
        *,
        initial: Float[Array, " plays"] | None = None,
        u_pp: Float[Array, ""] | None = None,
        u_min: Float[Array, ""] | None = None,
    ) -> Float[Array, " time"]:
        """The response to `u` at scan rate `freq` (Hz).

        `initial` gives each play's first output as a fraction of its band, from 0 (lower) to 1
        (upper); without it Eq. 13 holds. `u_pp` and `u_min` are taken from `u` unless given, as
        they must be where `u` is only a part of its run.
        """
        return self.hysteresis(u, freq, initial, u_pp, u_min) + self.memoryless(u)  # Eq. (16)


def check_shapes(operator: AbstractOperator, each: Sequence[str], single: Sequence[str]) -> None:
    """Refuse shapes that do not fit: `each` holds one number or one a play, `single` just one."""
    if operator.count < 1:
        raise ValueError(f"Argument `plays` must be at least 1, but is {operator.count}.")
    for name in each:
        shape = jnp.shape(getattr(operator, name))
        if shape not in ((), (operator.count,)):
            raise ValueError(
                f"Argument `{name}` must be a number or {operator.count} of them (one a play), but "
                f"has shape {shape}."
            )
    for name in single:
        if jnp.shape(getattr(operator, name)) != ():
            raise ValueError(f"Argument `{name}` must be a number, but is an array.")
    check_polynomial(operator)


def check_polynomial(operator: AbstractOperator) -> None:
    """Refuse a polynomial that is not a list of coefficients."""
    name = operator.fields.polynomial
    shape = jnp.shape(getattr(operator, name))
    if len(shape) != 1 or shape[0] < 1:
        raise ValueError(
            f"Argument `{name}` must list the polynomial's coefficients from the first power on, "
            f"but has shape {shape}."
        )
