r"""The power of a scan not yet taken to discriminate between two hypotheses.

If `i` is true, the scan would read $y_i$. The rival `j` may be refitted on the old data and the new
scan together. What chi-square it must then lose,

$$T_{ij} = \min_\theta |y_i - y_j(\theta)|^2 + \Delta\chi^2_{old}(\theta),$$

is the scan's power for the ordered pair. To first order about its own fit, with `G` the normal
matrix of the old data and the priors and `J` the derivative on the new scan, it is
$d'(I + J G^{-1} J')^{-1} d$; `_rival_refit` finds the minimum itself.
"""

import dataclasses
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import Drive, Recording
from rapi_jax.effects import AbstractEffect

_PAUSE_S = 1e6  # before a scan, for slow effects: none of what came before is left
FRACTION = 0.3  # standard deviation of a play's first output, as a share of its band
_RIDGE = 1e-11


@dataclasses.dataclass(frozen=True, eq=False)
class Rival:
    """A hypothesis on the old data: its fit, and the information about it there."""

    name: str
    refit: Refit
    state: State
    information: np.ndarray  # over operator's values, old fractions, effects' parameters
    own: int  # number of the operator's values proper

    @classmethod
    def of(
        cls,
        refit: Refit,
        name: str,
        values: np.ndarray,
        effects: Sequence[AbstractEffect],
    ) -> "Rival":
        """The hypothesis at its own fit."""
        state = refit.evaluate(np.asarray(values, dtype=float), tuple(effects))
        information, _, _ = refit.normal_equations(state)
        own = ParameterVector.of(refit.base.operator).size
        return cls(name, refit, state, information, own)


@dataclasses.dataclass(frozen=True, eq=False)
class ScanPrediction:
    """A rival's whitened prediction for one scan, and its Jacobian.

    Parameters: the operator's values, the initial states of the old runs (which do nothing here),
    the effects' parameters, and the initial states of this scan. `synchronous`: derivative of the
    first rows of `value` by all of them; `nonsynchronous`: of the other rows, by the effects'
    parameters alone (`which`). `prior`: information from the data so far.
    """

    value: np.ndarray
    synchronous: np.ndarray
    nonsynchronous: np.ndarray
    which: slice
    prior: np.ndarray

    def push(self, move: np.ndarray) -> np.ndarray:
        """To first order, by how much the prediction moves with the parameters."""
        return np.concatenate([self.synchronous @ move, self.nonsynchronous @ move[self.which]])

    def pull(self, rows: np.ndarray) -> np.ndarray:
        """The transpose of `push`; the last axis of `rows` is the prediction's."""
        split = self.synchronous.shape[0]
        out = rows[:split] @ self.synchronous
        out[self.which] += rows[split:] @ self.nonsynchronous
        return out

    @cached_property
    def normal(self) -> np.ndarray:
        """Information of the scan alone."""
        out = self.synchronous.T @ self.synchronous
        out[self.which, self.which] += self.nonsynchronous.T @ self.nonsynchronous
        return out

    def across(self, other: "ScanPrediction") -> np.ndarray:
        """Products of this one's columns with those of another."""
        out = self.synchronous.T @ other.synchronous
        out[self.which, other.which] += self.nonsynchronous.T @ other.nonsynchronous
        return out


