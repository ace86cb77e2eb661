"""Base class of the operators: drive to response at one scan rate, with memory (Eqs. 9 to 16)."""

import abc
import dataclasses
import inspect
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, TypeVar, cast

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._errors import ModelError
from rapi_jax._parameter import parameters
from rapi_jax._precision import float64
from rapi_jax.plays._monotone_stretches import Stretches
from rapi_jax.plays._play import memory
from rapi_jax.plays._plays import Plays
from rapi_jax.recording._recording import Recording

Operator = TypeVar("Operator", bound="AbstractOperator")


class Fields(NamedTuple):
    """The names of an operator's fields with a part of their own in every operator.

    `polynomial`: the coefficients, from the first power on. `constant`: what is added to them.
    `origin`: the drive from which plays and polynomial count; `None` where that is 0.

    >>> from rapi_jax import RAPI
    >>> RAPI.fields.polynomial, RAPI.fields.constant, RAPI.fields.origin
    ('d', 'd_0', 'origin')
    """

    polynomial: str
    constant: str
    origin: str | None = None


@dataclasses.dataclass(frozen=True, eq=False)
class FlexibleForm:
    """A richer operator that begins as the same function of the drive as the one it came from.

    `deviations`: for each parameter, the standard deviation of its elements about where they begin.
    `held`: the parameters that do not move.

    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=100)
    >>> paper_device().operator.flexible(recording).operator.count  # plays, for 10
    24
    """

    operator: "AbstractOperator"
    deviations: Mapping[str, Any]
    held: tuple[str, ...] = ()


