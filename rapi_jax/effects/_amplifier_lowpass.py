"""A low-pass in the drive amplifier: its finite bandwidth."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from .base._by_place import AbstractDriveEffect, AbstractInvertible
from .base._derived import Derived, ScanRange
from .base._effect import AbstractEffect
from .base._first_order_lags import invert_linear, respond_from_rest
from .base._linear import AbstractLagEffect, Modes, Past
from .base._residual_summary import ResidualSummary


class AmplifierLowpass(AbstractDriveEffect, AbstractLagEffect, AbstractInvertible):
    r"""A first-order lag of the drive: $\tau \dot v = u - v$, transfer $1 / (1 + \tau s)$.

    An amplifier that charges a piezo of capacitance $C$ through a resistance $R$ has
    $\tau = R C$; its -3 dB bandwidth is $1 / (2 \pi \tau)$, 150 Hz to 6 kHz in practice. A scan of
    slope $S$ lags by $S \tau$ in its straight part, and its turns are rounded.

    >>> import equinox as eqx
    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import AmplifierLowpass
    >>> time, drive = jnp.arange(4.0) * 0.001, jnp.array([0.0, 0.0, 1.0, 1.0])
    >>> amplifier = eqx.filter_jit(AmplifierLowpass.at(tau=0.001))  # compiled whole
    >>> amplifier(time, drive).round(3).tolist()  # V
    [0.0, 0.0, 0.368, 0.767]
    """

    tau: Float[Array, ""] = parameter(unit="s", default=0.0, bounds=(0.0, 0.5))

    name: ClassVar[str] = "amplifier_lowpass"
    label: ClassVar[str] = "a low-pass in the drive amplifier"
    signature_axis: ClassVar = "since_turn"
    remedy: ClassVar[str] = "Compensate with the corrected model, or use a faster amplifier."
    session: ClassVar = False

    def derived(self, scan: ScanRange) -> tuple[Derived, ...]:
        del scan
        return (Derived("-3 dB bandwidth", "Hz", "tau", lambda tau: 1.0 / (2.0 * np.pi * tau)),)

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> list[AbstractEffect]:
        """Four lags, from one that shows at turns alone to one of a tenth of a branch."""
        return [cls.at(tau=tau) for tau in summary.lags]

    @float64
    def modes(self) -> Modes:
        return Modes(self.tau[None].astype(complex), jnp.ones(1, dtype=complex))

    @float64
    def past(self) -> Past:
        return Past.of(0.0)

    @float64
    def __call__(self, t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
        return respond_from_rest(self.modes(), t, u)

    @float64
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        return invert_linear(self.modes(), t, signal)
