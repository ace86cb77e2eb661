"""One model for both recordings, and how each departs from it, to first order."""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.identification._options import default_free
from fitting.identification._posed import Posed
from fitting.identification.assessment._covariance import correlated_covariance, whole_periods
from fitting.identification.problem._problem import Problem
from rapi_jax import ECDL, Recording

from ._estimates import PairEstimates
from ._thresholds import THRESHOLDS

Vector = Float[np.ndarray, " parameters"]
Two = tuple[np.ndarray, np.ndarray]


@dataclasses.dataclass(frozen=True, eq=False)
class SharedErrors:
    """Errors of one recording as a function of the parameters compared.

    All else is as the recording's own fit ended; origin and drift of the session (`nuisance`, an
    orthonormal basis) are projected out.
    """

    problem: Problem
    start: Float[np.ndarray, " vector"]
    places: list[int]
    nuisance: Float[np.ndarray, "samples columns"]

    @classmethod
    def of(cls, ecdl: ECDL, recording: Recording, places: list[int]) -> "SharedErrors":
        """Those of `ecdl`, the recording's own fit."""
        free = default_free(ecdl, recording)
        posed = Posed.of(ecdl, recording, free, "uniform", history=True, drift=None)
        problem, use = posed.problem, posed.problem.data.use
        runs = np.repeat(np.arange(len(use)), use.sum(axis=1))
        columns = np.ones((runs.size, 1))
        if problem.own_origin:
            columns = (runs[:, None] == np.arange(len(use))).astype(np.float64)
        if problem.drift is not None:
            columns = np.concatenate([columns, problem.drift[use][:, None]], axis=1)
        return cls(problem, problem.start(ecdl), places, np.linalg.qr(columns)[0])

    def __call__(self, values: Vector) -> Float[np.ndarray, " samples"]:
        vector = self.start.copy()
        vector[self.places] = values
        error = self.problem.error(vector)[self.problem.data.use]
        return error - self.nuisance @ (self.nuisance.T @ error)

    def slopes(self, values: Vector, steps: Vector) -> Float[np.ndarray, "samples parameters"]:
        """Derivatives by the parameters, by central differences."""
        moves = np.diag(THRESHOLDS.slope_step * steps)
        columns = [(self(values + h) - self(values - h)) / (2.0 * h.sum()) for h in moves]
        return np.stack(columns, axis=1)

    def covariance(
        self, residual: Float[np.ndarray, " samples"], slopes: Float[np.ndarray, "samples _"]
    ) -> Float[np.ndarray, "parameters parameters"]:
        """That of the parameters, for noise as in `residual`: as in a fit, see `_covariance`."""
        use = self.problem.data.use
        ends = np.cumsum(use.sum(axis=1))[:-1]
        columns = np.concatenate([slopes, self.nuisance], axis=1)
        found = correlated_covariance(
            np.split(residual, ends),
            np.split(columns, ends),
            [1.0] * len(use),
            [drive.step_s for drive in self.problem.recording.drives],
            [whole_periods(self.problem, row) for row in range(len(use))],
        )
        return found.covariance[: slopes.shape[1], : slopes.shape[1]]


def shared_errors(pair: PairEstimates) -> tuple[SharedErrors, SharedErrors]:
    """The errors in each recording, all that is not compared as in its own fit."""
    one, two = (SharedErrors.of(r.ecdl, r.recording, pair.places) for r in pair.results)
    return one, two


@dataclasses.dataclass(frozen=True, eq=False)
class JointFit:
    """The parameters of one model for both, where `moved` is given but for that one.

    `before`, `after`: the parameters, the same but for one. `rmse`: of the errors in each.
    """

    before: Vector
    after: Vector
    rmse: tuple[float, float]


def fit_jointly(
    errors: tuple[SharedErrors, SharedErrors],
    alone: Two,
    steps: Vector,
    moved: int | None = None,
    start: Vector | None = None,
) -> JointFit:
    """The best model for both recordings, by Gauss-Newton from the mean of the two `alone`.

    `moved`: the place of a parameter that may differ. `start`: values to begin from instead. Each
    recording counts by the noise that its own fit left.
    """
    weights = [1.0 / max(rms(e(v)), 1e-300) for e, v in zip(errors, alone, strict=True)]
    size, extra = alone[0].size, 0 if moved is None else 1
    split = np.zeros((2, size, size + extra))  # parameters of each, from the unknowns
    split[:, :, :size] = np.eye(size)
    begin = 0.5 * (alone[0] + alone[1]) if start is None else start
    scale = steps
    if moved is not None:
        split[1, moved, size] = 1.0
        begin = np.append(begin, 0.0)
        scale = np.append(steps, steps[moved])

    def stacked(at: np.ndarray) -> np.ndarray:
        parts = zip(weights, errors, split, strict=True)
        return np.concatenate([w * e(s @ at) for w, e, s in parts])

    values, here = begin, stacked(begin)
    for _ in range(THRESHOLDS.joint_steps):
        parts = zip(weights, errors, split, strict=True)
        slopes = np.concatenate([w * e.slopes(s @ values, steps) @ s for w, e, s in parts])
        step = -scale * np.linalg.lstsq(slopes * scale, here, rcond=None)[0]
        for share in (1.0, 0.5, 0.25, 0.125):
            there = stacked(values + share * step)
            if there @ there < here @ here:
                break
        else:
            break
        gained = float(here @ here - there @ there)
        values, here = values + share * step, there
        if gained < THRESHOLDS.joint_gain:
            break
    before, after = split @ values
    left = [rms(e(v)) for e, v in zip(errors, (before, after), strict=True)]
    return JointFit(before, after, (left[0], left[1]))


def linearise(
    errors: tuple[SharedErrors, SharedErrors], alone: Two, at: Two, steps: Vector
) -> tuple[Two, Two]:
    """Estimates from each recording to first order about `at`, and their covariances.

    About the joint fit these are efficient and, where nothing changed, as good as the first order
    is: a valley of a single recording's chi-square may be long and curved, where its own fit ends
    far away and with a covariance of that place. The noise is that of the fits `alone`.
    """
    values, covariances = [], []
    for e, own, point in zip(errors, alone, at, strict=True):
        slopes = e.slopes(point, steps)
        move = -steps * np.linalg.lstsq(slopes * steps, e(point), rcond=None)[0]
        values.append(point + move)
        covariances.append(e.covariance(e(own), slopes))
    return (values[0], values[1]), (covariances[0], covariances[1])


def rms(error: Float[np.ndarray, " samples"]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(error**2)))
