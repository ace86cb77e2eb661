"""One model for both recordings, and how each departs from it, to first order."""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

from fitting.identification._options import default_free
from fitting.identification._posed import Posed
from fitting.identification.assessment._covariance import correlated_covariance, whole_periods
from fitting.identification.problem._problem import Problem
from rapi_jax import ECDL

from ._estimates import PairEstimates
from ._thresholds import THRESHOLDS

Vector = Float[np.ndarray, " parameters"]
Two = tuple[np.ndarray, np.ndarray]


class Target(NamedTuple):
    """Where the parameters of one session's model go, for the errors of a recording.

    `vector`: all as in its own fit, but with that session's effects. `places`: in it, and `chosen`
    among the parameters of that session, those that are put there.
    """

    vector: Float[np.ndarray, " vector"]
    places: list[int]
    chosen: list[int]


@dataclasses.dataclass(frozen=True, eq=False)
class SharedErrors:
    """Errors of one recording as a function of the parameters compared, and of those of its own.

    All else is as the recording's own fit ended; origin and drift of the session (`nuisance`, an
    orthonormal basis) are projected out. `targets`: for the model of each session; `session`: of
    which one the recording is.
    """

    problem: Problem
    targets: tuple[Target, Target]
    session: int
    nuisance: Float[np.ndarray, "samples columns"]

    @classmethod
    def of(cls, pair: PairEstimates, session: int) -> "SharedErrors":
        """Those of the recording before (0) or after (1), about its own fit."""
        ecdl, recording = pair.results[session].ecdl, pair.results[session].recording
        free = default_free(ecdl, recording)
        posed = Posed.of(ecdl, recording, free, "uniform", history=True, drift=None)
        problem, use = posed.problem, posed.problem.data.use
        runs = np.repeat(np.arange(len(use)), use.sum(axis=1))
        columns = np.ones((runs.size, 1))
        if problem.own_origin:
            columns = (runs[:, None] == np.arange(len(use))).astype(np.float64)
        if problem.drift is not None:
            columns = np.concatenate([columns, problem.drift[use][:, None]], axis=1)
        one, two = (_target(pair, problem, session, model) for model in (0, 1))
        return cls(problem, (one, two), session, np.linalg.qr(columns)[0])

    def __call__(self, values: Vector) -> Float[np.ndarray, " samples"]:
        return self.by_model(self.session, values)

    def by_model(self, session: int, values: Vector) -> Float[np.ndarray, " samples"]:
        """By the model of either session, at its parameters and with its effects alone."""
        vector, places, chosen = self.targets[session]
        vector = vector.copy()
        vector[places] = values[chosen]
        return self._without_origin(vector)

    def of_model(self, ecdl: ECDL) -> Float[np.ndarray, " samples"]:
        """By a model of the same shape as it is."""
        vector = self.targets[self.session].vector.copy()
        vector[: self.problem.vector.size] = self.problem.vector.values(ecdl)
        return self._without_origin(vector)

    def _without_origin(self, vector: Float[np.ndarray, " vector"]) -> np.ndarray:
        error = self.problem.error(vector)[self.problem.data.use]
        return error - self.nuisance @ (self.nuisance.T @ error)

    def slopes(
        self, values: Vector, steps: Vector, session: int | None = None
    ) -> Float[np.ndarray, "samples parameters"]:
        """Derivatives by the parameters, by central differences; of a `session`'s model."""
        model = self.session if session is None else session
        moves = np.diag(THRESHOLDS.slope_step * steps)
        columns = [
            (self.by_model(model, values + h) - self.by_model(model, values - h)) / (2.0 * h.sum())
            for h in moves
        ]
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


def _target(pair: PairEstimates, problem: Problem, session: int, model: int) -> Target:
    """Of a session's `model` in the recording of `session`.

    An effect that one session alone has is as that `model` has it; what is of the session in an
    effect that both have, as the phase of a tone, stays as the recording has it.
    """
    vector, size = problem.start(pair.results[session].ecdl), len(pair.names)
    names = problem.vector.names
    other = problem.vector.values(pair.results[model].ecdl)
    for at, name in enumerate(names):
        if "." in name and name.partition(".")[0] in pair.effects_of_one:
            vector[at] = other[at]
    every = [*pair.names, *pair.own[model]]
    chosen = [
        k
        for k, name in enumerate(every)
        if k < size or model == session or name.partition(".")[0] in pair.effects_of_one
    ]
    return Target(vector, [names.index(every[k]) for k in chosen], chosen)


