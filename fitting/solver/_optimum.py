"""The end of a least-squares fit, and what is known of a point on the way there."""

import dataclasses
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Array

from ._bound_transform import Bounds
from ._identifiability import inverse_gram, qr_factor, scale_columns, singular_directions
from ._levenberg_marquardt import Residual, evaluate
from ._thresholds import THRESHOLDS

_EPS = float(np.finfo(float).eps)


@dataclasses.dataclass(frozen=True, eq=False)
class LeastSquares:
    """The end of a fit: values, residuals, Jacobian, and whether it is an optimum.

    `values` are physical; `jacobian` is of the residuals with respect to them, columns of fixed
    ones zero. `moves` is the derivative of the values by each coordinate that was fitted, one
    column for each group of tied values. `slope` is the cosine between the residuals and the range
    of the Jacobian, less its rounding error: 0 at an optimum, 1 where a value that mattered at the
    start has run to where it does not. Directions that change no residual from the start do not
    count, so `converged` says nothing about them: they show as zeros of `spectrum` and as infinite
    `stderr`. `reason` says why `converged` is false, else it is empty. `trace` lists (steps, cost)
    by stage.

    >>> import jax.numpy as jnp
    >>> from fitting import least_squares
    >>> line = jnp.array([0.0, 1.0, 2.0])
    >>> off = lambda x, line: x[0] + x[1] * line - (1.0 + 2.0 * line)
    >>> found = least_squares(off, jnp.zeros(2), line)
    >>> found.converged, found.values.round(6).tolist()
    (True, [1.0, 2.0])
    """

    values: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    moves: np.ndarray
    free: np.ndarray
    at_bound: np.ndarray
    slope: float
    steps: int
    converged: bool
    reason: str
    trace: tuple[tuple[int, float], ...]

    @property
    def cost(self) -> float:
        """Half the sum of squared residuals; not a number or infinite where it overflows."""
        with np.errstate(over="ignore", invalid="ignore"):
            return 0.5 * float(self.residual @ self.residual)

    @property
    def degrees(self) -> int:
        """Residuals less free parameters; values tied together count as one."""
        return self.residual.size - self.moves.shape[1]

    @cached_property
    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Singular values (largest first) and right vectors of the column-scaled free Jacobian."""
        return singular_directions(scale_columns(self.jacobian[:, self.free])[0])

    @cached_property
    def covariance(self) -> np.ndarray:
        """`s^2 (J'J)^-1`, for white residuals; infinite where undetermined."""
        gram = inverse_gram(self.jacobian @ self.moves)
        unknown = ~np.isfinite(np.diag(gram)) | (self.degrees <= 0)
        sigma2 = 2.0 * self.cost / max(self.degrees, 1)
        out = sigma2 * self.moves @ np.where(np.isfinite(gram), gram, 0.0) @ self.moves.T
        undetermined = (self.moves[:, unknown] != 0).any(axis=1)
        out[undetermined, undetermined] = np.inf
        return out

    @property
    def stderr(self) -> np.ndarray:
        """Standard errors for white residuals."""
        return np.sqrt(np.diag(self.covariance))


@dataclasses.dataclass(frozen=True, eq=False)
class Point:
    """Unbounded coordinates, residuals and physical values there, and the Jacobians of both."""

    x: Array
    value: np.ndarray
    jacobian: np.ndarray
    physical: np.ndarray
    inner: np.ndarray  # Jacobian of the physical values

    @classmethod
    def at(cls, residual: Residual, bounds: Bounds, x: Array, args: Any) -> "Point":
        """What is known at the coordinates `x`."""
        x, *known = evaluate(residual, bounds, x, args)
        return cls(x, *(np.asarray(a) for a in known))

    @cached_property
    def cost(self) -> float:
        """Half the sum of squared residuals; not a number or infinite where it overflows."""
        with np.errstate(over="ignore", invalid="ignore"):
            return 0.5 * float(self.value @ self.value)

    @property
    def exact(self) -> bool:
        """Whether the residuals are no more than rounding of what the parameters make."""
        made = self.jacobian @ np.asarray(self.x)
        return bool(np.linalg.norm(self.value) <= THRESHOLDS.exact_fit * np.linalg.norm(made))

    def finite(self, tie: np.ndarray) -> bool:
        """Whether a solver can go on from here."""
        moved = self.jacobian[:, tie.any(axis=1)]
        return bool(np.isfinite(self.cost) and np.isfinite(moved).all())

    def slope(self, bounds: Bounds, tie: np.ndarray, wanted: float) -> float:
        """Cosine between the residuals and what the coordinates can change, less rounding.

        A coordinate on its way into a bound does not count once what is left to gain there, the
        gradient times the distance, is as small as `wanted`.
        """
        unit = np.sqrt(2.0 * self.cost)
        if unit == 0.0:
            return 0.0
        x = np.asarray(self.x)
        moved = np.where(tie.any(axis=1), self.jacobian, 0.0)
        # Distance and derivative of the bijection near a bound combine to the coordinate itself.
        left = (self.value @ moved) * x / unit**2
        near = bounds.at_bound(self.physical)
        pinned = near & (left <= 0) & (left >= -wanted)
        columns = moved @ (tie & ~pinned[:, None])
        length = np.linalg.norm(columns, axis=0)
        columns = columns[:, length > 0] / length[length > 0]
        # R of [J r] ends in the residuals' components along the range of J.
        factor = qr_factor(np.column_stack([columns, self.value / unit]))
        turn, s, _ = np.linalg.svd(factor[: columns.shape[1], :-1])
        cosine = np.abs(factor[: columns.shape[1], -1] @ turn)[: s.size]
        # Rounding error: of the parameters, and of the Jacobian in its weak directions.
        rounding = _EPS * np.linalg.norm(np.abs(moved) @ np.abs(x)) / unit
        weak = _EPS * np.sqrt(s.size) * s.max(initial=0.0) / np.where(s > 0, s, _EPS)
        return float(np.linalg.norm(np.maximum(cosine - rounding - weak, 0.0)))


def finish(
    bounds: Bounds,
    point: Point,
    tie: np.ndarray,
    wanted: float,
    slope: float,
    why: str,
    trace: list[tuple[int, float]],
) -> LeastSquares:
    """The end at `point`, `slope` there, of which at most `wanted` is left at an optimum.

    `tie`: which coordinate moves with which; see `least_squares`. `why`: the reason why it is none.
    """
    values, inner = point.physical, point.inner
    trace = trace or [(0, point.cost)]
    if not why and not (slope <= wanted or point.exact):
        why = f"the gradient is not zero at the end (cosine {slope:.1e})"
    free: np.ndarray = np.any(tie, axis=1)
    coupling = np.asarray(bounds.coupling)
    own = np.diag(np.linalg.solve(coupling, inner))  # of each bounded value alone
    flat = np.where(own > 0, 1.0 / np.where(own > 0, own, 1.0), 0.0)
    physical = np.where(free, point.jacobian, 0.0) * flat @ np.linalg.inv(coupling)
    return LeastSquares(
        values,
        point.value,
        np.where(free, physical, 0.0),
        np.where(free[:, None], inner @ tie, 0.0)[:, tie.any(axis=0)],
        free,
        bounds.at_bound(values) & free,
        slope,
        trace[-1][0],
        not why,
        why,
        tuple(trace),
    )
