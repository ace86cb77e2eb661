"""Hypotheses, and what they predict for scans that were not taken: values and Jacobians."""

import dataclasses
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from fitting.diagnosis._text import effect_labels
from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.identification._parameter_vector import ParameterVector
from fitting.report.diagnosis._text import describe_hypothesis
from rapi_jax import Drive, Recording
from rapi_jax.effects import AbstractEffect

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class Rival:
    """A hypothesis on the old data: its fit, and the information about it there."""

    name: str
    refit: Refit
    state: State
    information: np.ndarray  # over operator's values, old states, effects' parameters
    own: int  # the number of the operator's own values

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

    def describe(self, unit: str) -> str:
        """In the words of the verdict; `unit`: of the response."""
        return describe_hypothesis(self.name, effect_labels(self.state.effects, unit))


@dataclasses.dataclass(frozen=True, eq=False)
class ScanPrediction:
    """A rival's whitened prediction for one scan, and its Jacobian.

    Parameters: the operator's values, the initial states of the old runs (which do nothing here),
    the effects' parameters, and the initial states of this scan. `synchronous`: derivative of the
    first rows of `value` by all of them; `nonsynchronous`: of the other rows, by the effects'
    parameters alone (`effect_columns`). `prior`: information from the data so far.
    """

    value: np.ndarray
    synchronous: np.ndarray
    nonsynchronous: np.ndarray
    effect_columns: slice
    prior: np.ndarray

    def apply_jacobian(self, move: np.ndarray) -> np.ndarray:
        """To first order, by how much the prediction moves with the parameters."""
        return np.concatenate(
            [self.synchronous @ move, self.nonsynchronous @ move[self.effect_columns]]
        )

    def apply_transpose(self, rows: np.ndarray) -> np.ndarray:
        """The transpose of `apply_jacobian`; the last axis of `rows` is the prediction's."""
        split = self.synchronous.shape[0]
        out = rows[:split] @ self.synchronous
        out[self.effect_columns] += rows[split:] @ self.nonsynchronous
        return out

    @cached_property
    def normal(self) -> np.ndarray:
        """Information of the scan alone."""
        out = self.synchronous.T @ self.synchronous
        out[self.effect_columns, self.effect_columns] += self.nonsynchronous.T @ self.nonsynchronous
        return out

    def cross_products(self, other: "ScanPrediction") -> np.ndarray:
        """Products of this one's columns with those of another."""
        out = self.synchronous.T @ other.synchronous
        out[self.effect_columns, other.effect_columns] += (
            self.nonsynchronous.T @ other.nonsynchronous
        )
        return out


@dataclasses.dataclass(frozen=True, eq=False)
class ScanBatch:
    """Several scans of one form, evaluated together; each with a zero of the response of its own.

    Nothing is left of the runs before: a repeating drive has been on for long, any other begins
    at rest at its first value.
    """

    whitened: WhitenedModel
    whitener: Whitener
    rows: list[np.ndarray]  # of each scan, its synchronous and then its other errors

    @classmethod
    def of(cls, drives: Sequence[Drive], whitener: Whitener) -> "ScanBatch":
        """The scans `drives`, with the noise that `whitener` knows."""
        zeros = [np.zeros(drive.size) for drive in drives]
        whitened = WhitenedModel.of(Recording.of(drives, zeros, response_origin="run"))
        whitened.grids.drives["gap_s"][:] = THRESHOLDS.recovery
        own = whitened.make_whitener(whitener.spectrum)
        synchronous, nonsynchronous = [], []
        for block, lines in zip(whitened.blocks, own.lines, strict=True):
            twice = lines.multiplicity == 2
            synchronous.append(lines.synchronous.sum() + (lines.synchronous & twice).sum())
            rest = ~lines.synchronous
            nonsynchronous.append(rest.sum() + (rest & twice).sum() if block.periods > 1 else 0)
        at = np.concatenate([[0], np.cumsum(synchronous)])
        after = at[-1] + np.concatenate([[0], np.cumsum(nonsynchronous)])
        rows = [
            np.concatenate([np.arange(at[k], at[k + 1]), np.arange(after[k], after[k + 1])])
            for k in range(len(drives))
        ]
        return cls(whitened, own, rows)

    def _initial_state_count(self, rival: Rival) -> int:
        return int(self.whitened.unknown_start.sum()) * rival.refit.base.operator.count

    def refit(self, rival: Rival) -> Refit:
        """The rival's operator on these scans."""
        base, extra = rival.refit.base, self._initial_state_count(rival)

        def extend(old: np.ndarray, new: float | bool) -> np.ndarray:
            return np.concatenate([old[: rival.own], np.full(extra, new)])

        own = BaseModel(
            base.operator,
            extend(base.prior_mean, 0.5),
            extend(base.prior_std, THRESHOLDS.initial_state_std),
            extend(base.lower, 0.0),
            extend(base.upper, 1.0),
            extend(base.free, True),
        )
        return Refit(self.whitened, self.whitener, own)

    def initial_values(self, rival: Rival) -> np.ndarray:
        """The rival's values on these scans; unknown initial states are half of the band."""
        extra = self._initial_state_count(rival)
        return np.concatenate([rival.state.values[: rival.own], np.full(extra, 0.5)])

    def predict(self, rival: Rival) -> list[ScanPrediction]:
        """The prediction of `rival` for every scan."""
        refit = self.refit(rival)
        state = refit.evaluate(self.initial_values(rival), rival.state.effects)
        return self.predict_at(rival, refit, state)

    def predict_at(
        self, rival: Rival, refit: Refit, state: State, only: int | None = None
    ) -> list[ScanPrediction]:
        """The same at any state of `refit`; `only`: for one scan."""
        value = np.concatenate([state.errors.synchronous, state.errors.nonsynchronous])
        base, effect = refit.jacobian_base(state), refit.jacobian_effects(state)
        out = []
        for k in range(len(self.rows)) if only is None else [only]:
            part, states = self.rows[k], self.initial_states(rival, k)
            split = int((part < state.errors.synchronous.size).sum())
            new = states.stop - states.start
            own, size = rival.own, rival.information.shape[0]
            effect_columns = slice(rival.state.values.size, size)
            synchronous = np.zeros((split, size + new))
            synchronous[:, :own] = base[part[:split], :own]
            synchronous[:, effect_columns] = effect[part[:split]]
            synchronous[:, size:] = base[part[:split], states]
            prior = np.zeros((size + new, size + new))
            prior[:size, :size] = rival.information
            prior[range(size, size + new), range(size, size + new)] = (
                THRESHOLDS.initial_state_std**-2.0
            )
            nonsynchronous = effect[part[split:]]
            out.append(
                ScanPrediction(value[part], synchronous, nonsynchronous, effect_columns, prior)
            )
        return out

    def initial_states(self, rival: Rival, k: int) -> slice:
        """The initial states of scan `k` among the rival's values on these scans."""
        plays = rival.refit.base.operator.count
        first = rival.own + int(self.whitened.unknown_start[:k].sum()) * plays
        return slice(first, first + (plays if self.whitened.unknown_start[k] else 0))