class AbstractOperator(eqx.Module):
    """Drive to response at one scan rate: a sum of plays and a polynomial.

    A new operator is one file with one class: it declares its parameters by `parameter(...)`, says
    which of them are the polynomial's (`fields`), and how the plays of a run follow (`plays`). It
    is constructed from its parameters by name, and from the number of plays where `count` is a
    field. What estimation may ask of it besides has defaults: `initial_guesses`, `held`,
    `linear_basis`, `couplings`, `flexible` and the class attributes.

    >>> import jax.numpy as jnp
    >>> from rapi_jax import AbstractOperator, RAPI
    >>> from rapi_jax.examples import paper_device
    >>> operator = paper_device().operator
    >>> thresholds = operator.plays(jnp.array(4.5), jnp.array(10.0)).r  # V
    >>> isinstance(operator, AbstractOperator), thresholds.shape
    (True, (10,))
    """

    fields: eqx.AbstractClassVar[Fields]
    count: eqx.AbstractVar[int]  # the number of plays, N1
    # Parameters that hold one number or one per play; a fit first ties those with one per play.
    tied_first: ClassVar[tuple[str, ...]] = ()
    # A parameter in which the weights of plays are linear: one number for all, or one per play.
    weight: ClassVar[str | None] = None
    # A parameter to which the weights of all plays are proportional, if hysteresis may fade by it.
    amplitude: ClassVar[str | None] = None

    @classmethod
    def from_parameters(cls: type[Operator], values: Mapping[str, Any], *, plays: int) -> Operator:
        """The operator with these values of its parameters, by name, and this number of plays."""
        named = inspect.signature(cls).parameters
        own = {name: plays for name in ("plays", "count") if name in named}
        return cls(**{**values, **own})

    @classmethod
    def initial_guesses(
        cls,
        recording: Recording,
        *,
        plays: int = 10,
        order: int = 3,
        each: Sequence[str] = (),
        count: int = 8,
    ) -> "Sequence[AbstractOperator]":
        """Up to `count` operators from which a fit to `recording` may start, best first.

        `plays` is N1, `order` N2; `each` names those of `tied_first` that get a value for each
        play. By default there is none: a fit then starts from the operator it is given.
        """
        del recording, plays, order, each, count
        return []

    @classmethod
    def guess(
        cls: type[Operator],
        recording: Recording,
        *,
        plays: int = 10,
        order: int = 3,
        each: Sequence[str] = (),
    ) -> Operator:
        """The best of `initial_guesses`, to start a fit from; `ModelError` where there is none.

        Where drives are near their zero it is the model's origin, too, as if it were the device's:
        `fitting.identify` also tries one that moves with the drives, and keeps what leaves less.
        """
        found = cls.initial_guesses(recording, plays=plays, order=order, each=each)
        if not found:
            raise ModelError(
                f"operator {cls.__name__} has no initial guess from a recording. Define "
                "its `initial_guesses`, or fit from one with values: `fit(ECDL(operator), ...)`."
            )
        return cast(Operator, found[0])

    @abc.abstractmethod
    def plays(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Plays:
        """The play operators of a run with peak-to-peak drive `u_pp` at scan rate `freq`."""

    def couplings(self, u_pp: list[float], freq: list[float]) -> dict[tuple[str, str], float]:
        """Bounds of one parameter that move with another, over the runs given.

        `{("zeta", "alpha"): -m}` reads: `zeta + m * alpha` is what the bounds of `zeta` hold for.
        """
        del u_pp, freq
        return {}

    def held(self, recording: Recording) -> set[str]:
        """Names of the parameters that `recording` cannot tell from others; a fit holds them."""
        del recording
        return set()

    def flexible(self, recording: Recording) -> FlexibleForm | None:
        """A richer hysteresis that begins as this operator on `recording`; `None`: there is none.

        A diagnosis credits an effect only with what this could not do either.
        """
        del recording
        return None

    @float64
    def linear_basis(self, u: Float[np.ndarray, "*time"]) -> dict[str, Float[np.ndarray, "*time"]]:
        """The columns in which the response to the drive `u` is linear, by their parameter's name.

        One for each element of the parameters declared `linear`: `d_0`, `d_1`, ... (Eq. 15).
        """
        centred = u
        if self.fields.origin is not None:
            centred = np.asarray(self.centred(jnp.asarray(u, dtype=jnp.float64)))
        columns = {self.fields.constant: np.ones_like(centred)}
        polynomial = next(p for p in parameters(self) if p.name == self.fields.polynomial)
        power = columns[self.fields.constant]
        for name in polynomial.names():
            power = power * centred
            columns[name] = power
        return columns

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
        stretches: Stretches | None = None,
    ) -> Float[Array, " time"]:
        """The memory function alone, `H` of Eq. 14."""
        plays = self.plays(jnp.ptp(u) if u_pp is None else u_pp, freq)
        u, u_min = self.centred(u), None if u_min is None else self.centred(u_min)
        start = plays.start(u, jnp.min(u) if u_min is None else u_min, initial)
        shape = (plays.r, plays.lam, plays.eta, plays.p)
        return memory(u, *shape, start, plays.bow, plays.u_0, stretches)  # Eq. (14)

    @float64
    def memoryless(self, u: Float[Array, "*time"]) -> Float[Array, "*time"]:
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
        stretches: Stretches | None = None,
    ) -> Float[Array, " time"]:
        """The response to `u` at scan rate `freq` (Hz).

        `initial` gives each play's first output as a fraction of its band, from 0 (lower) to 1
        (upper); without it Eq. 13 holds. `u_pp` and `u_min` are taken from `u` unless given, as
        they must be where `u` is only a part of its run. `stretches`: where the drive is monotone,
        if that is known; see `memory`.
        """
        hysteresis = self.hysteresis(u, freq, initial, u_pp, u_min, stretches)
        return hysteresis + self.memoryless(u)  # Eq. (16)


def per_play(value: Float[Array, "..."], count: int) -> Float[Array, " plays"]:
    """One value per play, whether `value` is shared (a scalar) or already one each."""
    return jnp.broadcast_to(value, (count,))


def check_shapes(operator: AbstractOperator, each: Sequence[str], single: Sequence[str]) -> None:
    """Refuse shapes that do not fit: `each` holds one number or one per play, `single` just one."""
    if operator.count < 1:
        raise ValueError(f"Argument `plays` must be at least 1, but is {operator.count}.")
    for name in each:
        shape = jnp.shape(getattr(operator, name))
        if shape not in ((), (operator.count,)):
            raise ValueError(
                f"Argument `{name}` must be a number or {operator.count} of them (one per play), "
                f"but has shape {shape}."
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
