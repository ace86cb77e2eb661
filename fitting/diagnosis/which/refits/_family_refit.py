"""The law of the thresholds once more, beside the effects that were found.

The law is chosen before effects are known (see `choose_family`). Where an effect leaves more than a
wrong law does, the choice falls to the paper's, and an amplitude law beside the effect then stands
for thresholds that are fixed in volts.
"""

import dataclasses

from fitting.diagnosis.family._choice import FamilyChoice, log_evidence
from fitting.diagnosis.which._base import FittedBase, fit_starts, with_all_free
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.evidence._calibration import load_calibration
from rapi_jax import RAPI, FixedRAPI
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
    refit, state = fit_starts(whitened, list(guesses), beside, fitted.spectrum, hold_effects=True)
    *_, end = refit_on_density(with_all_free(refit), state.values, state.effects)
    if not end.cost < best.cost + 2.0 * load_calibration().law:
        return None
    found = whitened.set_values(refit.base.operator, state.values)
    own = fitted.state.effects
    refit, state = fit_starts(whitened, [found, *guesses], own, fitted.spectrum)
    free = with_all_free(refit)
    family = FamilyChoice(FixedRAPI, {FixedRAPI.__name__: log_evidence(refit, state)})
    return dataclasses.replace(
        fitted,
        refit=free,
        state=free.minimise(state, THRESHOLDS.base_steps),
        eta_fixed=(refit, state),
        family=family,
    )
