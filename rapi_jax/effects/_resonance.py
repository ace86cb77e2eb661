"""A mechanical resonance of actuator and mirror mount."""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractInvertible, AbstractOpticalEffect
from .base._derived import Derived, ScanRange
from .base._first_guess import find_peaks
from .base._first_order_lags import invert_linear, respond_from_rest
from .base._linear import AbstractLagEffect, Modes, Past
from .base._residual_summary import ResidualSummary

_LOW, _HIGH = 20.0, 1e5  # Hz


class Resonance(AbstractOpticalEffect, AbstractLagEffect, AbstractInvertible):
    r"""Damped oscillator, by a share: $\omega_0^2 / (s^2 + 2 z \omega_0 s + \omega_0^2)$.

    $\omega_0 = 2\pi$ `hertz`, $z$ = `damping` (below critical), and `share` is the part of the
    displacement that goes through it: 0 none, which is no effect, 1 all. A turning point of a
    triangle with slope $S$ leaves ringing of amplitude $2S/\omega_0$ that decays in
    $1/(z\omega_0)$; a resonance too fast to be seen still delays by $2z/\omega_0$.

    Piezo-driven mirrors: Opt. Express 28, 16118.

    >>> import numpy as np
    >>> from rapi_jax.effects import Resonance
    >>> mirror = Resonance.at(hertz=1000.0, damping=0.05, share=1.0)
    >>> round(float(np.abs(mirror.transfer(np.array([1000.0])))[0]), 3)  # 1 / (2 x damping)
    10.0
    """

    name: ClassVar[str] = "resonance"
    label: ClassVar[str] = "a mechanical resonance"
    signature_axis: ClassVar = "since_turn"
    remedy: ClassVar[str] = "Compensate with the corrected model; round the corners of the scan."
    session: ClassVar[bool] = False
    strength: ClassVar = ("share",)
    hertz: Float[Array, ""] = parameter(unit="Hz", default=1000.0, bounds=(_LOW, _HIGH))
    damping: Float[Array, ""] = parameter(unit="1", default=0.05, bounds=(0.002, 0.95))  # z
    share: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(0.0, 1.5))

    @float64
    def modes(self) -> Modes:
        # Poles w0 (-z +- i r), r^2 = 1 - z^2, in partial fractions.
        r = jnp.sqrt(1.0 - self.damping**2)
        rate = 2.0 * jnp.pi * self.hertz
        tau = jax.lax.complex(self.damping / rate, r / rate)
        weight = jax.lax.complex(self.share, -self.share * self.damping / r)
        return Modes(tau[None], weight[None])

    def past(self) -> Past:
        return Past.of(0.0)

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The response of one run that begins at rest."""
        return respond_from_rest(self.modes(), t, nu)

    @float64
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        return invert_linear(self.modes(), t, signal)

    def derived(self, scan: ScanRange) -> tuple[Derived, ...]:
        del scan
        return (Derived("quality factor", "1", "damping", lambda damping: 1.0 / (2.0 * damping)),)

    @classmethod
    @float64
    def initial_guesses(cls, summary: ResidualSummary) -> "list[Resonance]":
        """A coarse grid of frequencies, and the best few of a fine one."""
        slowest = max(3.0 * max(summary.rates, default=0.0), 3.0 / max(summary.duration_s, 1e-6))
        low = float(np.clip(slowest, 1.5 * _LOW, _HIGH / 20))
        step = summary.step_s if summary.step_s > 0 else 1.0 / _HIGH
        high = float(np.clip(THRESHOLDS.ringing_fastest / step, 10.0 * low, 0.9 * _HIGH))
        coarse = [(f, z) for f in np.geomspace(low, high, 8) for z in (0.02, 0.3)]
        fine = np.geomspace(low, high, 60)
        found = [
            (fine[i], z, score[i])
            for z in (0.02, 0.1)
            for score in [_explained_power(summary, fine, z)]
            for i in find_peaks(score, THRESHOLDS.ringing_peaks, apart=1)
            if score[i] > 0
        ]
        found = sorted(found, key=lambda one: -one[2])
        best = [(f, z) for f, z, _ in found[: THRESHOLDS.ringing_candidates]]
        return [cls.at(hertz=f, damping=z, share=1.0) for f, z in [*best, *coarse]]


def _explained_power(summary: ResidualSummary, hertz: np.ndarray, damping: float) -> np.ndarray:
    """Fraction of the residual's power that a ringing at each of `hertz` explains.

    Beside a delay and a gain, in the fastest runs, which ring most.
    """
    power, explained = 0.0, np.zeros(hertz.size)
    fastest = np.argsort(-np.asarray(summary.rates), kind="stable")[: THRESHOLDS.ringing_runs]
    for k in fastest:
        mine = summary.run == k
        nu, rest, time = summary.response[mine], summary.residual[mine], summary.time[mine]
        if nu.size < THRESHOLDS.ringing_samples or not time[-1] > time[0]:
            continue
        line = np.linspace(0.0, 1.0, nu.size)
        level = nu - (nu[0] + (nu[-1] - nu[0]) * line)  # so that it closes on itself
        step = (time[-1] - time[0]) / (nu.size - 1)
        # A ringing too fast for the samples is seen at another frequency: finer, then read there.
        parts = max(1, int(np.ceil(THRESHOLDS.ringing_places * hertz.max() * step)))
        finer = np.interp(np.arange(nu.size * parts) / parts, np.arange(nu.size), level)
        ratio = np.fft.rfftfreq(finer.size, step / parts)[None, :] / hertz[:, None]
        gain = 1.0 / (1.0 - ratio**2 + 2j * damping * ratio)
        waves = np.fft.irfft((gain - 1.0) * np.fft.rfft(finer)[None, :], n=finer.size, axis=1)
        waves = waves[:, ::parts]
        known = np.stack([np.ones(nu.size), line, nu, np.gradient(nu)], axis=1)
        known = known / np.maximum(np.linalg.norm(known, axis=0), 1e-300)
        known, size, _ = np.linalg.svd(known, full_matrices=False)
        known = known[:, size > 1e-9 * size[0]]
        waves = waves - (waves @ known) @ known.T
        rest = rest - known @ (known.T @ rest)
        power += float(rest @ rest)
        explained += (waves @ rest) ** 2 / np.maximum((waves**2).sum(axis=1), 1e-300)
    return explained / power if power > 0 else explained
