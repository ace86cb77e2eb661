r"""Variance between recordings by restricted maximum likelihood (REML).

Recording $i$ has $\hat\theta_i \sim N(A_i\gamma, V_i)$ with $V_i = T + C_i$: $C_i$ of its own fit,
$T$ unknown. $A_i$ holds the fixed effects (mean, line in time, temperature) and, of a smooth drift,
eigenfunctions times their amplitude, whose coefficients are standard normal a priori. Integrating
$\gamma$ out, with a flat prior on fixed effects, gives the restricted likelihood (Patterson and
Thompson 1971; for several outcomes Jackson, Riley and White 2011, Stat. Med. 30, 2481):

$$-2\ell = \sum_i \log|V_i| + \log|S| + \sum_i y_i'V_i^{-1}y_i - b'S^{-1}b,$$

with $S = \sum_i A_i'V_i^{-1}A_i + \Lambda$ and $b = \sum_i A_i'V_i^{-1}y_i$.
"""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from fitting.population._thresholds import THRESHOLDS


class RestrictedLikelihood(eqx.Module):
    """Minus the restricted log-likelihood as a function of the parameters of the variances.

    These are those of a root of `T`, in which it is linear by `basis`, so that `T` may be singular
    without a bound; then an amplitude for each column of `smooth`, which says of which parameter.
    All structures have one shape, so that one program serves them: what a structure lacks is 0 in
    `basis`.
    """

    values: Float[Array, "recordings parameters"]
    covariances: Float[Array, "recordings parameters parameters"]
    known: Float[Array, "recordings parameters"]
    rows: Float[Array, "recordings effects"]
    functions: Float[Array, "recordings functions"]
    smooth: Float[Array, "parameters drifts"]
    basis: Float[Array, "parameters roots variances"]

    def root(self, point: Float[Array, " point"]) -> Float[Array, "parameters roots"]:
        """A root of `T`."""
        return jnp.einsum("abn,n->ab", self.basis, point[: self.basis.shape[2]])

    def __call__(self, point: Float[Array, " point"]) -> Float[Array, ""]:
        root, amplitudes = self.root(point), point[self.basis.shape[2] :]
        size, effects = self.basis.shape[0], self.rows.shape[1]
        known = self.known
        pair = known[:, :, None] * known[:, None, :]
        total = pair * ((root @ root.T)[None] + self.covariances)
        total = total + (1.0 - known)[:, :, None] * jnp.eye(size)[None]
        factor = jnp.linalg.cholesky(total)
        design = jnp.einsum("me,ab->maeb", self.rows, jnp.eye(size))
        design = design.reshape(*self.values.shape, effects * size)
        curves = jnp.einsum("mq,as->masq", self.functions, self.smooth * amplitudes[None, :])
        curves = curves.reshape(*self.values.shape, -1)
        columns = jnp.concatenate([design, curves, self.values[:, :, None]], axis=2)
        solved = jax.lax.linalg.triangular_solve(
            factor, columns * known[:, :, None], left_side=True, lower=True
        )
        gram = jnp.einsum("mab,mac->bc", solved, solved)
        prior = jnp.r_[jnp.zeros(effects * size), jnp.ones(curves.shape[2])]
        inner = jnp.linalg.cholesky(gram[:-1, :-1] + jnp.diag(prior))
        left = jax.scipy.linalg.solve_triangular(inner, gram[:-1, -1], lower=True)
        logdet = jnp.sum(jnp.log(jnp.diagonal(factor, axis1=1, axis2=2)))
        logdet = logdet + jnp.sum(jnp.log(jnp.diag(inner)))
        return logdet + 0.5 * (gram[-1, -1] - jnp.sum(left**2))


