"""Standard errors when residuals are correlated: a sandwich with the spectrum of the noise.

Least squares stays unbiased under correlated noise, but its plain covariance is too small. Here it
is `G^-1 B G^-1` with `G = J'WJ` and `B = J'W C W J`, `C` the autocovariance of the noise as
`fitting.noise` finds it in the residuals, with what the fit took out of them put back.

Where periods repeat, lines between the harmonics of the scan hold noise alone. If what is left at
the harmonics is more than that, the model misses something that repeats: the residual at the
harmonics then counts as noise, in standard errors, too.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.problem._problem import Problem, Solution
from fitting.identification.robust._reweighting import Reweighting
from fitting.noise import NoiseModel, Pick, PowerBins, estimate_noise, excess_probability
from fitting.solver._identifiability import pseudo_gram
from rapi_jax.internal import are_whole_samples

from ._toeplitz_product import ToeplitzProduct


@dataclasses.dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance of the fitted vector, and the correlation of the residuals.

    `rho` is each run's residual correlation from one sample to the next; `effective` the number of
    independent samples that carry as much information as all residuals; `noise` what the residuals
    were taken for.
    """

    covariance: np.ndarray
    rho: tuple[float, ...]
    effective: float
    noise: NoiseModel

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
    part = correlated_covariance(
        [error[at] for at in rows],
        [shaped[at][:, free] / root[at][:, None] for at in rows],
        list(run_weights),
        [drive.step_s for drive in problem.recording.drives],
        [whole_periods(problem, row) for row, _ in rows],
    )
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
    return Uncertainty(covariance, part.rho, part.effective, part.noise)


def correlated_covariance(
    residuals: Sequence[Float[np.ndarray, " _"]],
    jacobians: Sequence[Float[np.ndarray, "_ parameters"]],
    weights: Sequence[float],
    steps_s: Sequence[float] | None = None,
    periods: Sequence[int] | None = None,
) -> Uncertainty:
    """Covariance of a weighted fit from each run's residual, Jacobian and weight (all unweighted).

    `steps_s`: the sampling intervals, by default 1. `periods`: how many whole ones each run holds,
    by default one: then nothing shows what repeats.
    """
    steps = [1.0] * len(residuals) if steps_s is None else list(steps_s)
    whole = [1] * len(residuals) if periods is None else list(periods)
    rows = zip(jacobians, weights, strict=True)
    gram, undetermined = pseudo_gram(np.concatenate([np.sqrt(w) * j for j, w in rows]))
    root = _square_root(gram)
    columns = [j @ root for j in jacobians]
    noise = _noise_of_errors(residuals, columns, weights, steps, whole)
    middle = np.zeros((root.shape[1], root.shape[1]))
    rho, effective = [], 0.0
    for row, (r, c, w) in enumerate(zip(residuals, columns, weights, strict=True)):
        product = ToeplitzProduct.of(c)
        gamma = noise.autocovariance(row, r.size)
        middle += w**2 * product.middle(gamma)
        rho.append(float(gamma[1] / gamma[0]) if r.size > 1 and gamma[0] > 0 else 0.0)
        total = gamma[0] + 2.0 * gamma[1:].sum()
        effective += r.size * min(1.0, gamma[0] / total) if total > 0 else r.size
    covariance = root @ middle @ root.T
    covariance[undetermined, undetermined] = np.inf
    most = float(sum(r.size for r in residuals))
    return Uncertainty(covariance, tuple(rho), min(effective, most), noise)


def _square_root(gram: Float[np.ndarray, "parameters parameters"]) -> np.ndarray:
    """`root @ root.T` is `gram`, which is symmetric and may have no full rank."""
    size = np.sqrt(np.maximum(np.diag(gram), 0.0))
    unit = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(gram / np.outer(unit, unit))
    return unit[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))


def _noise_of_errors(
    residuals: Sequence[np.ndarray],
    columns: Sequence[np.ndarray],
    weights: Sequence[float],
    steps: Sequence[float],
    periods: Sequence[int],
) -> NoiseModel:
    """The noise that errors are due to: of all lines, or where a misfit repeats, of harmonics."""

    def lines(pick: Pick) -> list[PowerBins]:
        sizes = zip(residuals, steps, periods, strict=True)
        return [PowerBins.of(r.size, step, count, pick) for r, step, count in sizes]

    if max(periods) > 1:
        between, harmonics = lines("between"), lines("harmonics")
        noise = estimate_noise(residuals, columns, weights, between)
        excess = excess_probability(noise, residuals, columns, weights, harmonics, between)
        if excess < THRESHOLDS.misfit_level:
            return estimate_noise(residuals, columns, weights, harmonics)
    return estimate_noise(residuals, columns, weights, lines("all"))


def whole_periods(problem: Problem, row: int) -> int:
    """How many whole periods the fitted samples of a run are; 1 where they are not whole ones."""
    drive = problem.recording.runs[row].drive
    index = np.flatnonzero(problem.data.use[row])
    if not drive.repeats or not index.size or index[-1] - index[0] + 1 != index.size:
        return 1
    exact = 1.0 / (drive.rate * drive.step_s)  # samples a period
    whole = round(index.size / exact)
    return whole if whole > 1 and are_whole_samples(whole, exact, index.size) else 1
