r"""The actuator of a simulated device: a sum of asymmetric play operators and a polynomial.

$\nu = \sum_i p_i \Gamma_i[u] + \sum_k d_k u^k$, with
$\Gamma = \max(u - r, \min(\lambda u + \eta r, \cdot))$, $r = \sigma_i u_{pp}/2 + \zeta_i f$ and
$p_i = a_i \exp(-(b r)^q)$. The paper's operator (Eqs. 9 to 16) has $\sigma_i = \alpha i/N$, one
$\zeta$, one $\lambda$ and $q = 1$; the others here have many operators, curved thresholds, other
densities of weights and shapes that differ from operator to operator.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ._plays import play_memory, stretch_index, turning_points

Array = npt.NDArray[np.float64]


def _identity(x: float) -> float:
    return x


def _one(_: float) -> float:
    return 1.0


@dataclass(frozen=True, eq=False)
class Piezo:
    """Drive in V to optical frequency in GHz; all arrays have one entry an operator."""

    share: Array  # threshold a half swing
    zeta: Array  # V/Hz
    lam: Array
    eta: Array
    weight: Array  # a, GHz/V
    decay: float  # b, 1/V
    power: float  # q
    curvature: float  # 1/V, curvature of the falling bound
    line: Array  # d_0 to d_4, GHz/V^k
    rate_law: Callable[[float], float] = _identity  # Hz to effective Hz
    swing_law: Callable[[float], float] = _one  # V to a factor on the threshold

    def thresholds(self, rate: float, swing: float) -> Array:
        """Thresholds r in V for one run (Eq. 11)."""
        return self.share * swing / 2 * self.swing_law(swing) + self.zeta * self.rate_law(rate)

    def weights(self, r: Array) -> Array:
        """Weights p in GHz/V of operators with thresholds `r`."""
        return self.weight * np.exp(-((self.decay * np.maximum(r, 0.0)) ** self.power))

    def respond(self, u: Array, rate: float, swing: float) -> tuple[Array, Array]:
        """Frequency of one run, and its hysteretic part, both in GHz.

        The hysteretic part is each operator's distance from the middle of its bounds.
        """
        r = self.thresholds(rate, swing)
        p = self.weights(r)
        ends = turning_points(u)
        held = play_memory(u, ends, (r,), (self.lam, self.eta * r), self.curvature)
        where = stretch_index(ends, len(u))
        curve = self.curvature * (u - 3) ** 2
        total = np.polynomial.polynomial.polyval(u, self.line)
        middle = (p.sum() * (u + curve) + (p @ self.lam) * u + p @ (r * (self.eta - 1))) / 2
        summed = np.zeros_like(u)
        for i in range(len(r)):
            low = u - r[i]
            high = self.lam[i] * u
            high += curve
            high += self.eta[i] * r[i]
            np.minimum(high, held[:, i][where], out=high)
            np.maximum(low, high, out=low)
            low *= p[i]
            summed += low
        return total + summed, summed - middle


def draw_paper_form(rng: np.random.Generator) -> Piezo:
    """A device that the paper's operator fits exactly, scattered about the published one."""
    n = int(rng.integers(8, 15))
    scale = float(rng.uniform(0.6, 1.05))
    ones = np.ones(n)
    return Piezo(
        share=float(rng.uniform(0.2, 0.36)) * np.arange(1, n + 1) / n,
        zeta=float(rng.uniform(3.5e-3, 8e-3)) * ones,
        lam=float(rng.uniform(1.2, 1.7)) * ones,
        eta=float(rng.uniform(0.85, 1.15)) * ones,
        weight=scale * float(rng.uniform(5.0, 7.5)) / n * ones,
        decay=float(rng.uniform(0.05, 0.25)),
        power=1.0,
        curvature=0.0,
        line=_line(rng, scale, 0.0),
    )


def draw_other_form(rng: np.random.Generator) -> Piezo:
    """A device that the paper's operator fits nearly: 30 to 60 operators under other laws.

    Its thresholds stay linear in rate and swing but for a part in a thousand: more would be the
    listed effects `rate_law` and `amplitude_law` under another name.
    """
    n = int(rng.integers(30, 61))
    x = (np.arange(n) + 0.5) / n
    scale = float(rng.uniform(0.6, 1.05))
    bend = float(rng.choice([rng.uniform(0.6, 0.8), rng.uniform(1.3, 1.8)]))
    density = _density(rng, x)
    tilt = rng.uniform(-1, 1, 3)
    kappa = float(rng.uniform(-1e-3, 1e-3))
    return Piezo(
        share=float(rng.uniform(0.22, 0.38)) * x**bend,
        zeta=float(rng.uniform(3.5e-3, 8e-3)) * (1 + 0.15 * tilt[0] * (x - 0.5)),
        lam=float(rng.uniform(1.25, 1.6)) + 0.15 * tilt[1] * (x - 0.5),
        eta=float(rng.uniform(0.9, 1.1)) + 0.15 * tilt[2] * (x - 0.5),
        weight=scale * float(rng.uniform(4.5, 7.0)) * density / density.sum(),
        decay=float(rng.uniform(0.1, 0.3)),
        power=float(rng.uniform(1.2, 2.0)),
        curvature=float(rng.uniform(-0.01, 0.01)),
        line=_line(rng, scale, 0.003),
        rate_law=lambda f: f * (1 + kappa * (f / 40.0 - 1)),
    )


def _density(rng: np.random.Generator, x: Array) -> Array:
    """Weights over the operators: a bump, two bumps or a ramp on a floor."""
    kind = int(rng.integers(3))
    if kind == 0:
        return 0.2 + np.exp(-(((x - rng.uniform(0.2, 0.6)) / rng.uniform(0.2, 0.4)) ** 2))
    if kind == 1:
        return 0.15 + np.exp(-(((x - 0.15) / 0.15) ** 2)) + 0.7 * np.exp(-(((x - 0.7) / 0.2) ** 2))
    return 0.1 + (x if rng.random() < 0.5 else 1 - x)


def _line(rng: np.random.Generator, scale: float, quartic: float) -> Array:
    """d_0 to d_4: near the published device's, the origin anywhere."""
    return np.array(
        [
            rng.uniform(-60.0, -20.0),
            scale * rng.uniform(16.0, 20.0),
            scale * rng.uniform(-1.3, -0.7),
            scale * rng.uniform(0.0, 0.03),
            scale * rng.uniform(-quartic, quartic),
        ]
    )
