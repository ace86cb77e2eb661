"""A turn of the laser: two branches of phase joined at a corner, fitted to the fringes."""

import dataclasses
import math

import numpy as np

from rapi_jax.readout._levenberg_marquardt import levenberg_marquardt

from ._thresholds import THRESHOLDS

# Columns of the parameter vector.
_T0, _PHI, _R1, _C1, _R2, _C2, _LOG_T, _A, _B = range(9)


@dataclasses.dataclass(frozen=True, eq=False)
class TurnFit:
    """One fitted turn; times in s, phase in rad, rising before the turn by convention.

    - `vector`: corner, phase there, rate and curvature before, rate and curvature after, log of
      the rounding time, amplitude, offset; in the fit's own `unit` of time, from `centre`.
    - `time_s`, `stderr_s`: when the rate passes zero. `rounding_s`: 0 for a sharp corner.
    - `misfit`: mean squared residual. `cost`: sum of squared residuals over `count` values.
    """

    vector: np.ndarray
    rounded: bool
    centre: float
    unit: float
    time_s: float
    stderr_s: float
    cost: float
    count: int

    @property
    def misfit(self) -> float:
        """Mean squared residual of the normalised fringes."""
        return self.cost / max(1, self.count)

    @property
    def free(self) -> int:
        """Number of fitted parameters."""
        return 9 if self.rounded else 8

    @property
    def rounding_s(self) -> float:
        """Time constant of the corner, s; 0 where it is sharp."""
        return float(np.exp(self.vector[_LOG_T]) * self.unit) if self.rounded else 0.0

    @property
    def is_turn(self) -> bool:
        """Whether the phase rises before the corner and falls after it."""
        return bool(self.vector[_R1] > 0 > self.vector[_R2])

    def phase(self, time: np.ndarray) -> np.ndarray:
        """Phase at `time` (s), rad; rises before the turn and falls after it."""
        return branches(self.vector, (time - self.centre) / self.unit, self.rounded)[0]

    def rate_hz(self, time: np.ndarray) -> np.ndarray:
        """Fringe rate at `time` (s), with sign, Hz."""
        rate = branches(self.vector, (time - self.centre) / self.unit, self.rounded)[1]
        return rate / (2 * np.pi * self.unit)


def branches(p: np.ndarray, t: np.ndarray, rounded: bool) -> tuple[np.ndarray, np.ndarray]:
    """Phase and rate of the two branches.

    After the corner the rate goes from that before it to its own with `exp(-s/T)`: what a
    first-order lag makes of a corner.
    """
    s = t - p[_T0]
    after = s > 0
    r = np.where(after, p[_R2], p[_R1])
    c = np.where(after, p[_C2], p[_C1])
    phase = p[_PHI] + r * s + c * s**2 / 2
    rate = r + c * s
    if rounded:
        tau = np.exp(p[_LOG_T])
        decay = np.where(after, np.exp(-np.maximum(s, 0.0) / tau), 1.0)
        jump = p[_R1] - p[_R2]
        phase = phase + np.where(after, jump * tau * (1 - decay), 0.0)
        rate = rate + np.where(after, jump * decay, 0.0)
    return phase, rate


def _model(p: np.ndarray, t: np.ndarray, rounded: bool) -> tuple[np.ndarray, np.ndarray]:
    """Fringes and their derivatives with respect to `p`."""
    phase, rate = branches(p, t, rounded)
    s = t - p[_T0]
    after = s > 0
    jac = np.zeros((t.size, 9))
    jac[:, _T0] = -rate
    jac[:, _PHI] = 1.0
    jac[:, _R1] = np.where(after, 0.0, s)
    jac[:, _C1] = np.where(after, 0.0, s**2 / 2)
    jac[:, _R2] = np.where(after, s, 0.0)
    jac[:, _C2] = np.where(after, s**2 / 2, 0.0)
    if rounded:
        tau = np.exp(p[_LOG_T])
        decay = np.where(after, np.exp(-np.maximum(s, 0.0) / tau), 1.0)
        gone = np.where(after, tau * (1 - decay), 0.0)
        jac[:, _R1] += gone
        jac[:, _R2] -= gone
        slow = np.where(after, 1 - decay - np.maximum(s, 0.0) / tau * decay, 0.0)
        jac[:, _LOG_T] = (p[_R1] - p[_R2]) * slow * tau
    jac *= (-p[_A] * np.sin(phase))[:, None]
    jac[:, _A] = np.cos(phase)
    jac[:, _B] = 1.0
    return p[_A] * np.cos(phase) + p[_B], jac


