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
from fitting.identification.robust._reweighting import Reweighting
from fitting.solver._identifiability import pseudo_gram

from ._autoregression import autocovariance, fit_autoregression, model_autocovariance
from ._lagged_products import LaggedProducts


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
    problem: Problem,
    solution: Solution,
    run_weights: np.ndarray,
    reweighting: Reweighting | None = None,
) -> Uncertainty:
    """Covariance of the problem's vector, its constant and run offsets shared as in the values.

    With `reweighting` that of an M-estimate: residuals are what the loss makes of them, over the
    mean slope by which it answers the model (Huber and Ronchetti, chapter 7).
    """
    use = problem.data.use
    shaped = solution.jacobian.reshape(*use.shape, -1)
    free = np.linalg.norm(solution.jacobian, axis=0) > 0
    root, error = np.sqrt(run_weights)[:, None] * np.ones(use.shape), solution.error
    if reweighting is not None:
        root = root * np.sqrt(reweighting.share)
        error = error * reweighting.share / reweighting.slope[:, None]
        run_weights = run_weights * reweighting.slope
    rows = [(row, use[row]) for row in range(use.shape[0])]
    jacobians = [shaped[at][:, free] / root[at][:, None] for at in rows]
    part = correlated_covariance([error[at] for at in rows], jacobians, list(run_weights))
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
    runs = [LaggedProducts.of(j, k) for j, k in zip(jacobians, lags, strict=True)]
    lost = [run.power(gram) for run in runs]
    models, middle = [], np.zeros_like(gram)
    for step in range(THRESHOLDS.noise_passes):
        fitted = [
            fit_autoregression(gamma, r.size) for gamma, r in zip(target, residuals, strict=True)
        ]
        models = [
            model_autocovariance(*one, run.length) for one, run in zip(fitted, runs, strict=True)
        ]
        density = [run.density(model) for run, model in zip(runs, models, strict=True)]
        parts = zip(runs, density, weights, strict=True)
        middle = sum((w**2 * run.middle(s) for run, s, w in parts), np.zeros_like(gram))
        if step == THRESHOLDS.noise_passes - 1:
            break
        spread = gram @ middle @ gram
        for i, run in enumerate(runs):
            both = run.correlated_traces(gram, lost[i], models[i], density[i])
            kept = run.traces(run.power(spread))
            pairs = residuals[i].size - np.arange(lags[i] + 1)
            target[i] = raw[i] + (weights[i] * both - kept) / pairs
    rho, effective = [], 0.0
    for model, r in zip(models, residuals, strict=True):
        rho.append(float(model[1] / model[0]) if model[0] > 0 else 0.0)
        total = model[0] + 2.0 * model[1 : r.size].sum()
        effective += r.size * min(1.0, model[0] / total) if total > 0 else r.size
    covariance = gram @ middle @ gram
    covariance[undetermined, undetermined] = np.inf
    return Uncertainty(
        covariance, tuple(rho), min(effective, float(sum(r.size for r in residuals)))
    )
