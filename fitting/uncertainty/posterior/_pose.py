"""The log density of a fitted problem, from the noise that its residuals hold."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.identification._parameter_vector import as_device
from fitting.identification._thresholds import THRESHOLDS as IDENTIFICATION
from fitting.identification.intervals._residual import IntervalResidual
from fitting.identification.intervals._sums import IntervalSums
from fitting.identification.problem._bounds import bounds_of
from fitting.identification.problem._problem import Problem
from fitting.uncertainty._fitted_problem import FittedProblem
from fitting.uncertainty._thresholds import THRESHOLDS
from rapi_jax import ModelError

from ._log_density import AbstractMisfit, IntervalMisfit, LogDensity, SampleMisfit
from ._noise_precision import NoisePrecision, solve_noise
from ._open_coordinates import OpenCoordinates


@dataclasses.dataclass(frozen=True, eq=False)
class Posed:
    """A log density, and what turns its coordinates into the problem's vector.

    `samples`: the misfit over samples, which knows the linear part. `root`: of the covariance of
    the linear part given the others. `places`: where that stands in the vector.
    """

    problem: Problem
    density: LogDensity
    samples: SampleMisfit
    root: np.ndarray
    places: np.ndarray

    @classmethod
    def of(cls, fitted: FittedProblem) -> "Posed":
        """From a fit; raises `ModelError` where the data do not fix a parameter."""
        problem, solution = fitted.problem, fitted.solution
        _refuse_undetermined(fitted)
        use = problem.data.use
        noise = fitted.uncertainty.noise
        gammas = [noise.autocovariance(row, int(n)) for row, n in enumerate(use.sum(axis=1))]
        columns, places = problem.columns
        jacobian, size = _jacobian(fitted), solution.values.size
        solved = np.zeros((*use.shape, size + places.size))
        gram = np.zeros((size + places.size,) * 2)
        for row, gamma in enumerate(gammas):
            both = np.concatenate([jacobian[row], columns[row]], axis=1)[use[row]]
            solved[row, use[row]] = solve_noise(gamma, both)
            gram += both.T @ solved[row, use[row]]
        covariance = _inverse(gram[size:, size:])
        samples = _sample_misfit(fitted, gammas, solved[:, :, size:], covariance)
        misfit = _over_intervals(problem, solution.own, gammas) or samples
        n = problem.vector.size
        tail = np.arange(n + problem.nuisances, size)
        moved = np.r_[0:n, tail][solution.move]  # in the whole vector
        cross = gram[np.ix_(moved, np.arange(size, gram.shape[0]))]
        information = gram[np.ix_(moved, moved)] - cross @ covariance @ cross.T
        density = _whitened(fitted, misfit, information)
        return cls(problem, density, samples, np.linalg.cholesky(covariance), places)

    @property
    def names(self) -> list[str]:
        """Of what has a posterior."""
        return [self.problem.names[i] for i in self._kept]

    @property
    def _kept(self) -> np.ndarray:
        problem, n = self.problem, self.problem.vector.size
        random = np.zeros(len(problem.names), dtype=bool)
        random[:n] = problem.free
        random[n:] = True
        return np.flatnonzero(random)

    def values(
        self, z: Float[Array, "draws moved"], normal: Float[np.ndarray, "draws linear"]
    ) -> Float[np.ndarray, "draws names"]:
        """Draws of what has a posterior; `normal`: standard normal numbers for the linear part."""
        own, best = (np.asarray(x) for x in _unwhiten(self.density, self.samples, z))
        n = self.problem.vector.size
        middle = np.zeros((own.shape[0], self.problem.nuisances))
        whole = np.concatenate([own[:, :n], middle, own[:, n:]], axis=1)
        whole[:, self.places] = best + normal @ self.root.T
        if self.problem.own_origin:
            offsets = slice(n, n + self.problem.offsets)
            mean = whole[:, offsets].mean(axis=1, keepdims=True)
            whole[:, self.problem.vector.names.index(self.problem.constant)] = mean[:, 0]
            whole[:, offsets] -= mean
        return whole[:, self._kept]


@eqx.filter_jit
def _unwhiten(
    density: LogDensity, samples: SampleMisfit, z: Float[Array, "draws moved"]
) -> tuple[Float[Array, "draws values"], Float[Array, "draws linear"]]:
    def one(z: Array) -> tuple[Array, Array]:
        own = density.vector(z)
        return own, samples.best_linear(own)

    return jax.lax.map(one, z)


def _refuse_undetermined(fitted: FittedProblem) -> None:
    problem = fitted.problem
    bounded = np.isfinite(problem.vector.spread(lambda p: p.bounds)).all(axis=1)
    endless = np.isinf(fitted.uncertainty.stderr)
    endless[: bounded.size] &= ~bounded
    endless[problem.vector.size + problem.nuisances :] = False  # fractions lie between 0 and 1
    if endless.any():
        names = ", ".join(name for name, out in zip(problem.names, endless, strict=True) if out)
        raise ModelError(
            f"the data do not fix {names}, whose prior has no end: there is no posterior. Hold "
            "what is not determined (`free=`), or record runs that tell it."
        )


def _jacobian(fitted: FittedProblem) -> Float[np.ndarray, "runs time values"]:
    """Of model less data, unweighted, by the whole vector; zero where not used."""
    problem, weight = fitted.problem, fitted.weight
    shaped = fitted.solution.jacobian.reshape(*problem.data.use.shape, -1)
    return shaped / np.where(weight > 0, weight, 1.0)[:, :, None]


def _inverse(gram: np.ndarray) -> np.ndarray:
    """The inverse of a Gram matrix, scaled for the purpose."""
    length = np.sqrt(np.diag(gram))
    if not gram.size:
        return gram
    size, turn = np.linalg.eigh(gram / np.outer(length, length))
    if size[0] <= THRESHOLDS.linear_rank * size[-1]:
        raise ModelError(
            "the polynomial, the offsets and the drift of this fit depend on each other, so that "
            "there is no posterior. Use a lower order, or runs that begin at other times."
        )
    return (turn / size) @ turn.T / np.outer(length, length)


def _sample_misfit(
    fitted: FittedProblem, gammas: list[np.ndarray], solved: np.ndarray, covariance: np.ndarray
) -> SampleMisfit:
    """`solved`: `T^-1 X` at the used samples, "runs time linear"."""
    problem, values = fitted.problem, fitted.solution.values
    columns, places = problem.columns
    linear = values[places]
    if problem.own_origin:  # each offset with the constant that they share
        linear = (
            linear
            + np.isin(places, problem.vector.size + np.arange(problem.offsets))
            * (values[problem.vector.names.index(problem.constant)])
        )
    precision = NoisePrecision.of(problem.data.use, gammas)
    cut = np.take_along_axis(solved, np.asarray(precision.place)[:, :, None], axis=1)
    cut = cut * np.asarray(precision.inside)[:, :, None]
    target = as_device(problem.data.y - columns @ linear)
    drives, known = problem.data.device(), (as_device(a) for a in (cut, covariance, linear))
    return SampleMisfit(problem.residual(), drives, target, precision, *known)


def _over_intervals(
    problem: Problem, own: np.ndarray, gammas: list[np.ndarray]
) -> AbstractMisfit | None:
    """The misfit over contact intervals, where noise is white and they have digits enough."""
    if any(gamma[1:].any() for gamma in gammas):
        return None
    sums = IntervalSums.of(problem, own)
    if sums is None:
        return None
    data = sums.data(problem.weights(1.0 / np.array([gamma[0] for gamma in gammas])))
    misfit = IntervalMisfit(problem.residual(IntervalResidual), data)
    left = float(np.asarray(data.total)[-1, -1]) * float(data.scale) ** 2
    found = float(_evaluate(misfit, as_device(own)))
    return misfit if found > IDENTIFICATION.interval_digits * left else None


@eqx.filter_jit
def _evaluate(misfit: AbstractMisfit, own: Array) -> Array:
    return misfit(own)


@eqx.filter_jit
def _slopes(coordinates: OpenCoordinates, x: Array) -> Array:
    return coordinates.linearise(x)[1]


def _whitened(fitted: FittedProblem, misfit: AbstractMisfit, information: np.ndarray) -> LogDensity:
    """The density about the optimum, moved inside bounds at which that lies."""
    problem, own = fitted.problem, fitted.solution.own
    moves = np.flatnonzero(fitted.solution.move)
    n = problem.vector.size
    stderr = fitted.uncertainty.stderr
    stderr = np.concatenate([stderr[:n], stderr[n + problem.nuisances :]])
    bounds = bounds_of(problem, own)
    low, high = np.asarray(bounds.low), np.asarray(bounds.high)
    away = np.minimum(THRESHOLDS.inside * stderr, (high - low) / 4.0)
    inside = bounds.bounded(own)
    clipped = np.clip(inside, low + away, high - away)
    moved = np.where(fitted.solution.move, clipped, inside)
    start = np.asarray(bounds.coupling) @ moved
    open_ = OpenCoordinates.of(bounds_of(problem, start))
    # What does not move may stand at a bound, where it has no coordinate.
    middle = np.where(fitted.solution.move, open_.coordinates(start), 0.0)
    slopes = np.asarray(_slopes(open_, as_device(middle)))[np.ix_(moves, moves)]
    information = slopes.T @ information @ slopes
    # A flat prior between two bounds alone has this precision in its coordinate (logistic law).
    both = (np.isfinite(low) & np.isfinite(high))[moves]
    prior = np.diag(both * 3.0 / np.pi**2)
    covariance = np.linalg.inv(information + prior)
    spread = np.linalg.cholesky((covariance + covariance.T) / 2.0)
    place = jnp.asarray(moves, dtype=jnp.int32)
    return LogDensity(misfit, open_, as_device(own), place, as_device(middle), as_device(spread))
