"""The power of a next scan without linearising: a rival refitted to old data and new together."""

import numpy as np

from fitting.diagnosis.refit._gauss_newton import State
from fitting.solver._damped_gauss_newton import (
    Damping,
    Linearisation,
    StoppingRule,
    minimise_damped,
)

from ._discrimination import FRACTION, Rival, ScanBatch, ScanPrediction, solve

_STEPS = 10
_DAMPING = Damping(
    initial=1e-6, decrease=10.0, increase=30.0, smallest=1e-9, largest=1e6, attempts=5
)
_ENOUGH = 1e-2  # of the cost: a smaller fall ends a refit
_AGREES = 1e-2  # of the first-order power: how near the cost of its solution must be to it
_FINE = 1e-3  # the same, while the cost is above that of first order


class _Joint:
    """A rival on its own fit of the old data, without noise, and on one new scan."""

    def __init__(self, trials: ScanBatch, k: int, rival: Rival, target: np.ndarray) -> None:
        self.trials, self.k, self.rival, self.target = trials, k, rival, target
        self.new = trials.refit(rival)
        self.n, self.m = rival.state.values.size, rival.information.shape[0]
        self.fractions = trials.fractions(rival, k)
        prior, free = rival.refit.base.prior_std, rival.refit.base.free
        self.weight = np.where(free & np.isfinite(prior), prior, np.inf) ** -2.0

    def begin(self) -> tuple[State, State]:
        start = self.trials.start(self.rival)
        return self.rival.state, self.new.evaluate(start, self.rival.state.effects)

    def cost(self, at: tuple[State, State]) -> float:
        old, new = at
        fit = self.rival.state
        synchronous = old.errors.synchronous - fit.errors.synchronous
        nonsynchronous = old.errors.nonsynchronous - fit.errors.nonsynchronous
        off = old.values - fit.values
        fraction = (new.values[self.fractions] - 0.5) / FRACTION
        rest = self._rest(new)
        sums = (
            synchronous @ synchronous,
            nonsynchronous @ nonsynchronous,
            (self.weight * off) @ off,
            fraction @ fraction,
        )
        return float(sum(sums) + rest @ rest)

    def _rest(self, new: State) -> np.ndarray:
        value = np.concatenate([new.errors.synchronous, new.errors.nonsynchronous])
        return value[self.trials.parts[self.k]] - self.target

    def normal(self, at: tuple[State, State]) -> tuple[np.ndarray, np.ndarray]:
        old, new = at
        refit, fit, n = self.rival.refit, self.rival.state, self.n
        split = fit.errors.synchronous.size
        s = refit.jacobian_effects(old)
        top, nonsynchronous = (
            np.concatenate([refit.jacobian_base(old), s[:split]], axis=1),
            s[split:],
        )
        seen = self.trials.seen(self.rival, self.new, new, self.k)[0]
        matrix = seen.normal.copy()
        matrix[: self.m, : self.m] += top.T @ top
        matrix[n : self.m, n : self.m] += nonsynchronous.T @ nonsynchronous
        matrix[range(n), range(n)] += self.weight
        extra = range(self.m, matrix.shape[0])
        matrix[extra, extra] += FRACTION**-2.0
        gradient = seen.pull(self._rest(new))
        gradient[: self.m] += (old.errors.synchronous - fit.errors.synchronous) @ top
        gradient[n : self.m] += (
            old.errors.nonsynchronous - fit.errors.nonsynchronous
        ) @ nonsynchronous
        gradient[:n] += self.weight * (old.values - fit.values)
        gradient[self.m :] += (new.values[self.fractions] - 0.5) / FRACTION**2
        return matrix, gradient

    def linearise(self, at: tuple[State, State], width: float) -> Linearisation:
        """The damped normal equations at a state; secants have one width here."""
        del width
        matrix, gradient = self.normal(at)
        diagonal = np.diag(np.diag(matrix))
        return Linearisation(lambda damping: -solve(matrix + damping * diagonal, gradient))

    def moved(self, at: tuple[State, State], move: np.ndarray) -> tuple[State, State]:
        old = self.rival.refit.take_step(at[0], move[: self.m])
        values = np.concatenate([old.values[: self.rival.own], at[1].values[self.rival.own :]])
        values[self.fractions] = np.clip(values[self.fractions] + move[self.m :], 0.0, 1.0)
        return old, self.new.evaluate(values, old.effects)


def refit_rival(
    trials: ScanBatch, k: int, truth: ScanPrediction, rival: Rival, first: tuple[float, np.ndarray]
) -> float:
    """The power of scan `k` by a true joint refit of `rival`; `first`: what `linear` said.

    The old data are what the rival itself says they are, so that its fit there costs nothing.
    """
    joint = _Joint(trials, k, rival, truth.value)
    at = joint.begin()
    best = joint.cost(at)
    there = joint.moved(at, first[1])
    if joint.cost(there) < best:
        at, best = there, joint.cost(there)
    if abs(best - first[0]) <= _AGREES * first[0]:
        return best  # the first-order solution costs what it should: it is the minimum
    reached = minimise_damped(
        at,
        cost=joint.cost,
        linearise=joint.linearise,
        move=joint.moved,
        damping=_DAMPING,
        stop=StoppingRule(lambda decrease, cost: decrease < _negligible(cost, first[0])),
        max_steps=_STEPS,
    )
    return joint.cost(reached)


def _negligible(cost: float, first_order: float) -> float:
    """The decrease below which a refit ends."""
    share = _FINE if cost > 1.02 * first_order else _ENOUGH
    return max(share * cost, 0.01)
