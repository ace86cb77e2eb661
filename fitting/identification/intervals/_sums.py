"""When and how a fitting problem is solved over contact intervals."""

import dataclasses
import functools
from typing import TYPE_CHECKING, Any, Optional

import jax
import numpy as np
from jaxtyping import Array

from fitting.identification._parameter_vector import as_device
from fitting.identification._thresholds import THRESHOLDS
from fitting.solver._optimum import LeastSquares
from rapi_jax import AbstractOperator
from rapi_jax.internal import Plays

from ._data import IntervalData, Stretched, count_intervals

if TYPE_CHECKING:
    from fitting.identification.problem._problem import Problem


@dataclasses.dataclass(frozen=True, eq=False)
class IntervalSums:
    """The sums of a problem over intervals, made for one weighting at a time.

    `rest`: what of the memoryless part is held, "runs time"; the origin is held too.
    """

    problem: "Problem"
    operator: AbstractOperator
    stretched: Stretched
    rest: np.ndarray

    @classmethod
    def of(cls, problem: "Problem", own: np.ndarray) -> Optional["IntervalSums"]:
        """Those of `problem` from the vector `own`; `None` where intervals cannot stand for it.

        They can where plays with straight bounds act on the drive as it was sent, and nothing but
        these moves besides what is linear; and where they are fewer than samples.
        """
        fixed = own[: problem.vector.size][~problem.free]
        kept = problem.kept.get("intervals")
        if kept is None or not np.array_equal(kept[0], fixed):
            kept = problem.kept["intervals"] = fixed, cls._of(problem, own)
        return kept[1]

    @classmethod
    def _of(cls, problem: "Problem", own: np.ndarray) -> Optional["IntervalSums"]:
        if problem.ecdl.effects or not _moves_only_plays(problem):
            return None
        operator = problem.ecdl.operator
        if not has_straight_bounds(operator):
            return None
        fields = problem.data.drives
        u, u_min = fields["node_u"], fields["u_min"]
        if operator.fields.origin is not None:
            u, u_min = (np.asarray(operator.centred(as_device(x))) for x in (u, u_min))
        stretched = Stretched.of(u, u_min)
        intervals = count_intervals(stretched.begin.size, operator.count)
        if intervals * THRESHOLDS.interval_samples > problem.data.use.sum():
            return None
        rest = np.zeros(problem.data.u.shape)
        if _holds_memoryless(problem):
            values = as_device(own[: problem.vector.size])
            held = problem.vector.put(problem.ecdl, values).operator
            rest = np.asarray(held.memoryless(as_device(problem.data.u)))
        return cls(problem, operator, stretched, rest)

    def data(self, weight: np.ndarray) -> IntervalData:
        """The sums under these weights as JAX arrays, kept for the next fit with the same."""
        problem = self.problem
        kept = problem.kept.get("sums")
        if kept is None or kept[0] is not self or not np.array_equal(kept[1], weight):
            kept = problem.kept["sums"] = self, weight, jax.device_put(self.arrays(weight))
        return kept[2]

    def arrays(self, weight: np.ndarray) -> IntervalData:
        """The sums under these weights, as NumPy arrays."""
        problem = self.problem
        return self.stretched.data(
            problem.data.drives,
            y=problem.data.y - self.rest,
            weight=weight,
            drift=problem.drift,
            linear=problem.linear_part(weight),
            shares=self._shares(),
            order=max(self.operator.coefficients.size, 1),
        )

    def resolves(self, found: LeastSquares, data: IntervalData) -> bool:
        """Whether the sums have digits enough for the end that was found."""
        left = 0.5 * float(np.asarray(data.total)[-1, -1]) * float(data.scale) ** 2
        return found.cost > THRESHOLDS.interval_digits * left

    def _shares(self) -> np.ndarray:
        """The linear columns in the basis `1, x, .., x^order, drift` of each run."""
        problem, order = self.problem, max(self.operator.coefficients.size, 1)
        names, places = problem.vector.names, problem.columns[1]
        first = problem.vector.slice(self.operator.fields.polynomial).start
        size = order + 1 + (problem.drift is not None)
        out = np.zeros((len(problem.recording.runs), size, places.size))
        for k, place in enumerate(places):
            offset = place - problem.vector.size
            if offset < 0:
                power = 0 if names[place] == problem.constant else int(place) - first + 1
                out[:, : power + 1, k] = self.stretched.powers(power)
            elif offset < problem.offsets:
                out[offset, 0, k] = 1.0
            else:
                out[:, -1, k] = 1.0
        return out


def has_straight_bounds(operator: AbstractOperator) -> bool:
    """Whether the falling bounds of its plays are straight, whatever its parameters."""
    leaves, structure = jax.tree_util.tree_flatten(operator)
    return _has_straight_bounds(structure, tuple(np.shape(leaf) for leaf in leaves))


@functools.cache
def _has_straight_bounds(structure: Any, shapes: tuple[tuple[int, ...], ...]) -> bool:
    def plays(leaves: list[Array], one: Array) -> Plays:
        return jax.tree_util.tree_unflatten(structure, leaves).plays(one, one)

    leaves = [jax.ShapeDtypeStruct(shape, np.float64) for shape in shapes]
    return jax.eval_shape(plays, leaves, jax.ShapeDtypeStruct((), np.float64)).bow is None


def _holds_memoryless(problem: "Problem") -> bool:
    """Whether some of the memoryless part is held, and not solved for."""
    fields = problem.ecdl.operator.fields
    parts = zip(problem.vector.parts, problem.vector.slices, strict=True)
    own = (fields.polynomial, fields.constant)
    return any(part.name in own and not problem.linear[at].all() for part, at in parts)


def _moves_only_plays(problem: "Problem") -> bool:
    """Whether nothing moves but plays and what is linear."""
    fields = problem.ecdl.operator.fields
    others = {fields.polynomial, fields.constant, fields.origin}
    moved = problem.free & ~problem.linear
    parts = zip(problem.vector.parts, problem.vector.slices, strict=True)
    return not any(part.name in others and moved[at].any() for part, at in parts)
