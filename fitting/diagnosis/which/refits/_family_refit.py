"""The law of the thresholds once more, beside the effects that were found.

The law is chosen before effects are known (see `choose_family`). Where an effect leaves more than a
wrong law does, the choice falls to the paper's, and an amplitude law beside the effect then stands
for thresholds that are fixed in volts.
"""

import dataclasses

from fitting.diagnosis.family._choice import FamilyChoice, log_evidence
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._effect_vector import Effects
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._base import FittedBase, fit_starts, free_values
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.evidence._calibration import load_calibration
from rapi_jax import RAPI, AbstractOperator, FixedRAPI
from rapi_jax.effects import AmplitudeLaw

from ._density_refit import refit_on_density


def with_fixed_thresholds(fitted: FittedBase, best: Candidate) -> FittedBase | None:
    """The base with thresholds fixed in volts; `None` where `best` does not speak for them.

    They are tried where `best` has an amplitude law beside other effects, and taken where these
    effects beside them have more evidence: a law of thresholds as an effect costs some of its own.
    """
    if type(fitted.operator) is not RAPI or not fitted.family or not fitted.spectrum.measured:
        return None
    law = any(isinstance(effect, AmplitudeLaw) for effect in best.effects)
    if not law or len(best.effects) < 2:
        return None
    whitened, recording = fitted.refit.whitened, fitted.refit.whitened.recording
    first = fitted.operator
    guesses = FixedRAPI.initial_guesses(
        recording, plays=first.count, order=first.coefficients.size, count=THRESHOLDS.guesses
    )
    beside = tuple(e for e in best.on_flexible_base.effects if not isinstance(e, AmplitudeLaw))
    refit, state = _fit_beside(fitted, list(guesses), beside)
    *_, end = refit_on_density(_all_free(refit), state.values, state.effects)
    if not end.cost < best.cost + 2.0 * load_calibration().law:
        return None
    found = whitened.set_values(refit.base.operator, state.values)
    own = fitted.state.effects
    refit, state = fit_starts(whitened, [found, *guesses], own, fitted.spectrum)
    free = _all_free(refit)
    family = FamilyChoice(FixedRAPI, {FixedRAPI.__name__: log_evidence(refit, state)})
    return dataclasses.replace(
        fitted,
        refit=free,
        state=free.minimise(state, THRESHOLDS.base_steps),
        eta_fixed=(refit, state),
        family=family,
    )


def _fit_beside(
    fitted: FittedBase, guesses: list[AbstractOperator], effects: Effects
) -> tuple[Refit, State]:
    """The best fit of a base beside effects that are held: free ones would leave their minimum.

    A base from first guesses is far off at first, and moves an etalon by whole spacings.
    """
    whitened, found = fitted.refit.whitened, []
    for operator in guesses:
        base = BaseModel.of(whitened, operator, free_values(whitened, operator)).with_fixed("eta")
        refit = Refit(whitened, fitted.whitener, base)
        held = dataclasses.replace(refit, hold_effects=True)
        start = held.evaluate(base.prior_mean, effects)
        found.append((refit, held.minimise(start, THRESHOLDS.base_steps)))
    return min(found, key=lambda pair: pair[1].cost)


def _all_free(refit: Refit) -> Refit:
    """The problem with all that the data can tell apart free."""
    operator = refit.base.operator
    base = BaseModel.of(refit.whitened, operator, free_values(refit.whitened, operator))
    return dataclasses.replace(refit, base=base)