def root_basis(structure: str, root: np.ndarray) -> np.ndarray:
    """Roots of `T` of one structure, in its parameters, all of the size of about 1.

    "full": `root` times a triangle. "diagonal". "factor": a diagonal and, in a further column, what
    a single common cause adds.
    """
    size = len(root)
    scale = np.sqrt(np.sum(root**2, axis=1))
    out = np.zeros((size, size + 1, max(size * (size + 1) // 2, 2 * size)))
    each = np.arange(size)
    if structure == "full":
        for n, (a, b) in enumerate(zip(*np.tril_indices(size), strict=True)):
            out[:, b, n] = root[:, a]
        return out
    out[each, each, each] = scale
    if structure == "factor":
        out[each, size, size + each] = scale
    return out


def count_free(structure: str, size: int) -> int:
    """How many parameters the covariance of a structure has."""
    return {"diagonal": size, "factor": 2 * size, "full": size * (size + 1) // 2}[structure]


@dataclasses.dataclass(frozen=True, eq=False)
class Variances:
    """Variances at the maximum of the restricted likelihood.

    `between`: `T`, in standardised coordinates, and its `root`. `amplitudes`: of the smooth drifts
    of the parameters `smooth`. `loglik`: the restricted log-likelihood, but for a constant of the
    data and the fixed effects.
    """

    root: np.ndarray
    amplitudes: np.ndarray
    smooth: tuple[int, ...]
    structure: str
    loglik: float
    point: np.ndarray
    converged: bool

    @property
    def between(self) -> Float[np.ndarray, "parameters parameters"]:
        """The covariance between recordings."""
        return self.root @ self.root.T

    def evidence(self, units: int) -> float:
        """Log evidence by Schwarz' approximation, of `units` recordings more than effects."""
        free = count_free(self.structure, len(self.root)) + len(self.smooth)
        return self.loglik - 0.5 * free * float(np.log(units))

    def tangent(self) -> Float[np.ndarray, "pairs variances"]:
        """Derivatives of all elements of `between` with respect to what was estimated of it.

        Of variances and covariances these are themselves, so that nothing is singular where one is
        0.
        """
        size = len(self.root)
        unit = np.eye(size)
        columns = [np.outer(e, e) for e in unit]
        if self.structure == "full":
            pairs = [(a, b) for a in range(size) for b in range(a)]
            columns += [np.outer(unit[a], unit[b]) + np.outer(unit[b], unit[a]) for a, b in pairs]
        if self.structure == "factor":
            cause = self.root[:, size]
            columns += [np.outer(e, cause) + np.outer(cause, e) for e in unit]
        return np.stack([column.ravel() for column in columns], axis=1)


def maximise(
    likelihood: RestrictedLikelihood,
    structure: str,
    smooth: tuple[int, ...],
    start: np.ndarray | None = None,
) -> Variances:
    """The variances at the maximum, from `start` or from the scatter of the estimates."""
    begin = _start(likelihood, structure) if start is None else start
    point, loss, slope = (np.asarray(part) for part in _descend(likelihood, jnp.asarray(begin)))
    count = likelihood.basis.shape[2]
    return Variances(
        np.asarray(likelihood.root(jnp.asarray(point))), np.abs(point[count:])[: len(smooth)],
        smooth, structure, -float(loss), point,
        bool(np.max(np.abs(slope)) < THRESHOLDS.likelihood_slope),
    )  # fmt: skip


@eqx.filter_jit
def _descend(likelihood: RestrictedLikelihood, start: Array) -> tuple[Array, Array, Array]:
    tolerance = THRESHOLDS.likelihood_tolerance
    found = optx.minimise(
        lambda point, one: one(point), optx.BFGS(tolerance, tolerance), start, args=likelihood,
        max_steps=THRESHOLDS.likelihood_steps, throw=False,
    )  # fmt: skip
    loss, slope = jax.value_and_grad(likelihood)(found.value)
    return found.value, loss, slope


def _start(likelihood: RestrictedLikelihood, structure: str) -> np.ndarray:
    """Half of the scatter between recordings, half of it smooth where that may be."""
    basis, share = np.asarray(likelihood.basis), np.sqrt(0.5)
    size = len(basis)
    point = np.zeros(basis.shape[2])
    if structure == "full":
        point[np.cumsum(np.arange(1, size + 1)) - 1] = share  # the diagonal
        full = np.einsum("abn,n->ab", basis, point)
        scale = np.sqrt(np.sum(full**2, axis=1))
    else:
        point[:size] = share
        scale = share * basis[np.arange(size), np.arange(size), np.arange(size)]
    if structure == "factor":
        point[size : 2 * size] = 0.5 * share
    return np.r_[point, scale @ np.asarray(likelihood.smooth)]


def scatter_root(
    values: np.ndarray, covariances: np.ndarray, known: np.ndarray, rows: np.ndarray
) -> np.ndarray:
    """A root of the scatter of the estimates beyond their own errors, never less than a tenth.

    Diagonal where a recording lacks an estimate; it only scales the search.
    """
    used = known.any(axis=1)
    values, covariances, known, rows = values[used], covariances[used], known[used], rows[used]
    left = np.zeros_like(values)
    for j, k in enumerate(known.T):
        left[k, j] = values[k, j] - rows[k] @ np.linalg.lstsq(rows[k], values[k, j], rcond=None)[0]
    degrees = np.maximum(known.sum(axis=0) - rows.shape[1], 1)
    seen = left.T @ left / np.sqrt(np.outer(degrees, degrees))
    noise = covariances.sum(axis=0) / np.sqrt(np.outer(known.sum(axis=0), known.sum(axis=0)))
    if not known.all():
        seen, noise = np.diag(np.diag(seen)), np.diag(np.diag(noise))
    variances, vectors = np.linalg.eigh(seen)
    white = vectors / np.sqrt(np.maximum(variances, 1e-12 * variances.max()))
    share, turn = np.linalg.eigh(np.eye(len(seen)) - white.T @ noise @ white)
    floor = THRESHOLDS.least_start**2
    back = vectors * np.sqrt(np.maximum(variances, 1e-12 * variances.max()))
    return back @ turn * np.sqrt(np.maximum(share, floor))
