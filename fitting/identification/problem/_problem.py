"""The fitting problem of a model and a recording (Eqs. 25, 26): one residual vector over all runs.

The polynomial and the constants enter linearly, with columns that depend on the drive alone. So
they are projected out of the residuals, not iterated on (variable projection), and solved for at
the end.
"""

import dataclasses
from functools import cached_property
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array

from fitting.identification._parameter_vector import ParameterVector, as_device
from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.intervals._residual import IntervalResidual
from fitting.solver._bound_transform import Bounds
from fitting.solver._least_squares import SolverOptions
from fitting.solver._levenberg_marquardt import linearise
from fitting.solver._optimum import LeastSquares
from rapi_jax import ECDL, Recording
from rapi_jax.internal import Batch, DriveBatch, to_batch

from ._drift import session_decades
from ._linear_part import LinearPart, linear_columns
from ._minimise import minimise
from ._refine import refine
from ._run_residual import Data, RunResidual
from ._solution import Evaluation, Solution


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
        decades = session_decades(recording, data) if drift else None
        problem = cls(ecdl, recording, data, vector, mask, linear, unknown, decades)
        return problem if problem._has_constant else dataclasses.replace(problem, drift=None)

    def with_recording(self, recording: Recording) -> "Problem":
        """The same problem on other data: runs of the same number, names and sizes."""
        data = to_batch(recording, lead=bool(self.ecdl.effects))
        drift = None if self.drift is None else session_decades(recording, data)
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
        return linear_columns(self)

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
    def drives(self) -> DriveBatch:
        """The drives of all runs, on the device."""
        return self.data.device()

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
        return self.solution(own, move, weight, minimise(self, own, weight, move, ties, options))

    def refine(self, start: np.ndarray, weight: np.ndarray, max_steps: int) -> Evaluation:
        """Nearly the same with nothing to compile but derivatives, see `refine`."""
        return refine(self, start, weight, max_steps)

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

    def differentiate(self, own: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """The Jacobian of the weighted errors at the vector `own`, by its elements."""
        none = np.zeros((weight.size, 0))
        plain = Data(self.drives, *(as_device(a) for a in (self.data.y, weight, none)))
        unbounded = Bounds.of(np.ones(own.size))
        return np.asarray(linearise(self.residual(), unbounded, as_device(own), plain)[1])

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
        return np.asarray(_respond(self.residual(), as_device(own), self.drives)) - self.data.y

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


@eqx.filter_jit
def _respond(residual: RunResidual, values: Array, drives: DriveBatch) -> Array:
    return residual.model(values, drives)
