"""Standard errors when residuals are correlated: a sandwich with an autoregressive noise model.

Least squares stays unbiased under correlated noise, but its plain covariance is too small by about
(1 + rho) / (1 - rho). Here each run's residual gets an AR(p) model, and the covariance is
`G^-1 B G^-1` with `G = J'WJ` and `B = J'W C W J`, `C` the model's autocovariance. Residuals of a
fit are less correlated than the noise was, since the fit took out what looks like its columns; the
expected loss is computed and put back (as in restricted maximum likelihood).
"""

import dataclasses

import numpy as np

from fitting.identification._problem import Problem, Solution
from fitting.identification._thresholds import THRESHOLDS
from fitting.solver._identifiability import pseudo_gram


@dataclasses.dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance of the fitted vector, and the correlation of the residuals.

    `rho` is each run's residual correlation from one sample to the next; `effective` the number of
    independent samples that carry as much information as all residuals.
    """

    covariance: np.ndarray
    rho: tuple[float, ...]
    effective: float

    @property
    def stderr(self) -> np.ndarray:
        """Standard errors; infinite where the data do not fix a parameter."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation matrix; zero where a standard error is zero or infinite."""
        s = self.stderr
        good = np.isfinite(s) & (s > 0)
        out = np.eye(s.size)
        pick = np.ix_(good, good)
        out[pick] = self.covariance[pick] / np.outer(s[good], s[good])
        return out

    @property
    def fitted(self) -> np.ndarray:
        """Places in the vector of the elements that were fitted."""
        return np.flatnonzero(self.stderr > 0)

    @property
    def fitted_correlation(self) -> np.ndarray:
        """Correlation matrix of the elements that were fitted."""
        return self.correlation[np.ix_(self.fitted, self.fitted)]


def estimate_uncertainty(
    problem: Problem, solution: Solution, run_weights: np.ndarray
) -> Uncertainty:
    """Covariance of the problem's vector, its constant and run offsets shared as in the values."""
    use = problem.data.use
    shaped = solution.jacobian.reshape(*use.shape, -1)
    free = np.linalg.norm(solution.jacobian, axis=0) > 0
    root = np.sqrt(run_weights)
    jacobians = [shaped[row, use[row]][:, free] / root[row] for row in range(use.shape[0])]
    residuals = [solution.error[row, use[row]] for row in range(use.shape[0])]
    part = correlated_covariance(residuals, jacobians, list(run_weights))
    size = solution.values.size
    covariance = np.zeros((size, size))
    covariance[np.ix_(free, free)] = part.covariance
    if problem.own_origin:
        n, k = problem.vector.size, problem.offsets
        share = np.eye(size)
        share[n : n + k, n : n + k] -= 1.0 / k
        share[problem.vector.names.index(problem.constant), n : n + k] = 1.0 / k
        undetermined = ~np.isfinite(np.diag(covariance))
        known = np.where(np.isfinite(covariance), covariance, 0.0)
        covariance = share @ known @ share.T
        covariance[undetermined, undetermined] = np.inf
    return Uncertainty(covariance, part.rho, part.effective)


def autocovariance(series: np.ndarray, lags: int) -> np.ndarray:
    """Sums of lagged products over the number of pairs, for lags 0 to `lags`."""
    n = series.size
    power = np.abs(np.fft.rfft(series, 2 * n)) ** 2
    return np.fft.irfft(power, 2 * n)[: lags + 1] / (n - np.arange(lags + 1))


def _fit_autoregression(gamma: np.ndarray, n: int) -> tuple[np.ndarray, float]:
    """Coefficients and innovation variance by Yule-Walker, the order by BIC; always stationary."""
    if gamma[0] <= 0:
        return np.zeros(0), 0.0
    best = (n * np.log(gamma[0]), np.zeros(0), gamma[0])
    for order in range(1, min(gamma.size - 1, THRESHOLDS.noise_order) + 1):
        if order == 1:  # a residual that hardly changes in one sample: as slow as the run can show
            phi = np.clip(gamma[1:2] / gamma[0], -1.0 + 2.0 / n, 1.0 - 2.0 / n)
            variance = float(gamma[0] * (1.0 - phi[0] ** 2))
        else:
            try:
                phi = np.linalg.solve(gamma[_lag(order)], gamma[1 : order + 1])
            except np.linalg.LinAlgError:
                continue
            variance = float(gamma[0] - phi @ gamma[1 : order + 1])
            stationary = (np.abs(np.roots(np.r_[1.0, -phi])) < 1.0 - 1.0 / n).all()
            if not (stationary and variance > THRESHOLDS.innovation * gamma[0]):
                continue
        score = n * np.log(variance) + order * np.log(n)
        if score < best[0]:
            best = (score, phi, variance)
    return best[1], best[2]


