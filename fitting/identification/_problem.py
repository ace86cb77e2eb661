"""The fitting problem of a model and a recording (Eqs. 25, 26): one residual vector over all runs.

The polynomial and the constants enter linearly, with columns that depend on the drive alone. So
they are projected out of the residuals, not iterated on (variable projection), and solved for at
the end.
"""

import dataclasses
from functools import cached_property, partial
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array

from fitting.solver._bound_transform import Bounds
from fitting.solver._least_squares import SolverOptions, least_squares
from fitting.solver._levenberg_marquardt import linearise
from fitting.solver._optimum import LeastSquares
from rapi_jax import ECDL, Recording
from rapi_jax.internal import Batch, DriveBatch, to_batch

from ._linear_part import LinearPart
from ._parameter_vector import ParameterVector, as_device
from ._run_residual import Data, RunResidual
from ._solution import Evaluation, Solution
from ._thresholds import THRESHOLDS
from .intervals._residual import IntervalResidual
from .intervals._sums import IntervalSums


@dataclasses.dataclass(frozen=True, eq=False)
class Problem:
    """A model with some parameters free, against a recording.

    The vector is: the model's parameters; with `response_origin = "run"` one offset a run; with
    `drift` the creep of the origin, in response units per decade of session time; one initial
    fraction a play for each run with an unknown history.
    """

    ecdl: ECDL
    recording: Recording
    data: Batch
    vector: ParameterVector
    free: np.ndarray  # of the model's parameters
    linear: np.ndarray  # of these, solved for exactly
    unknown_history: np.ndarray  # of the runs
    drift: np.ndarray | None  # decades of session time, "runs time"

    @classmethod
    def of(
        cls,
        ecdl: ECDL,
        recording: Recording,
        free: Any,
        *,
        history: bool = True,
        drift: bool | None = None,
    ) -> "Problem":
        """`free` selects what may move, `history` frees the plays' start in runs not repeating.

        `drift` lets the origin creep; by default where a run holds enough periods to show it.
        """
        vector = ParameterVector.of(ecdl)
        mask = vector.mask(ecdl, free)
        linear = np.array(vector.spread(lambda p: p.linear), dtype=bool) & mask
        origin = ecdl.operator.fields.origin
        if ecdl.effects or (origin is not None and mask[vector.names.index(origin)]):
            linear[:] = False  # the columns are then not those of the drive alone
        unknown = np.array([history and not run.drive.repeats for run in recording.runs])
        data = to_batch(recording, lead=bool(ecdl.effects))
        if drift is None:
            drift = max(run.drive.periods for run in recording.runs) >= THRESHOLDS.drift_periods
        decades = _decades(recording, data) if drift else None
        problem = cls(ecdl, recording, data, vector, mask, linear, unknown, decades)
        return problem if problem._has_constant else dataclasses.replace(problem, drift=None)

    def with_recording(self, recording: Recording) -> "Problem":
        """The same problem on other data: runs of the same number, names and sizes."""
        data = to_batch(recording, lead=bool(self.ecdl.effects))
        drift = None if self.drift is None else _decades(recording, data)
        return dataclasses.replace(self, recording=recording, data=data, drift=drift)

    @property
    def constant(self) -> str:
        """The name of the operator's constant."""
        return self.ecdl.operator.fields.constant

    @property
    def own_origin(self) -> bool:
        """Whether each run has an origin of its own."""
        return self.recording.response_origin == "run" and self._has_constant

    @property
    def _has_constant(self) -> bool:
        return bool(self.linear[self.vector.names.index(self.constant)])

    @property
    def offsets(self) -> int:
        """Number of run offsets in the vector."""
        return len(self.recording.runs) if self.own_origin else 0

    @property
    def nuisances(self) -> int:
        """Number of offsets and drifts in the vector."""
        return self.offsets + (self.drift is not None)

    @property
    def own_size(self) -> int:
        """Size of the vector that the solver sees: without offsets and drift."""
        return self.vector.size + int(self.unknown_history.sum()) * self.ecdl.operator.count

    @property
    def names(self) -> list[str]:
        """A name for each element of the vector."""
        runs = [run.name for run in self.recording.runs]
        count = self.ecdl.operator.count
        return (
            self.vector.names
            + [f"offset[{name}]" for name in runs[: self.offsets]]
            + ["drift"] * (self.drift is not None)
            + [
                f"initial_{i + 1}[{name}]"
                for name, unknown in zip(runs, self.unknown_history, strict=True)
                if unknown
                for i in range(count)
            ]
        )

    @property
    def free_count(self) -> int:
        """Number of parameters that the data must fix."""
        own = max(self.offsets - 1, 0)
        return (
            int(self.free.sum()) + own + int(self.unknown_history.sum()) * self.ecdl.operator.count
        )

    def weights(self, run_weights: np.ndarray, use: np.ndarray | None = None) -> np.ndarray:
        """Square roots of the samples' weights, "runs time"; `use` narrows what is fitted."""
        use = self.data.use if use is None else self.data.use & use
        return np.sqrt(run_weights)[:, None] * use

    @cached_property
    def columns(self) -> tuple[np.ndarray, np.ndarray]:
        """Columns of the linear part, "runs time linear", and their places in the vector."""
        names = self.vector.names
        shape = self.data.u.shape
        basis = self.ecdl.operator.linear_basis(self.data.u)
        columns, places = [], []
        for at in np.flatnonzero(self.linear):
            if names[at] != self.constant or not self.own_origin:
                columns.append(basis[names[at]])
                places.append(at)
        for run in range(self.offsets):
            columns.append(np.broadcast_to((np.arange(shape[0]) == run)[:, None], shape))
            places.append(self.vector.size + run)
        if self.drift is not None:
            columns.append(self.drift)
            places.append(self.vector.size + self.offsets)
        if not columns:
            return np.zeros((*shape, 0)), np.zeros(0, dtype=int)
        return np.stack(columns, axis=2), np.array(places)

    def linear_part(self, weight: np.ndarray) -> LinearPart:
        """The linear part under these weights, kept for the next fit with the same."""
        kept = self.kept.get("linear part")
        if kept is None or not np.array_equal(kept[0], weight):
            columns, places = self.columns
            weighted = (weight[:, :, None] * columns).reshape(weight.size, -1)
            kept = self.kept["linear part"] = weight, LinearPart.of(weighted, places)
        return kept[1]

    @cached_property
    def kept(self) -> dict[str, Any]:
        """What fits of this problem need again."""
        return {}

    @cached_property
    def _drives(self) -> DriveBatch:
        return self.data.device()

    def moving_bounds(self) -> dict[tuple[int, int], float]:
        """Places of free parameters whose bounds move with another's, by the operator."""
        names = self.vector.names
        slopes = self.ecdl.operator.couplings(list(self.data.u_pp), list(self.data.freq))
        places = {(names.index(a), names.index(b)): slope for (a, b), slope in slopes.items()}
        return {(i, j): slope for (i, j), slope in places.items() if self.free[i] and self.free[j]}

    def bounds(self, start: np.ndarray) -> Bounds:
        """Bounds of the vector without its offsets, for a fit from `start`."""
        low = np.array(self.vector.spread(lambda p: p.bounds[0]))
        high = np.array(self.vector.spread(lambda p: p.bounds[1]))
        coupling = np.eye(start.size)
        for (moved, by), slope in self.moving_bounds().items():
            coupling[moved, by] = slope
        extra = start.size - self.vector.size
        low = np.concatenate([low, np.zeros(extra)])
        high = np.concatenate([high, np.ones(extra)])
        return Bounds.of(start, low, high, coupling)

    def start(self, ecdl: ECDL, initial: float = 0.5) -> np.ndarray:
        """The vector at the values of `ecdl`, a model of the same shape."""
        values = np.where(self.free, self.vector.values(ecdl), self.vector.values(self.ecdl))
        tail = np.full(int(self.unknown_history.sum()) * self.ecdl.operator.count, initial)
        return np.concatenate([values, np.zeros(self.nuisances), tail])

    def model(self, values: np.ndarray) -> ECDL:
        """The model at the vector `values`; with run offsets, its constant is their mean."""
        return self.vector.put(self.ecdl, as_device(values[: self.vector.size]))

    def solve(
        self,
        start: np.ndarray,
        weight: np.ndarray,
        options: SolverOptions,
        *,
        ties: np.ndarray | None = None,
    ) -> Solution:
        """Fit from the vector `start`; `weight` as from `weights`. Call with 64-bit types on."""
        own, move = self.own_vector(start)
        return self.solution(own, move, weight, self._minimise(own, weight, move, ties, options))

    def evaluate(self, start: np.ndarray, weight: np.ndarray) -> Evaluation:
        """At the vector `start`, without a fit."""
        return Evaluation(self, *self.own_vector(start), weight)

    def own_vector(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the solver sees of the vector `start`, and which of it moves."""
        n = self.vector.size
        tail = start[n + self.nuisances :]
        own = np.concatenate([np.where(self.linear, 0.0, start[:n]), tail])
        return own, np.concatenate([self.free & ~self.linear, np.ones(tail.size, dtype=bool)])

    def solution(
        self, own: np.ndarray, move: np.ndarray, weight: np.ndarray, solver: LeastSquares
    ) -> Solution:
        """The fit that `solver` reports, from the vector `own`."""
        own = np.where(move, solver.values, own)  # to the last bit: the change of variables rounds
        return Solution(self, own, move, weight, solver)

    def whole_vector(self, own: np.ndarray) -> np.ndarray:
        """`own`, as the solver sees it, with zeros for offsets and drift."""
        n = self.vector.size
        return np.concatenate([own[:n], np.zeros(self.nuisances), own[n:]])

    def solve_linear(
        self, own: np.ndarray, weight: np.ndarray, error: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """The whole vector with its linear part at the optimum for `own`, and model less data.

        `error`: model less data without the linear part, if that is known.
        """
        error = self._own_error(own) if error is None else error
        values, (columns, places) = self.whole_vector(own), self.columns
        values[places] = solved = self.linear_part(weight).solve((weight * error).ravel())
        return self._share_origin(values) if self.own_origin else values, error + columns @ solved

    def stopped(self, options: SolverOptions, weight: np.ndarray) -> SolverOptions:
        """`options`, with an end where a whole step promises next to nothing of chi-square."""
        if not options.promise:
            return options
        share = THRESHOLDS.solver_chi_square / max(int((weight > 0).sum()), 1)
        return dataclasses.replace(options, whole_promise=share)

    def _minimise(
        self,
        own: np.ndarray,
        weight: np.ndarray,
        move: np.ndarray,
        ties: np.ndarray | None,
        options: SolverOptions,
    ) -> LeastSquares:
        """Over contact intervals where these are known, and have digits enough for the end."""
        fit = partial(least_squares, free=move, ties=ties, options=self.stopped(options, weight))
        sums = IntervalSums.of(self, own)
        if sums is not None:
            data = sums.data(weight)
            found = fit(self.interval_residual, own, data, bounds=self.bounds(own))
            if sums.resolves(found, data):
                return found
            if np.isfinite(found.cost):
                own = np.where(move, found.values, own)
        basis = self.linear_part(weight).basis
        data = Data(self._drives, *(as_device(a) for a in (self.data.y, weight, basis)))
        return fit(self.residual(), own, data, bounds=self.bounds(own))

    def differentiate(self, own: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """The Jacobian of the weighted errors at the vector `own`, by its elements."""
        none = np.zeros((weight.size, 0))
        plain = Data(self._drives, *(as_device(a) for a in (self.data.y, weight, none)))
        unbounded = Bounds.of(np.ones(own.size))
        return np.asarray(linearise(self.residual(), unbounded, as_device(own), plain)[1])

    def project(self, values: np.ndarray, moves: np.ndarray) -> np.ndarray:
        """`values` with those that move inside their bounds, also where these move with others."""
        n = self.vector.size
        bounds = self.bounds(values[:n])
        coupling = np.asarray(bounds.coupling)
        bounded = bounds.bounded(values[:n])
        clipped = np.clip(bounded, np.asarray(bounds.low), np.asarray(bounds.high))
        out = values.copy()
        out[:n] = coupling @ np.where(moves[:n], clipped, bounded)
        tail = slice(n + self.nuisances, None)
        out[tail] = np.clip(values[tail], 0.0, 1.0)
        return out

    def error(self, values: np.ndarray) -> np.ndarray:
        """Model less data at the vector `values`, "runs time"."""
        n = self.vector.size
        error = self._own_error(np.concatenate([values[:n], values[n + self.nuisances :]]))
        if self.offsets:
            error = error + values[n : n + self.offsets, None]
        if self.drift is not None:
            error = error + values[n + self.offsets] * self.drift
        return error

    def _own_error(self, own: np.ndarray) -> np.ndarray:
        """The same without offsets and drift; `own`: the vector without them."""
        return np.asarray(_respond(self.residual(), as_device(own), self._drives)) - self.data.y

    def residual(self, kind: Any = RunResidual, **options: Any) -> Any:
        """The residual as a function of the vector without offsets and drift."""
        unknown = tuple(int(i) for i in np.flatnonzero(self.unknown_history))
        return kind(self.ecdl, self.vector, unknown, **options)

    @property
    def interval_residual(self) -> IntervalResidual:
        """The same over contact intervals.

        Weights of plays, one each, are projected out where they move and have no bounds.
        """
        vector, name = self.vector, self.ecdl.operator.weight
        part = next((part for part in vector.parts if part.name == name), None)
        projects = (
            part is not None
            and part.size > 1
            and not np.isfinite(part.bounds).any()
            and bool(self.free[vector.slice(part.name)].all())
        )
        return self.residual(IntervalResidual, projects=projects)

    def _share_origin(self, values: np.ndarray) -> np.ndarray:
        n, values = self.vector.size, values.copy()
        mean = values[n : n + self.offsets].mean()
        values[self.vector.names.index(self.constant)] = mean
        values[n : n + self.offsets] -= mean
        return values


def _decades(recording: Recording, data: Batch) -> np.ndarray:
    """Decades of session time since the start, one period being the first unit: as creep goes.

    Where no run has a rate, the longest run is that unit.
    """
    first = min(drive.start_s for drive in recording.drives)
    periods = [1.0 / drive.rate for drive in recording.drives if drive.rate > 0]
    unit = max(periods or [float(drive.time[-1]) for drive in recording.drives])
    return np.log10(1.0 + np.maximum(data.time - first, 0.0) / unit)


@eqx.filter_jit
def _respond(residual: RunResidual, values: Array, drives: DriveBatch) -> Array:
    return residual.model(values, drives)
