"""The law of the thresholds once more, beside the effects that were found.

The law is chosen before effects are known (see `choose_family`). Where an effect leaves more than a
wrong law does, the choice falls to the paper's, and an amplitude law beside the effect then stands
for thresholds that are fixed in volts.
"""

import dataclasses

from fitting.diagnosis.family._choice import FamilyChoice, log_evidence
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.which._base import FittedBase, fit_starts, free_values
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._thresholds import THRESHOLDS
from rapi_jax import RAPI, FixedRAPI
from rapi_jax.effects import AmplitudeLaw

from ._density_refit import refit_on_density


def with_fixed_thresholds(fitted: FittedBase, best: Candidate) -> FittedBase | None:
    """The base with thresholds fixed in volts; `None` where `best` does not speak for them.

    They are tried where `best` has an amplitude law beside other effects, and taken where these
    effects beside them leave less, without that law's parameters.
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
    refit, state = fit_starts(whitened, list(guesses), beside, fitted.spectrum)
    *_, end = refit_on_density(_all_free(refit), state.values, state.effects)
    if not end.cost < best.cost:
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


def _all_free(refit: Refit) -> Refit:
    """The problem with all that the data can tell apart free."""
    operator = refit.base.operator
    base = BaseModel.of(refit.whitened, operator, free_values(refit.whitened, operator))
    return dataclasses.replace(refit, base=base)
