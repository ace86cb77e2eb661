"""One model for both recordings, and the errors of models of either."""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.identification._fit import Posed, default_free
from fitting.identification._problem import Problem
from rapi_jax import ECDL, Recording

from ._estimates import PairEstimates
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class SharedErrors:
    """Errors of one recording as a function of the parameters compared.

    All else is as the recording's own fit ended; origin and drift of the session are projected out.
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

    def __call__(self, values: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " samples"]:
        vector = self.start.copy()
        vector[self.places] = values
        error = self.problem.error(vector)[self.problem.data.use]
        return error - self.nuisance @ (self.nuisance.T @ error)

    def slopes(
        self, values: Float[np.ndarray, " parameters"], steps: Float[np.ndarray, " parameters"]
    ) -> Float[np.ndarray, "samples parameters"]:
        """Derivatives by the parameters, by central differences."""
        moves = np.diag(THRESHOLDS.slope_step * steps)
        columns = [(self(values + h) - self(values - h)) / (2.0 * h.sum()) for h in moves]
        return np.stack(columns, axis=1)


@dataclasses.dataclass(frozen=True, eq=False)
class JointFit:
    """The parameters of one model for both, and rms errors of it and of the own model of each."""

    values: Float[np.ndarray, " parameters"]
    rmse: tuple[float, float]
    rmse_alone: tuple[float, float]


def fit_jointly(pair: PairEstimates, stderr: Float[np.ndarray, " parameters"]) -> JointFit:
    """One model for both recordings, by Gauss-Newton from the mean of the two.

    `stderr`: of the difference of each parameter. Each recording counts by its own noise.
    """
    errors = shared_errors(pair)
    alone = tuple(_rms(e(v)) for e, v in zip(errors, pair.values, strict=True))
    weights = [1.0 / max(rms, 1e-300) for rms in alone]
    values = 0.5 * (pair.values[0] + pair.values[1])

    def stacked(at: np.ndarray) -> np.ndarray:
        return np.concatenate([w * e(at) for w, e in zip(weights, errors, strict=True)])

    here = stacked(values)
    for _ in range(THRESHOLDS.joint_steps):
        slopes = np.concatenate(
            [w * e.slopes(values, stderr) for w, e in zip(weights, errors, strict=True)]
        )
        step = -stderr * np.linalg.lstsq(slopes * stderr, here, rcond=None)[0]
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
    joint = tuple(_rms(e(values)) for e in errors)
    return JointFit(values, (joint[0], joint[1]), (alone[0], alone[1]))


def shared_errors(pair: PairEstimates) -> list[SharedErrors]:
    """The errors in each recording, all that is not compared as in its own fit."""
    return [SharedErrors.of(r.ecdl, r.recording, pair.places) for r in pair.results]


def _rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))
