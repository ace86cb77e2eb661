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

from ._thresholds import THRESHOLDS


class RestrictedLikelihood(eqx.Module):
    """Minus the restricted log-likelihood as a function of the parameters of the variances.

    `structure` of `T`: "full" is `R L L' R'` with a triangle `L`, so that `T` may be singular
    without a bound; "diagonal" the same with diagonal `R` and `L`; "factor" a diagonal one and
    what a single common cause adds, an outer product. `R` is `root`, which only scales. Then
    follows an amplitude for each parameter of `smooth`.
    """

    values: Float[Array, "recordings parameters"]
    covariances: Float[Array, "recordings parameters parameters"]
    known: Float[Array, "recordings parameters"]
    rows: Float[Array, "recordings effects"]
    functions: Float[Array, "recordings functions"]
    root: Float[Array, "parameters parameters"]
    smooth: tuple[int, ...] = eqx.field(static=True)
    structure: str = eqx.field(static=True)

    def variances(
        self, point: Float[Array, " point"]
    ) -> tuple[Float[Array, "parameters parameters"], Float[Array, " smooth"]]:
        """`T`, and the amplitudes of smooth drifts."""
        size, root = self.root.shape[0], self.root
        if self.structure == "full":
            count = size * (size + 1) // 2
            low = jnp.zeros((size, size)).at[jnp.tril_indices(size)].set(point[:count])
            return root @ low @ low.T @ root.T, point[count:]
        scale = jnp.sqrt(jnp.sum(root**2, axis=1))
        between = jnp.diag((scale * point[:size]) ** 2)
        if self.structure == "diagonal":
            return between, point[size:]
        loading = scale * point[size : 2 * size]
        return between + loading[:, None] * loading[None, :], point[2 * size :]

    def __call__(self, point: Float[Array, " point"]) -> Float[Array, ""]:
        between, amplitudes = self.variances(point)
        size, effects = self.root.shape[0], self.rows.shape[1]
        known = self.known
        total = known[:, :, None] * known[:, None, :] * (between[None] + self.covariances)
        total = total + jax.vmap(jnp.diag)(1.0 - known)
        factor = jnp.linalg.cholesky(total)
        design = jnp.einsum("me,ab->maeb", self.rows, jnp.eye(size))
        design = design.reshape(*self.values.shape, effects * size)
        if self.smooth:
            one_hot = jnp.zeros((size, len(self.smooth)))
            one_hot = one_hot.at[jnp.array(self.smooth), jnp.arange(len(self.smooth))].set(1.0)
            curves = jnp.einsum("mq,as->masq", self.functions, one_hot * amplitudes[None, :])
            curves = curves.reshape(*self.values.shape, -1)
            design = jnp.concatenate([design, curves], axis=2)
        both = jnp.concatenate([design, self.values[:, :, None]], axis=2) * known[:, :, None]
        solved = jax.vmap(lambda low, right: jax.scipy.linalg.solve_triangular(
            low, right, lower=True))(factor, both)  # fmt: skip
        gram = jnp.einsum("mab,mac->bc", solved, solved)
        prior = jnp.r_[jnp.zeros(effects * size), jnp.ones(design.shape[2] - effects * size)]
        inner = jnp.linalg.cholesky(gram[:-1, :-1] + jnp.diag(prior))
        left = jax.scipy.linalg.solve_triangular(inner, gram[:-1, -1], lower=True)
        logdet = jnp.sum(jnp.log(jax.vmap(jnp.diag)(factor)))
        return (
            logdet + jnp.sum(jnp.log(jnp.diag(inner))) + 0.5 * (gram[-1, -1] - jnp.sum(left**2))
        )


@dataclasses.dataclass(frozen=True, eq=False)
class Variances:
    """Variances at the maximum of the restricted likelihood.

    `between`: `T`, in standardised coordinates. `amplitudes`: of the smooth drifts of `smooth`.
    `loglik`: the restricted log-likelihood, but for a constant of the data and the fixed effects.
    """

    between: np.ndarray
    amplitudes: np.ndarray
    smooth: tuple[int, ...]
    structure: str
    loglik: float
    point: np.ndarray
    converged: bool

    def evidence(self, units: int) -> float:
        """Log evidence by Schwarz' approximation, of `units` recordings more than effects."""
        return self.loglik - 0.5 * self.point.size * float(np.log(units))


def maximise(likelihood: RestrictedLikelihood, start: np.ndarray | None = None) -> Variances:
    """The variances at the maximum, from `start` or from the scatter of the estimates."""
    begin = _start(likelihood) if start is None else start
    point, loss, slope = (np.asarray(part) for part in _descend(likelihood, jnp.asarray(begin)))
    between, amplitudes = likelihood.variances(jnp.asarray(point))
    return Variances(
        np.asarray(between), np.abs(np.asarray(amplitudes)), likelihood.smooth,
        likelihood.structure, -float(loss), point, bool(np.max(np.abs(slope)) < THRESHOLDS.likelihood_slope),
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


def _start(likelihood: RestrictedLikelihood) -> np.ndarray:
    """Half of the scatter between recordings, half of it smooth where that may be."""
    root = np.asarray(likelihood.root)
    size, share = len(root), np.sqrt(0.5)
    scale = np.sqrt(np.sum(root**2, axis=1))
    amplitudes = share * scale[list(likelihood.smooth)]
    if likelihood.structure == "full":
        return np.r_[share * np.eye(size)[np.tril_indices(size)], amplitudes]
    if likelihood.structure == "diagonal":
        return np.r_[np.full(size, share), amplitudes]
    correlation = root @ root.T / np.outer(scale, scale)
    leading = np.linalg.eigh(correlation)[1][:, -1]
    return np.r_[np.full(size, share), share * np.sqrt(0.5 * size) * leading, amplitudes]


def tangent(found: Variances, likelihood: RestrictedLikelihood) -> np.ndarray:
    """Derivatives of all elements of `T` with respect to the free ones, `pairs variances`.

    Of a covariance these are its own elements, so that nothing is singular where one is 0.
    """
    size = len(found.between)
    unit = np.eye(size)
    columns = [np.outer(e, e) for e in unit]
    if found.structure == "full":
        pairs = [(a, b) for a in range(size) for b in range(a)]
        columns += [np.outer(unit[a], unit[b]) + np.outer(unit[b], unit[a]) for a, b in pairs]
    if found.structure == "factor":
        scale = np.sqrt(np.sum(np.asarray(likelihood.root) ** 2, axis=1))
        loading = scale * found.point[size : 2 * size]
        columns += [np.outer(e, loading) + np.outer(loading, e) for e in unit]
    return np.stack([column.ravel() for column in columns], axis=1)


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