@dataclasses.dataclass(frozen=True, eq=False)
class ScanBatch:
    """Several scans of one form, evaluated together; each with a zero of the response of its own.

    Nothing is left of the runs before: a repeating drive has been on for long, any other begins
    at rest at its first value.
    """

    whitened: WhitenedModel
    whitener: Whitener
    parts: list[np.ndarray]  # of each scan, the places of its synchronous and then its other errors

    @classmethod
    def of(cls, drives: Sequence[Drive], whitener: Whitener) -> "ScanBatch":
        """The scans `drives`, with the noise that `whitener` knows."""
        nothing = [np.zeros(drive.size) for drive in drives]
        whitened = WhitenedModel.of(Recording.of(drives, nothing, response_origin="run"))
        whitened.grids.drives["gap_s"][:] = _PAUSE_S
        own = whitened.make_whitener(whitener.spectrum)
        synchronous, nonsynchronous = [], []
        for block, lines in zip(whitened.blocks, own.lines, strict=True):
            twice = lines.multiplicity == 2
            synchronous.append(lines.synchronous.sum() + (lines.synchronous & twice).sum())
            rest = ~lines.synchronous
            nonsynchronous.append(rest.sum() + (rest & twice).sum() if block.periods > 1 else 0)
        at = np.concatenate([[0], np.cumsum(synchronous)])
        after = at[-1] + np.concatenate([[0], np.cumsum(nonsynchronous)])
        parts = [
            np.concatenate([np.arange(at[k], at[k + 1]), np.arange(after[k], after[k + 1])])
            for k in range(len(drives))
        ]
        return cls(whitened, own, parts)

    def _unknown(self, rival: Rival) -> int:
        return int(self.whitened.unknown_start.sum()) * rival.refit.base.operator.count

    def refit(self, rival: Rival) -> Refit:
        """The rival's operator on these scans."""
        base, extra = rival.refit.base, self._unknown(rival)

        def behind(old: np.ndarray, new: float | bool) -> np.ndarray:
            return np.concatenate([old[: rival.own], np.full(extra, new)])

        own = BaseModel(
            base.operator,
            behind(base.prior_mean, 0.5),
            behind(base.prior_std, FRACTION),
            behind(base.lower, 0.0),
            behind(base.upper, 1.0),
            behind(base.free, True),
        )
        return Refit(self.whitened, self.whitener, own)

    def start(self, rival: Rival) -> np.ndarray:
        """The rival's values on these scans; plays of which nobody knows begin half way."""
        extra = self._unknown(rival)
        return np.concatenate([rival.state.values[: rival.own], np.full(extra, 0.5)])

    def see(self, rival: Rival) -> list[ScanPrediction]:
        """What `rival` predicts for every scan."""
        refit = self.refit(rival)
        return self.seen(rival, refit, refit.evaluate(self.start(rival), rival.state.effects))

    def seen(
        self, rival: Rival, refit: Refit, state: State, only: int | None = None
    ) -> list[ScanPrediction]:
        """The same at any state of `refit`; `only`: for one scan."""
        value = np.concatenate([state.errors.synchronous, state.errors.nonsynchronous])
        base, effect = refit.jacobian_base(state), refit.jacobian_effects(state)
        out = []
        for k in range(len(self.parts)) if only is None else [only]:
            part, fractions = self.parts[k], self.fractions(rival, k)
            split = int((part < state.errors.synchronous.size).sum())
            new = fractions.stop - fractions.start
            own, size = rival.own, rival.information.shape[0]
            which = slice(rival.state.values.size, size)
            synchronous = np.zeros((split, size + new))
            synchronous[:, :own] = base[part[:split], :own]
            synchronous[:, which] = effect[part[:split]]
            synchronous[:, size:] = base[part[:split], fractions]
            prior = np.zeros((size + new, size + new))
            prior[:size, :size] = rival.information
            prior[range(size, size + new), range(size, size + new)] = FRACTION**-2.0
            out.append(ScanPrediction(value[part], synchronous, effect[part[split:]], which, prior))
        return out

    def fractions(self, rival: Rival, k: int) -> slice:
        """Where the first fractions of scan `k` stand in the rival's values on these scans."""
        plays = rival.refit.base.operator.count
        first = rival.own + int(self.whitened.unknown_start[:k].sum()) * plays
        return slice(first, first + (plays if self.whitened.unknown_start[k] else 0))


def solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """With columns of equal length; directions of which nothing is known stay put."""
    length = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    alive = length > 0
    unit = np.where(alive, length, 1.0)
    scaled = matrix / unit[:, None] / unit[None, :]
    scaled[range(unit.size), range(unit.size)] = np.where(alive, 1.0 + _RIDGE, 1.0)
    scaled = np.nan_to_num(scaled)
    right = np.nan_to_num(right / unit)
    try:
        return np.where(alive, np.linalg.solve(scaled, right), 0.0) / unit
    except np.linalg.LinAlgError:
        return np.where(alive, np.linalg.lstsq(scaled, right, rcond=1e-12)[0], 0.0) / unit


def linear_discrimination(truth: ScanPrediction, rival: ScanPrediction) -> tuple[float, np.ndarray]:
    """The power to first order, and by how much the rival's parameters move."""
    d = truth.value - rival.value
    move = solve(rival.prior + rival.normal, rival.pull(d))
    # The cost at the solution, not a difference of large sums: rounding only adds to it.
    rest = d - rival.push(move)
    return float(rest @ rest + move @ rival.prior @ move), move


def ratio(one: ScanPrediction, other: ScanPrediction) -> float:
    """Buzzi-Ferraris's ratio: the difference against the variance of noise and of both fits."""
    d = one.value - other.value
    n = one.prior.shape[0]
    cross = one.across(other)
    matrix = np.block(
        [
            [2.0 * one.prior + one.normal, -cross],
            [-cross.T, 2.0 * other.prior + other.normal],
        ]
    )
    move = solve(matrix, np.concatenate([one.pull(d), -other.pull(d)]))
    rest = d - one.push(move[:n]) + other.push(move[n:])
    cost = move[:n] @ one.prior @ move[:n] + move[n:] @ other.prior @ move[n:]
    return float(rest @ rest + 2.0 * cost) / 2.0
