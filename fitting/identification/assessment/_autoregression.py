"""Autoregressive models of a stationary series, from its autocovariance."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from fitting.identification._thresholds import THRESHOLDS


def autocovariance(series: Float[np.ndarray, " time"], lags: int) -> Float[np.ndarray, " lags"]:
    """Sums of lagged products over the number of pairs, for lags 0 to `lags`."""
    n = series.size
    sums = np.array([series[: n - k] @ series[k:] for k in range(lags + 1)])
    return sums / (n - np.arange(lags + 1))


def fit_autoregression(
    gamma: Float[np.ndarray, " lags"], n: int
) -> tuple[Float[np.ndarray, " order"], float]:
    """Coefficients and innovation variance by Yule-Walker, the order by BIC; always stationary.

    `gamma`: autocovariance from lag 0 on, of a series of `n` samples.
    """
    if gamma[0] <= 0:
        return np.zeros(0), 0.0
    best = n * np.log(gamma[0]), np.zeros(0), float(gamma[0])
    for phi, variance in _each_order(gamma, n):
        if not variance > THRESHOLDS.innovation * gamma[0]:
            continue
        score = n * np.log(variance) + phi.size * np.log(n)
        if score < best[0] and (phi.size == 1 or _is_stationary(phi, n)):
            best = score, phi, float(variance)
    return best[1], best[2]


def _each_order(
    gamma: Float[np.ndarray, " lags"], n: int
) -> Iterator[tuple[Float[np.ndarray, " order"], float]]:
    """The models of order 1, 2, ... by the recursion of Levinson and Durbin."""
    phi, variance = np.zeros(0), float(gamma[0])
    for order in range(1, min(gamma.size - 1, THRESHOLDS.noise_order) + 1):
        reflection = (gamma[order] - phi @ gamma[order - 1 : 0 : -1]) / variance
        phi = np.append(phi - reflection * phi[::-1], reflection)
        variance *= 1.0 - reflection**2
        if order == 1:  # a residual that hardly changes in one sample: as slow as the run can show
            near = np.clip(phi, -1.0 + 2.0 / n, 1.0 - 2.0 / n)
            yield near, float(gamma[0] * (1.0 - near[0] ** 2))
        else:
            yield phi, variance
        if not abs(reflection) < 1.0:
            return  # no model of a higher order is stationary


def _is_stationary(phi: Float[np.ndarray, " order"], n: int) -> bool:
    """Whether a disturbance fades within a run."""
    return bool((np.abs(np.roots(np.append(1.0, -phi))) < 1.0 - 1.0 / n).all())


def model_autocovariance(
    phi: Float[np.ndarray, " order"], variance: float, n: int
) -> Float[np.ndarray, " lags"]:
    """Autocovariance of an autoregressive process at lags 0 to n-1."""
    order = phi.size
    if order == 0:
        return np.append(variance, np.zeros(n - 1))
    # Yule-Walker: gamma_k - sum_j phi_j gamma_|k-j| is the innovation variance at lag 0, else 0.
    equations, k = np.eye(order + 1), np.arange(order + 1)
    for j, coefficient in enumerate(phi, start=1):
        np.add.at(equations, (k, np.abs(k - j)), -coefficient)
    first = np.linalg.solve(equations, np.append(variance, np.zeros(order)))
    # Each later lag follows from the `order` before it; twice as many lags in each pass.
    step = np.eye(order, k=1)
    step[-1] = phi[::-1]
    ahead = step[-1:]
    while ahead.shape[0] < order:
        ahead = np.concatenate([ahead, ahead[-1:] @ step])
    while ahead.shape[0] < n - order - 1:
        ahead = np.concatenate([ahead, ahead @ ahead[-order:]])
    return np.concatenate([first, ahead @ first[1:]])[:n]
