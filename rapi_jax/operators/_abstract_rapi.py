"""What the operators of the RA-PI family share: plays and weights, and what a fit holds of them."""

import abc
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax.plays._plays import Plays
from rapi_jax.recording._recording import Recording

from ._base import AbstractOperator, Fields, check_shapes, per_play
from ._thresholds import THRESHOLDS


class AbstractRAPI(AbstractOperator):
    r"""RA-PI with thresholds by a law that each class has of its own; the rest is as in `RAPI`."""

    lam: eqx.AbstractVar[Float[Array, "*plays"]]
    eta: eqx.AbstractVar[Float[Array, "*plays"]]
    a: eqx.AbstractVar[Float[Array, "*plays"]]
    b: eqx.AbstractVar[Float[Array, ""]]
    tied_first: eqx.AbstractClassVar[tuple[str, ...]]
    fields: ClassVar = Fields("d", "d_0", "origin")
    weight: ClassVar = "a"
    amplitude: ClassVar = "a"

    def __check_init__(self):
        check_shapes(self, (*self.tied_first, "a"), ("zeta", "b", "d_0", "origin"))

    @abc.abstractmethod
    def thresholds(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Float[Array, " plays"]:
        """The thresholds of a run, in the drive's unit."""

    @property
    def rank(self) -> Float[Array, " plays"]:
        """The place of each play among all, $i / N_1$ of Eq. 11."""
        return jnp.arange(1.0, self.count + 1.0) / self.count

    def plays(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Plays:
        r = self.thresholds(u_pp, freq)
        p = per_play(self.a, self.count) * jnp.exp(-self.b * r)  # below Eq. (14)
        return Plays(r, per_play(self.lam, self.count), per_play(self.eta, self.count), p)


def one_amplitude(recording: Recording) -> bool:
    """Whether all runs have one peak-to-peak drive."""
    return len({round(d.u_pp, THRESHOLDS.amplitude_digits) for d in recording.drives}) == 1


def one_kind_of_scan(recording: Recording) -> bool:
    """Whether all runs have one scan rate and one amplitude."""
    return one_amplitude(recording) and len({d.rate for d in recording.drives}) == 1


def held_thresholds(
    operator: AbstractOperator, recording: Recording, *, scale: str, alike: bool
) -> set[str]:
    """`eta` or `scale`, and `zeta`, where the recording leaves the scale of thresholds open.

    Only `r (1 + eta)` and `b r` are seen in one scan, up to an offset. So where the thresholds of
    all runs are `alike`, or each run has an origin of its own, `eta` is held (where it has a value
    for each play, the parameter `scale`). Where no run has a scan rate, `zeta` is held too.
    """
    held = set()
    if alike or recording.response_origin == "run":
        held.add(scale if jnp.ndim(getattr(operator, "eta")) > 0 else "eta")  # noqa: B009
    if max(recording.rates) == 0:
        held.add("zeta")
    return held
