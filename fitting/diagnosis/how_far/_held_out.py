"""Parts of a recording that are held out, and errors on them of a model refitted to the rest."""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._periods import PeriodBlock, slice_block
from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import Recording

from ._determination import is_as_good, prediction_change, prediction_variance
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class Fold:
    """One part held out: its name, what is seen, and what is held, as blocks of their runs."""

    name: str
    seen: list[PeriodBlock]
    use: np.ndarray  # runs that are seen
    held: list[PeriodBlock]
    runs: list[int]  # of `held`


def folds(whitened: WhitenedModel) -> list[Fold]:
    """Each rate, each amplitude, and the last third of the periods, as far as there are several."""
    recording, blocks = whitened.recording, whitened.blocks
    out = []
    for name, members in _groups(recording):
        runs = [k for k, member in enumerate(members) if member]
        held = [blocks[k] for k in runs]
        out.append(Fold(name, blocks, ~members, held, runs))
    # A run of one period is cut in time; where all are, that is all there is.
    several = [b.periods >= THRESHOLDS.least_periods for b in blocks]
    cut = several if any(several) else [b.left.shape[1] > THRESHOLDS.least_samples for b in blocks]
    if any(cut):
        seen = [
            slice_block(b, 0.0, THRESHOLDS.training_share) if c else b
            for b, c in zip(blocks, cut, strict=True)
        ]
        held = [
            slice_block(b, THRESHOLDS.training_share, 1.0)
            for b, c in zip(blocks, cut, strict=True)
            if c
        ]
        everything = np.ones(len(blocks), dtype=bool)
        runs = [k for k, c in enumerate(cut) if c]
        out.append(
            Fold("last periods" if any(several) else "last third", seen, everything, held, runs)
        )
    return out


def _groups(recording: Recording) -> list[tuple[str, np.ndarray]]:
    drives, unit = recording.drives, recording.drive_unit
    out = []
    rates = np.array([d.rate for d in drives])
    if np.unique(rates).size > 1:
        out += [(f"rate {r:g} Hz", rates == r) for r in np.unique(rates)]
    levels = np.array(recording.amplitudes)
    if levels.size > 1:
        nearest = np.array([int(np.abs(levels - d.u_pp).argmin()) for d in drives])
        out += [(f"swing {a:.4g} {unit}", nearest == i) for i, a in enumerate(levels)]
    return out


@dataclasses.dataclass(frozen=True, eq=False)
class FullRefit:
    """A refit to all data, from which parts are left out."""

    refit: Refit
    state: State

    def held_out_errors(self, fold: Fold) -> list[np.ndarray] | None:
        """Errors on what `fold` holds, of the model refitted to what it leaves.

        `None` where that does not determine the prediction: where errors of parameters make it less
        certain than the mean periods held out are, or a refit no better than chance moves it by
        more. Of later periods of the same drives it is always determined.
        """
        whitened = dataclasses.replace(self.refit.whitened, blocks=fold.seen)
        spectrum, own_origin = self.refit.whitener.spectrum, whitened.own_origin
        whitener = Whitener(fold.seen, spectrum, own_origin, use=fold.use)
        seen = dataclasses.replace(self.refit, whitened=whitened, whitener=whitener)
        start = seen.evaluate(self.state.values, self.state.effects)
        others = Whitener(fold.seen, spectrum, own_origin, use=~fold.use)
        other_runs, readings = not fold.use.all(), sum(b.left.shape[1] for b in fold.held)
        jacobian = self._jacobian
        if other_runs:
            held = ~fold.use[self.refit.whitener.run_of_line]
            variance = prediction_variance(jacobian[~held], jacobian[held], seen.prior_weight)
            if variance >= readings:
                return None
            jacobian = np.where(held[:, None], 0.0, jacobian)
        else:
            jacobian = seen.jacobian(start)
        end = _refit_to_convergence(seen, start, jacobian)
        moved = other_runs and prediction_change(start, end, others) >= readings
        if moved and is_as_good(seen, start, end):
            return None
        runs = list(zip(fold.runs, fold.held, strict=True))
        return self.refit.whitened.block_errors(whitener, end.effects, end.operator_response, runs)[
            0
        ]

    @cached_property
    def _jacobian(self) -> Float[np.ndarray, "lines unknowns"]:
        """Of all data; without some runs their lines are left out of it."""
        return self.refit.jacobian(self.state)


def _refit_to_convergence(
    seen: Refit, state: State, jacobian: Float[np.ndarray, "lines unknowns"]
) -> State:
    """The refit to what is seen: with one Jacobian as far as that goes, then with a new one.

    The first step is what leaving data out comes to in a linear model, and is always taken. More
    follow until they gain little of the excess, or of the noise: what is left to gain then moves
    neither the gap that a prediction leaves nor what it adds to the noise.
    """
    tolerance, noise = THRESHOLDS.refit_tolerance, float(seen.whitener.used_lines)
    least = THRESHOLDS.refit_least_gain * noise
    state = seen.minimise(state, 1, 0.0, jacobian)
    for _ in range(THRESHOLDS.refit_jacobians):
        end = seen.minimise(state, THRESHOLDS.refit_steps, tolerance, jacobian, least)
        gain = state.cost - end.cost
        state = end
        if gain < max(tolerance * (end.cost - noise), least):
            break
        jacobian = seen.jacobian(state)
    return state
