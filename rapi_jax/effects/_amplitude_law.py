"""How thresholds and gain follow the drive's amplitude and bias, beyond Eq. 11."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._effect import AbstractEffect
from .base._law import AbstractLawEffect, Law
from .base._residual_summary import ResidualSummary


class AmplitudeLaw(AbstractLawEffect):
    r"""Thresholds and gain that depend on amplitude and bias as Eq. 11 does not have it.

    $u_{pp}$ in the thresholds becomes $u_{pp} (u_{pp} / U)^k$, and the response about a pivot is
    multiplied by $1 + g (u_{pp} / U - 1) + h (\bar u - C)$, where $\bar u$ is the middle of the
    run's drive. `pivot` is counted from the operator's constant. Piezo materials gain with
    amplitude (Rayleigh's law) and with depoling bias.

    The effect is the identity at $U$ (`reference`) and $C$ (`centre`). With one amplitude neither
    $k$ nor $g$ is identifiable, with one bias $h$ is not.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import AmplitudeLaw, Law
    >>> law = Law.of(jnp.array(10.0), jnp.array(2.0))  # Hz, V peak to peak
    >>> float(AmplitudeLaw.at(gain=0.1)(law, jnp.array(3.0)).gain)
    1.1
    """

    threshold: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(-0.9, 2.0))  # k
    gain: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(-1.0, 1.0))  # g
    tilt: Float[Array, ""] = parameter(unit="1/{u}", default=0.0, bounds=(-1.0, 1.0))  # h
    pivot: Float[Array, ""] = parameter(unit="{x}", default=0.0)
    reference: Float[Array, ""] = parameter(  # U
        unit="{u}", default=1.0, positive=True, held=True
    )
    centre: Float[Array, ""] = parameter(unit="{u}", default=0.0, held=True)  # C

    name: ClassVar[str] = "amplitude_law"
    strength: ClassVar = ("gain", "threshold", "tilt")
    label: ClassVar[str] = "a dependence on amplitude or bias"
    remedy: ClassVar[str] = "Compensate with the corrected model, at amplitudes that it has seen."

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> list[AbstractEffect]:
        """Either sign of each parameter that the recording's amplitudes and biases identify."""
        swing = np.array([u for u in summary.u_pp if u > 0])
        if not swing.size:
            return []
        parts = [summary.drive[summary.run == run] for run in np.unique(summary.run)]
        middle = np.array([(part.min() + part.max()) / 2 for part in parts])
        # In the middle of what is seen, so that an absent part has exactly no effect.
        reference = float(swing.min() + swing.max()) / 2
        centre = float(middle.min() + middle.max()) / 2
        about = {"reference": reference, "centre": centre}
        found = []
        if np.ptp(swing) > THRESHOLDS.same_amplitude * reference:
            found += [cls.at(threshold=k, **about) for k in (0.15, -0.15)]
            found += [cls.at(gain=g, **about) for g in (0.02, -0.02)]
        if np.ptp(middle) > THRESHOLDS.same_amplitude * reference:
            tilt = min(0.01 / reference, 0.5)
            found += [cls.at(tilt=h, **about) for h in (tilt, -tilt)]
        return found

    @classmethod
    def search_ranges(cls, summary: ResidualSummary) -> dict[str, tuple[float, float]]:
        """The pivot within what the response reaches from zero drive, or a little beyond.

        A gain about a pivot far away is none: it only moves each run as a whole.
        """
        reach = summary.span * max(np.abs(summary.drive).max() / np.ptp(summary.drive), 1.0)
        return {"pivot": (-THRESHOLDS.pivot_reach * reach, THRESHOLDS.pivot_reach * reach)}

    @float64
    def __call__(self, law: Law, bias: Float[Array, ""]) -> Law:
        ratio = law.u_pp / self.reference
        grown = jnp.exp(self.threshold * jnp.log(jnp.where(ratio > 0, ratio, 1.0)))
        gain = 1.0 + self.gain * (ratio - 1.0) + self.tilt * (bias - self.centre)
        offset = gain * law.offset + (1.0 - gain) * self.pivot
        return law._replace(u_pp=law.u_pp * grown, gain=law.gain * gain, offset=offset)
