"""Which variance model the estimates are best described by, by evidence."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from fitting.population._thresholds import THRESHOLDS
from fitting.population.estimates._estimates import Estimates

from ._mixed_model import MixedModel
from ._restricted_likelihood import (
    RestrictedLikelihood,
    Variances,
    maximise,
    root_basis,
    scatter_root,
)
from ._smooth_drift import SmoothDrift

STRUCTURES = ("diagonal", "factor", "full")


@dataclasses.dataclass(frozen=True, eq=False)
class Selected:
    """The variance model, and the log evidence of each that was tried, less that of the best.

    `curves`: of the smooth drifts of `variances.smooth`; `None` where there are none.
    """

    variances: Variances
    likelihood: RestrictedLikelihood
    rows: np.ndarray
    curves: SmoothDrift | None
    evidence: dict[str, float]

    def model(self, estimates: Estimates, known: np.ndarray) -> MixedModel:
        """The mixed model at these variances, of the estimates that are `known`."""
        rows = self.rows
        curves = None if self.curves is None else self.curves.values
        design = np.stack(
            [self.design(row, None if curves is None else curves[i]) for i, row in enumerate(rows)]
        )
        fixed = rows.shape[1] * estimates.size
        return MixedModel(
            estimates.values, estimates.covariances, known, design,
            np.r_[np.zeros(fixed), np.ones(design.shape[2] - fixed)],
            self.variances.between, self.variances.tangent(),
        )  # fmt: skip

    def design(self, row: np.ndarray, functions: np.ndarray | None) -> np.ndarray:
        """Coefficients to expectation, from a row of covariates and the eigenfunctions."""
        size = len(self.variances.between)
        parts = [np.einsum("e,ab->aeb", row, np.eye(size)).reshape(size, -1)]
        if functions is not None:
            pick = np.eye(size)[:, list(self.variances.smooth)] * self.variances.amplitudes
            parts.append(np.einsum("q,as->asq", functions, pick).reshape(size, -1))
        return np.concatenate(parts, axis=1)

    def refit(self, known: np.ndarray) -> "Selected":
        """The same variance model, of the estimates that are `known`."""
        one = self.variances
        flags = jnp.asarray(_padded(known.astype(np.float64)))
        likelihood = dataclasses.replace(self.likelihood, known=flags)
        variances = maximise(likelihood, one.structure, one.smooth, one.point)
        return dataclasses.replace(self, variances=variances, likelihood=likelihood)


def select(
    estimates: Estimates,
    rows: np.ndarray,
    known: np.ndarray,
    *,
    times: np.ndarray | None,
    drift: str,
    structure: str,
) -> Selected:
    """The variance model with the most evidence, of the estimates that are `known`.

    `times`: standardised, or `None` where time is no covariate. `drift`: "line", "smooth" (all
    parameters) or "auto" (those for which it has more evidence). `structure`: one of `STRUCTURES`,
    or "auto".
    """
    units = int(known.any(axis=1).sum()) - rows.shape[1]
    wanted = STRUCTURES if structure == "auto" else (structure,)
    if structure == "auto" and estimates.size == 1:
        wanted = ("diagonal",)
    if structure == "auto" and units < THRESHOLDS.full_degrees * estimates.size:
        wanted = ("diagonal", "factor")
    tried: dict[str, tuple[float, Selected]] = {}

    def attempt(smooth: tuple[int, ...], curves: SmoothDrift | None, prior: float) -> None:
        for one in wanted:
            name = f"{'smooth' if smooth else 'line'}, {one}"
            likelihood = _likelihood(estimates, rows, known, one, smooth, curves)
            found = maximise(likelihood, one, smooth)
            chosen = Selected(found, likelihood, rows, curves, {})
            tried[name] = found.evidence(units) + prior, chosen

    smooth, curves, prior = (), None, 0.0
    if drift != "line" and times is not None:
        if units >= THRESHOLDS.smooth_units:
            smooth, curves, prior = _smooth(estimates, rows, known, times, drift == "smooth", units)
    if not (drift == "smooth" and smooth):
        attempt((), None, 0.0)
    if smooth:
        attempt(smooth, curves, prior)
    best = max(tried, key=lambda name: tried[name][0])
    evidence = {name: value - tried[best][0] for name, (value, _) in tried.items()}
    return dataclasses.replace(tried[best][1], evidence=evidence)


def _likelihood(
    estimates: Estimates,
    rows: np.ndarray,
    known: np.ndarray,
    structure: str,
    smooth: tuple[int, ...] = (),
    curves: SmoothDrift | None = None,
) -> RestrictedLikelihood:
    root = scatter_root(estimates.values, estimates.covariances, known, rows)
    functions = np.zeros((len(rows), 0))
    if curves is not None:
        functions = np.zeros((len(rows), THRESHOLDS.smooth_rank))
        functions[:, : curves.values.shape[1]] = curves.values
    pick = np.eye(estimates.size)[:, list(smooth)]
    arrays = (estimates.values, estimates.covariances, known.astype(np.float64), rows, functions)
    basis = root_basis(structure, root)
    padded = [_padded(array) for array in arrays]
    return RestrictedLikelihood(*(jnp.asarray(a) for a in (*padded, pick, basis)))


def _padded(array: np.ndarray) -> np.ndarray:
    """As if of recordings that say nothing, up to a power of two: one program serves many sizes."""
    count = len(array)
    whole = max(THRESHOLDS.padded_recordings, 2 ** int(np.ceil(np.log2(count))))
    return np.concatenate([array, np.zeros((whole - count, *array.shape[1:]))])


def _smooth(
    estimates: Estimates,
    rows: np.ndarray,
    known: np.ndarray,
    times: np.ndarray,
    every: bool,
    units: int,
) -> tuple[tuple[int, ...], SmoothDrift | None, float]:
    """Parameters that drift smoothly, the curves, and the log prior odds of just these.

    Each parameter by itself is tried with a line and with a smooth drift of each length, all
    lengths being equally likely; it is one of those where the evidence is more than the number of
    parameters, as if one was expected.
    """
    spans = [share * float(np.ptp(times)) for share in THRESHOLDS.smooth_lengths]
    kinds = [SmoothDrift.of(times, span) for span in spans]
    line = dataclasses.replace(kinds[0], values=np.zeros_like(kinds[0].values))
    gains = np.zeros((estimates.size, len(kinds)))
    for j in range(estimates.size):
        one = estimates.only(j)
        tried = [
            maximise(
                _likelihood(one, rows, known[:, [j]], "diagonal", (0,), curves), "diagonal", (0,)
            ).loglik
            for curves in (line, *kinds)
        ]
        gains[j] = np.array(tried[1:]) - tried[0] - 0.5 * np.log(units)
    odds = np.logaddexp.reduce(gains, axis=1) - np.log(len(kinds))
    least = float(np.log(estimates.size))
    at = np.arange(estimates.size) if every else np.flatnonzero(odds > least)
    if not at.size:
        return (), None, 0.0
    best = int(np.argmax(gains[at].sum(axis=0)))
    prior = -np.log(len(kinds)) - least * at.size
    return tuple(at.tolist()), kinds[best], float(prior)
