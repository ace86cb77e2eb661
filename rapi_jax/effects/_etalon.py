"""Interference with a parasitic cavity in the light's path."""

from collections.abc import Iterable
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._errors import NotInvertible
from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractInvertible, AbstractOpticalEffect
from .base._contribution import Contribution
from .base._derived import HALF_LIGHT_MM_GHZ, Derived, ScanRange
from .base._first_guess import find_peaks, residual_power
from .base._residual_summary import ResidualSummary


class Etalon(AbstractOpticalEffect, AbstractInvertible):
    r"""Interference fixed in optical frequency, with $\theta = 2\pi\nu/F + \phi$.

    $$\nu + A \sqrt{1 - c^2} \sin\theta/(1 - c \sin\theta)$$

    `amplitude` is $A$, `spacing` $F$ (the parasitic cavity's free spectral range), `phase` $\phi$
    in rad. `sharpness` is $c$: 0 is the sine of two weak beams, and towards 1 (or -1) the fringes
    are the narrow peaks (or dips) of Airy's function, but for a constant, with a coefficient of
    finesse of $2c/(1 - c)$. It depends on the response alone, not on time. Where its slope is below
    -1 the response would not be monotonic within a scan: the laser then hops, and there is no
    inverse.

    Parasitic cavities in tunable lasers: Zorabedian, Tunable Lasers Handbook, 16.3.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Etalon
    >>> nu = jnp.array([0.0, 1.25, 2.5, 3.75])  # GHz
    >>> Etalon.at(amplitude=0.3, spacing=5.0)(nu, nu).round(3).tolist()  # GHz
    [0.0, 1.55, 2.5, 3.45]
    """

    name: ClassVar[str] = "etalon"
    label: ClassVar[str] = "an etalon in the light path"
    pointwise: ClassVar[bool] = True
    signature_axis: ClassVar = "response"
    remedy: ClassVar[str] = (
        "Tilt or coat what reflects. Where it stands between the laser and the interferometer that "
        "reads, and sends no light back into the laser, only the reading has the ripple: "
        "compensate the model of this diagnosis without it (`--without etalon`). "
        "Where light returns into the laser "
        "(no isolator), the optical frequency has it, too, and the corrected model compensates "
        "what is left."
    )
    in_reading_alone: ClassVar[str] = (
        "what reflects stands between the laser and the interferometer that reads, and sends no "
        "light back into the laser"
    )
    amplitude: Float[Array, ""] = parameter(unit="{x}", default=0.0)  # A
    phase: Float[Array, ""] = parameter(unit="rad", default=0.0)  # phi
    spacing: Float[Array, ""] = parameter(unit="{x}", default=5.0, positive=True)  # F
    sharpness: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(-0.95, 0.95))  # c

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        del t
        return nu + self._ripple(nu)[0]

    def _ripple(self, nu):
        """The ripple and its derivative by the response."""
        angle = 2.0 * jnp.pi * nu / self.spacing + self.phase
        height = self.amplitude * jnp.sqrt(1.0 - self.sharpness**2)
        below = 1.0 - self.sharpness * jnp.sin(angle)
        slope = height * jnp.cos(angle) / below**2 * 2.0 * jnp.pi / self.spacing
        return height * jnp.sin(angle) / below, slope

    @float64
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """Newton's method, with bisection where a step leaves the bracket."""
        del t
        fringe = self.spacing * jnp.linspace(0, 1, THRESHOLDS.etalon_slope_samples)
        steep = float(jnp.max(jnp.abs(self._ripple(fringe)[1])))
        if not steep < 1.0:
            raise NotInvertible(
                f"an etalon of amplitude {float(self.amplitude):.6g} and spacing "
                f"{float(self.spacing):.6g} turns the response back within a scan (it has a slope "
                f"of {steep:.3g}, which must stay below 1). Tilt or coat the surface that "
                "reflects, or leave the effect out of what is compensated."
            )

        return _invert_etalon(self, signal)

    def derived(self, scan: ScanRange) -> tuple[Derived, ...]:
        del scan
        path = Derived("optical length", "mm", "spacing", lambda f: HALF_LIGHT_MM_GHZ / f, True)
        return (path,)

    def signature_period(self) -> float:
        return float(self.spacing)

    def other_forms(self, here: Contribution) -> Iterable[Float[np.ndarray, "functions samples"]]:
        """Fringes of a second cavity beside its own, between half and twice as long."""
        nu, own = here.before - here.before.mean(), 1.0 / float(self.spacing)
        span = max(float(np.ptp(nu)), 1e-300)
        others = np.arange(0.5 * own, 2.0 * own, 1.0 / (THRESHOLDS.etalon_beat_steps * span))
        apart = np.abs(others - own) * span > THRESHOLDS.etalon_beat_apart
        mine = _fringes(nu, own, span)
        for other in others[apart]:
            yield here.rms * np.concatenate([mine, _fringes(nu, other, span)])

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[Etalon]":
        """The best spacings of slow and of fast ripples, at four phases each."""
        span = summary.span if np.isfinite(summary.span) and summary.span > 0 else 1.0
        # A third of a cycle apart: each sine still has nine tenths of its power between two. Fewer
        # than two cycles in a scan are a curve that the operator's polynomial draws as well.
        cycles = np.arange(6, 3 * THRESHOLDS.etalon_cycles + 1) / (3.0 * span)
        share = summary.sines(summary.response, cycles)
        fast = np.where(cycles * span < THRESHOLDS.etalon_fast_cycles, 0.0, share)
        count = THRESHOLDS.etalon_spacings
        chosen = dict.fromkeys(
            [*find_peaks(share, count, apart=2), *find_peaks(fast, count, apart=2)]
        )
        power = residual_power(summary)
        return [
            cls.at(
                amplitude=np.sqrt(2.0 * max(share[i], 1e-6) * power),
                phase=phase,
                spacing=1.0 / cycles[i],
            )
            for i in chosen
            for phase in np.arange(4) * np.pi / 2
        ]


def _fringes(
    nu: Float[np.ndarray, " samples"], cycles: float, span: float
) -> Float[np.ndarray, "4 samples"]:
    """A sine of any phase, and what it gains where `cycles` (a GHz) is a little off."""
    angle = 2.0 * np.pi * cycles * nu
    both = np.stack([np.sin(angle), np.cos(angle)])
    return np.concatenate([both, both * nu / span])


@eqx.filter_jit
def _invert_etalon(etalon: Etalon, signal: Float[Array, " time"]) -> Float[Array, " time"]:
    def closer(_, state):
        low, high, nu = state
        ripple, slope = etalon._ripple(nu)
        over = nu + ripple - signal
        low, high = jnp.where(over < 0, nu, low), jnp.where(over < 0, high, nu)
        newton = nu - over / (1.0 + slope)
        inside = (newton >= low) & (newton <= high)
        return low, high, jnp.where(inside, newton, (low + high) / 2.0)

    sharp = jnp.abs(etalon.sharpness)
    half = jnp.abs(etalon.amplitude) * jnp.sqrt((1.0 + sharp) / (1.0 - sharp))
    return jax.lax.fori_loop(
        0, THRESHOLDS.etalon_iterations, closer, (signal - half, signal + half, signal)
    )[2]