def _vertex(p: np.ndarray, rounded: bool) -> float:
    """Where the rate passes zero, in the fit's unit of time."""
    if not rounded:
        if p[_R1] >= 0 >= p[_R2]:
            return float(p[_T0])
        # A corner a little off its own extremum: the branch that contains it decides.
        r, c = (p[_R1], p[_C1]) if p[_R1] < 0 else (p[_R2], p[_C2])
        return float(p[_T0] - r / c) if c < 0 else float(p[_T0])
    if p[_R1] <= 0:
        return float(p[_T0] - p[_R1] / p[_C1]) if p[_C1] < 0 else float(p[_T0])
    tau, jump = float(np.exp(p[_LOG_T])), float(p[_R1] - p[_R2])
    after, curve = float(p[_R2]), float(p[_C2])

    def rate(x: float) -> float:
        return after + curve * x + jump * math.exp(-x / tau)

    high = tau
    for _ in range(12):
        if rate(high) < 0:
            break
        high *= 2
    low = 0.0
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (low, middle) if rate(middle) < 0 else (middle, high)
    return float(p[_T0]) + (low + high) / 2


def fit_turn(
    t: np.ndarray,
    y: np.ndarray,
    start: np.ndarray,
    *,
    rounded: bool,
    centre: float,
    unit: float,
    steps: int = 40,
    final: bool = False,
) -> TurnFit:
    """Least squares of the turn model on normalised fringes `y` at `t` (units of `unit`).

    With `final` the turn's time gets its standard error; it takes each residual's own size (noise
    of phase is large on a fringe's flank, small on its top).
    """
    active = np.array([i for i in range(9) if rounded or i != _LOG_T])

    def filled(values: np.ndarray) -> np.ndarray:
        p = start.astype(float)
        p[active] = values
        return p

    def model(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, jacobian = _model(filled(values), t, rounded)
        return value, jacobian[:, active]

    def project(trial: np.ndarray, before: np.ndarray) -> np.ndarray:
        del before
        p = filled(trial)
        p[_LOG_T] = np.clip(p[_LOG_T], THRESHOLDS.least_log_rounding, THRESHOLDS.most_log_rounding)
        return p[active]

    found = levenberg_marquardt(
        model,
        y,
        start[active],
        steps=steps,
        tolerance=THRESHOLDS.final_tolerance if final else THRESHOLDS.coarse_tolerance,
        project=project,
    )
    p, error, cost = filled(found.parameters), found.residual, found.cost
    when = _vertex(p, rounded)
    stderr = _vertex_stderr(p, found.jacobian, error, active, when, rounded) if final else np.inf
    return TurnFit(p, rounded, centre, unit, centre + when * unit, stderr * unit, cost, int(t.size))


def start_cost(t: np.ndarray, y: np.ndarray, start: np.ndarray, rounded: bool = False) -> float:
    """Sum of squared residuals of a turn as it stands."""
    phase = branches(start, t, rounded)[0]
    return float(np.sum((y - start[_A] * np.cos(phase) - start[_B]) ** 2))


def _vertex_stderr(p, j, error, active, when, rounded) -> float:
    bread = np.linalg.pinv(j.T @ j, rcond=1e-12, hermitian=True)
    leverage = np.clip(np.einsum("ij,jk,ik->i", j, bread, j), 0.0, 0.9)
    scores = j * (error / (1 - leverage))[:, None]
    covariance = bread @ (scores.T @ scores) @ bread
    gradient = np.zeros(active.size)
    for i, index in enumerate(active):
        width = 1e-5 * max(1.0, abs(p[index]))
        shifted = p.copy()
        shifted[index] += width
        gradient[i] = (_vertex(shifted, rounded) - when) / width
    return float(np.sqrt(max(gradient @ covariance @ gradient, 0.0)))
