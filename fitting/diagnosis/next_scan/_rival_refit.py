"""The power of a next scan without linearising: a rival refitted to old data and new together."""

import numpy as np

from fitting.diagnosis.refit._gauss_newton import State
from fitting.solver._damped_gauss_newton import (
    Damping,
    Linearisation,
    StoppingRule,
    minimise_damped,
)

from ._discrimination import solve
from ._scan_batch import Rival, ScanBatch, ScanPrediction
from ._thresholds import THRESHOLDS

_DAMPING = Damping(
    initial=1e-6, decrease=10.0, increase=30.0, smallest=1e-9, largest=1e6, attempts=5
)


class _Joint:
    """A rival on its own fit of the old data, without noise, and on one new scan."""

    def __init__(self, batch: ScanBatch, k: int, rival: Rival, target: np.ndarray) -> None:
        self.batch, self.k, self.rival, self.target = batch, k, rival, target
        self.new = batch.refit(rival)
        self.n, self.m = rival.state.values.size, rival.information.shape[0]
        self.initial_states = batch.initial_states(rival, k)
        prior, free = rival.refit.base.prior_std, rival.refit.base.free
        self.weight = np.where(free & np.isfinite(prior), prior, np.inf) ** -2.0

    def initial(self) -> tuple[State, State]:
        start = self.batch.initial_values(self.rival)
        return self.rival.state, self.new.evaluate(start, self.rival.state.effects)

    def cost(self, at: tuple[State, State]) -> float:
        old, new = at
        fit = self.rival.state
        synchronous = old.errors.synchronous - fit.errors.synchronous
        nonsynchronous = old.errors.nonsynchronous - fit.errors.nonsynchronous
        off = old.values - fit.values
        offset = (new.values[self.initial_states] - 0.5) / THRESHOLDS.initial_state_std
        residual = self._residual(new)
        sums = (
            synchronous @ synchronous,
            nonsynchronous @ nonsynchronous,
            (self.weight * off) @ off,
            offset @ offset,
        )
        return float(sum(sums) + residual @ residual)

    def _residual(self, new: State) -> np.ndarray:
        value = np.concatenate([new.errors.synchronous, new.errors.nonsynchronous])
        return value[self.batch.rows[self.k]] - self.target

    def normal_equations(self, at: tuple[State, State]) -> tuple[np.ndarray, np.ndarray]:
        old, new = at
        refit, fit, n = self.rival.refit, self.rival.state, self.n
        split = fit.errors.synchronous.size
        s = refit.jacobian_effects(old)
        top, nonsynchronous = (
            np.concatenate([refit.jacobian_base(old), s[:split]], axis=1),
            s[split:],
        )
        prediction = self.batch.predict_at(self.rival, self.new, new, self.k)[0]
        matrix = prediction.normal.copy()
        matrix[: self.m, : self.m] += top.T @ top
        matrix[n : self.m, n : self.m] += nonsynchronous.T @ nonsynchronous
        matrix[range(n), range(n)] += self.weight
        extra = range(self.m, matrix.shape[0])
        matrix[extra, extra] += THRESHOLDS.initial_state_std**-2.0
        gradient = prediction.apply_transpose(self._residual(new))
        gradient[: self.m] += (old.errors.synchronous - fit.errors.synchronous) @ top
        gradient[n : self.m] += (
            old.errors.nonsynchronous - fit.errors.nonsynchronous
        ) @ nonsynchronous
        gradient[:n] += self.weight * (old.values - fit.values)
        gradient[self.m :] += (
            new.values[self.initial_states] - 0.5
        ) / THRESHOLDS.initial_state_std**2
        return matrix, gradient

    def linearise(self, at: tuple[State, State], width: float) -> Linearisation:
        """The damped normal equations at a state; secants have one width here."""
        del width
        matrix, gradient = self.normal_equations(at)
        diagonal = np.diag(np.diag(matrix))
        return Linearisation(lambda damping: -solve(matrix + damping * diagonal, gradient))

    def take_step(self, at: tuple[State, State], move: np.ndarray) -> tuple[State, State]:
        old = self.rival.refit.take_step(at[0], move[: self.m])
        values = np.concatenate([old.values[: self.rival.own], at[1].values[self.rival.own :]])
        values[self.initial_states] = np.clip(
            values[self.initial_states] + move[self.m :], 0.0, 1.0
        )
        return old, self.new.evaluate(values, old.effects)


def refit_rival(
    batch: ScanBatch, k: int, truth: ScanPrediction, rival: Rival, first: tuple[float, np.ndarray]
) -> float:
    """The power of scan `k` by a true joint refit of `rival`; `first`: power and step of
    `linear_discrimination`.

    The old data are taken to be the rival's own prediction, so that its fit there costs nothing.
    """
    joint = _Joint(batch, k, rival, truth.value)
    at = joint.initial()
    best = joint.cost(at)
    trial = joint.take_step(at, first[1])
    if joint.cost(trial) < best:
        at, best = trial, joint.cost(trial)
    if abs(best - first[0]) <= THRESHOLDS.first_order_error * first[0]:
        return best  # the first-order solution costs what it should: it is the minimum
    reached = minimise_damped(
        at,
        cost=joint.cost,
        linearise=joint.linearise,
        move=joint.take_step,
        damping=_DAMPING,
        stop=StoppingRule(lambda decrease, cost: decrease < _negligible(cost, first[0])),
        max_steps=THRESHOLDS.joint_steps,
    )
    return joint.cost(reached)


def _negligible(cost: float, first_order: float) -> float:
    """The decrease below which a refit ends."""
    share = (
        THRESHOLDS.joint_gain_above
        if cost > THRESHOLDS.first_order_above * first_order
        else THRESHOLDS.joint_gain
    )
    return max(share * cost, THRESHOLDS.joint_gain_least)
