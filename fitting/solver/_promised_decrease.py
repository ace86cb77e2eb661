"""A stop that does not polish noise: when the next step promises next to nothing."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float

from ._thresholds import THRESHOLDS

Scalar = Float[Array, ""]


class _State(eqx.Module):
    inner: Any
    small: Bool[Array, ""]


class StopByPromise(optx.AbstractLeastSquaresSolver):
    """`solver`, ended also where its next step promises less than `share` of the cost.

    What a step promises is the decrease of the linearised problem. Where residuals have kinks the
    solver goes on for many steps, ever shorter, each of which lowers the cost by less than noise
    would change it; the parameters by themselves do not tell, since in a valley they move far.
    In a curved valley, too, short steps promise little: whether a whole Gauss-Newton step does is
    for the caller to see.
    """

    solver: Any  # of Gauss-Newton type, with a search that predicts
    share: Scalar
    rtol: float
    atol: float
    norm: Any

    def __init__(self, solver: Any, share: Scalar):
        self.solver, self.share = solver, share
        self.rtol, self.atol, self.norm = solver.rtol, solver.atol, solver.norm

    def init(self, *args: Any) -> _State:
        return _State(self.solver.init(*args), jnp.asarray(False))

    def step(self, fn, y, args, options, state, tags) -> tuple[Any, _State, Any]:
        y, inner, aux = self.solver.step(fn, y, args, options, state.inner, tags)
        # A step that is not a number promises nothing, and is shortened by the search.
        promised = -self.solver.search.predict_reduction(inner.y_eval - y, inner.f_info)
        small = (promised <= self.share * inner.f_info.as_min()) & jnp.isfinite(promised)
        return y, _State(inner, small), aux

    def terminate(self, fn, y, args, options, state, tags) -> tuple[Bool[Array, ""], Any]:
        done, result = self.solver.terminate(fn, y, args, options, state.inner, tags)
        return done | state.small, result

    def postprocess(self, fn, y, aux, args, options, state, tags, result) -> Any:
        return self.solver.postprocess(fn, y, aux, args, options, state.inner, tags, result)


def cosine(value: Float[Array, " rows"], columns: Float[Array, "rows columns"]) -> Scalar:
    """Cosine between residuals and the range of the columns, those of zeros left out.

    Its square is the share of the cost that a whole Gauss-Newton step promises to take away.
    """
    length = jnp.linalg.norm(columns, axis=0)
    scaled = columns / jnp.where(length > 0, length, 1.0)[None, :]
    ridge = THRESHOLDS.slope_ridge + jnp.where(length > 0, 0.0, 1.0)
    factor = jnp.linalg.cholesky(scaled.T @ scaled + jnp.diag(ridge))
    along = jax.scipy.linalg.solve_triangular(factor, scaled.T @ value, lower=True)
    return jnp.linalg.norm(along) / jnp.linalg.norm(value)
