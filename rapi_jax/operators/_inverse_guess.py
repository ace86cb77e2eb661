"""Initial guess of the inverse from a forward model: Eq. 17 extended to asymmetric plays."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from ._base import AbstractOperator
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class Contacts:
    """Where the plays of a forward operator are taken along, at one rate, one number per play.

    `up` and `down`: the responses from which a play moves on the rising and on the falling branch.
    `moves`: whether it does so on both. `low`, `high`: the responses' ends. `slope`: the mean
    slope of the loop once the play has joined in.
    """

    up: np.ndarray
    down: np.ndarray
    moves: np.ndarray
    low: float
    high: float
    slope: np.ndarray
    slope_0: float

    @property
    def lam(self) -> np.ndarray:
        """Slope of an inverse play's falling bound that moves it at the same two responses.

        Started as Eq. 13 has it, an inverse play goes up from `lam low + (1 + eta) z` and down from
        `lam v + (1 + eta) z = high`, whatever its origin; equated with `up` and `down`. It is 1,
        and `z` follows Eq. 17, where the forward plays have `lam` and `eta` 1.
        """
        return (self.high - self.up) / np.where(self.moves, self.down - self.low, 1.0)

    def z(self, lam: np.ndarray, v_0: float) -> np.ndarray:
        """Thresholds with `eta` 1; between the two that suit each branch where `lam` is given."""
        rising = self.up - v_0 - lam * (self.low - v_0)
        falling = self.high - v_0 - lam * (self.down - v_0)
        return (rising + falling) / 4.0

    @property
    def q(self) -> np.ndarray:
        """Weights of the inverse plays."""
        slopes = np.concatenate([[self.slope_0], self.slope])
        return np.diff(1.0 / slopes)  # Eq. (17)


def find_contacts(
    forward: AbstractOperator, freq: float, u_min: float, u_max: float, plays: int
) -> Contacts:
    """The contacts of `forward` between two drives, for `plays` plays spread over the same ranks.

    Call with 64-bit types on.
    """
    own = forward.plays(jnp.asarray(u_max - u_min), jnp.asarray(freq))
    r, lam, eta, p = (_resized(np.asarray(v), plays) for v in (own.r, own.lam, own.eta, own.p))
    p = p * (forward.count / plays)
    origin = float(forward.centred(jnp.zeros(())))
    levels = THRESHOLDS.inverse_levels
    rising = np.linspace(u_min, u_max, levels)
    loop = np.concatenate([rising, rising[-2::-1]])
    y = np.asarray(forward(jnp.asarray(loop), jnp.asarray(freq)))
    low, high = u_min + origin, u_max + origin
    start = np.maximum(low - r, lam * low + eta * r)  # Eq. (13)
    up = start + r
    down = (np.maximum(high - r, start) - eta * r) / lam
    linear = float(np.ptp(np.asarray(forward.memoryless(jnp.asarray(rising)))) / (u_max - u_min))
    return Contacts(
        np.interp(up - origin, rising, y[:levels]),
        np.interp(down - origin, rising, y[levels - 1 :][::-1]),
        (up < high) & (down > low),
        float(y.min()),
        float(y.max()),
        linear + np.cumsum(p * (1.0 + lam) / 2.0),
        linear,
    )


def _resized(values: np.ndarray, plays: int) -> np.ndarray:
    """`values`, one for each of equally spaced ranks, at `plays` ranks; a line below the first."""
    count = values.size
    rank, wanted = np.arange(1, count + 1) / count, np.arange(1, plays + 1) / plays
    if count > 1:
        rank = np.concatenate([[0.0], rank])
        values = np.concatenate([[2.0 * values[0] - values[1]], values])
    return np.interp(wanted, rank, values)


def fit_threshold_law(
    z: np.ndarray, freq: np.ndarray, moves: np.ndarray
) -> tuple[np.ndarray, float]:
    """`s_1`, `s_2`, `s_3` and `kappa` of Eq. 19 for thresholds "rates plays"; all stay positive."""
    rates, plays = z.shape
    i = np.tile(np.arange(1.0, plays + 1.0), rates)
    f = np.repeat(freq, plays)
    use = moves.ravel() if moves.sum() > 3 else np.ones(i.size, dtype=bool)
    powers = min(plays, 3)
    columns = [i**2, i, np.ones_like(i)][3 - powers :]
    grows = np.ptp(freq) > 0
    matrix = np.stack([*columns, *([f] if grows else [])], axis=1)[use]
    solved = np.linalg.lstsq(matrix, z.ravel()[use], rcond=None)[0]
    s = np.concatenate([np.zeros(3 - powers), solved[:powers]])
    kappa = max(float(solved[-1]), 0.0) if grows else 0.0
    fitted = s[0] * i**2 + s[1] * i + s[2] + kappa * f
    wide = max(float(np.median(np.abs(z))), 1e-300)
    s[2] += max(THRESHOLDS.inverse_narrowest * wide - float(fitted.min()), 0.0)
    return s, kappa


def fit_weight_law(q: np.ndarray) -> tuple[float, float]:
    """`sigma` and `epsilon` of Eq. 18: the power law nearest to the logarithms of the weights."""
    size = np.maximum(np.abs(q), 1e-12 * max(float(np.abs(q).max()), 1e-300))
    rank = np.log(np.arange(1.0, q.size + 1.0))
    epsilon = float(np.polyfit(rank, np.log(size), 1)[0]) if q.size > 1 else 0.0
    limit = THRESHOLDS.inverse_exponent
    epsilon = float(np.clip(epsilon, -limit, limit))
    sign = -1.0 if q.sum() < 0 else 1.0
    return sign * float(np.exp(np.mean(np.log(size) - epsilon * rank))), epsilon