def _lag(order: int) -> np.ndarray:
    """Between each two of `order` samples."""
    return np.abs(np.subtract.outer(np.arange(order), np.arange(order)))


def _correlate(autocovariance: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """The covariance matrix (Toeplitz) of a stationary process times `columns`."""
    n = columns.shape[0]
    size = 1 << (2 * n - 1).bit_length()  # a circulant that holds it
    circulant = np.zeros(size)
    circulant[:n] = autocovariance
    circulant[size - n + 1 :] = autocovariance[:0:-1]
    product = np.fft.rfft(circulant)[:, None] * np.fft.rfft(columns, size, axis=0)
    return np.fft.irfft(product, size, axis=0)[:n]


def _model_autocovariance(phi: np.ndarray, variance: float, n: int) -> np.ndarray:
    """Autocovariance of an AR process at lags 0 to n-1, from its spectrum."""
    spectrum = 1.0 / np.abs(np.fft.rfft(np.r_[1.0, -phi], 8 * n)) ** 2
    return variance * np.fft.irfft(spectrum, 8 * n)[:n]


def _lagged_traces(left: np.ndarray, right: np.ndarray, lags: int) -> np.ndarray:
    """Sum over t and columns of `left[t] right[t + k]`, for lags k."""
    n, width = left.shape
    one, other = (np.ascontiguousarray(x).ravel() for x in (left, right))
    return np.array([one[: (n - k) * width] @ other[k * width :] for k in range(lags + 1)])


def correlated_covariance(
    residuals: list[np.ndarray], jacobians: list[np.ndarray], weights: list[float]
) -> Uncertainty:
    """Covariance of a weighted fit from each run's residual, Jacobian and weight (all unweighted).

    Lists hold one entry a run: residuals of shape `time`, Jacobians of shape `time parameters`.
    """
    rows = zip(jacobians, weights, strict=True)
    gram, undetermined = pseudo_gram(np.concatenate([np.sqrt(w) * j for j, w in rows]))
    lags = [
        max(1, min(THRESHOLDS.noise_order, r.size // THRESHOLDS.samples_per_lag)) for r in residuals
    ]
    raw = [autocovariance(r, k) for r, k in zip(residuals, lags, strict=True)]
    target = list(raw)
    middle = np.zeros_like(gram)
    rho, effective = [], 0.0
    for step in range(THRESHOLDS.noise_passes):
        products, models, middle = [], [], np.zeros_like(gram)
        for gamma, j, w in zip(target, jacobians, weights, strict=True):
            model = _model_autocovariance(*_fit_autoregression(gamma, j.shape[0]), j.shape[0])
            product = w * _correlate(model, j)
            middle += w * j.T @ product
            models.append(model)
            products.append(product)
        if step == THRESHOLDS.noise_passes - 1:
            break
        spread = gram @ middle @ gram
        for i, (j, product) in enumerate(zip(jacobians, products, strict=True)):
            lost = j @ gram
            both = _lagged_traces(lost, product, lags[i]) + _lagged_traces(product, lost, lags[i])
            kept = _lagged_traces(j @ spread, j, lags[i])
            target[i] = raw[i] + (both - kept) / (j.shape[0] - np.arange(lags[i] + 1))
    for model in models:
        rho.append(float(model[1] / model[0]) if model[0] > 0 else 0.0)
        total = model[0] + 2.0 * model[1:].sum()
        effective += model.size * min(1.0, model[0] / total) if total > 0 else model.size
    covariance = gram @ middle @ gram
    covariance[undetermined, undetermined] = np.inf
    return Uncertainty(
        covariance, tuple(rho), min(effective, float(sum(r.size for r in residuals)))
    )