def shared_errors(pair: PairEstimates) -> tuple[SharedErrors, SharedErrors]:
    """The errors in each recording, all that is not compared as in its own fit."""
    return SharedErrors.of(pair, 0), SharedErrors.of(pair, 1)


@dataclasses.dataclass(frozen=True, eq=False)
class JointFit:
    """The parameters of one model for both, where `moved` is given but for that one.

    `before`, `after`: the parameters, the same but for one and for those of one recording alone.
    `rmse`: of the errors in each.
    """

    before: Vector
    after: Vector
    rmse: tuple[float, float]


def fit_jointly(
    errors: tuple[SharedErrors, SharedErrors],
    alone: Two,
    steps: Two,
    size: int,
    moved: int | None = None,
    start: Two | None = None,
) -> JointFit:
    """The best model for both recordings, by Gauss-Newton from the mean of the two `alone`.

    `size`: how many parameters are of both, the first of each. `moved`: the place of one that may
    differ. `start`: values to begin from instead. Each recording counts by the noise that its own
    fit left.
    """
    weights = [1.0 / max(rms(e(v)), 1e-300) for e, v in zip(errors, alone, strict=True)]
    one, two = alone if start is None else start
    begin = np.concatenate([0.5 * (one[:size] + two[:size]), one[size:], two[size:]])
    scale = np.concatenate([steps[0], steps[1][size:]])
    split = _split(size, one.size, two.size)
    if moved is not None:
        extra = [np.zeros((one.size, 1)), np.eye(two.size)[:, [moved]]]
        split = [np.hstack(both) for both in zip(split, extra, strict=True)]
        begin, scale = np.append(begin, 0.0), np.append(scale, steps[1][moved])

    def stacked(at: np.ndarray) -> np.ndarray:
        parts = zip(weights, errors, split, strict=True)
        return np.concatenate([w * e(s @ at) for w, e, s in parts])

    values, here = begin, stacked(begin)
    for _ in range(THRESHOLDS.joint_steps):
        parts = zip(weights, errors, split, steps, strict=True)
        slopes = np.concatenate([w * e.slopes(s @ values, h) @ s for w, e, s, h in parts])
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
    before, after = (s @ values for s in split)
    left = [rms(e(v)) for e, v in zip(errors, (before, after), strict=True)]
    return JointFit(before, after, (left[0], left[1]))


def _split(size: int, before: int, after: int) -> list[Float[np.ndarray, "parameters unknowns"]]:
    """The parameters of each from the unknowns: `size` of both, and the others of one alone."""
    shared, own = np.eye(size), (before - size, after - size)
    parts = (
        block_diag(shared, np.eye(own[0]), np.zeros((0, own[1]))),
        block_diag(shared, np.zeros((0, own[0])), np.eye(own[1])),
    )
    return [np.asarray(part) for part in parts]


def linearise(
    errors: tuple[SharedErrors, SharedErrors], alone: Two, at: Two, steps: Two
) -> tuple[Two, Two]:
    """Estimates from each recording to first order about `at`, and their covariances.

    About the joint fit these are efficient and, where nothing changed, as good as the first order
    is: a valley of a single recording's chi-square may be long and curved, where its own fit ends
    far away and with a covariance of that place. The noise is that of the fits `alone`.
    """
    values, covariances = [], []
    for e, own, point, step in zip(errors, alone, at, steps, strict=True):
        slopes = e.slopes(point, step)
        move = -step * np.linalg.lstsq(slopes * step, e(point), rcond=None)[0]
        values.append(point + move)
        covariances.append(e.covariance(e(own), slopes))
    return (values[0], values[1]), (covariances[0], covariances[1])


def rms(error: Float[np.ndarray, " samples"]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(error**2)))
