"""The choice among RA-PI's thresholds, fixed ones and mixed ones, by evidence.

The paper's thresholds grow with the swing (Eq. 11), those of a classical piezo do not. Where the
wrong law is fitted to several amplitudes, effects are blamed for what it leaves.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._effect_sets import insert_effect
from fitting.diagnosis.which.screening._screen import initial_guesses
from rapi_jax import RAPI, AbstractOperator, FixedRAPI, MixedRAPI, Recording
from rapi_jax.effects import AmplitudeLaw

from ._thresholds import THRESHOLDS

Fit = tuple[Refit, State]


@dataclasses.dataclass(frozen=True)
class FamilyChoice:
    """The family chosen, and the logarithm of the evidence of each that was fitted, by its name.

    `log_evidence` is less a constant that all share: -BIC / 2.
    """

    operator: type[AbstractOperator]
    log_evidence: dict[str, float]

    @property
    def differs(self) -> bool:
        """Whether another law than the paper's was chosen."""
        return self.operator is not RAPI

    @property
    def likelier(self) -> str | None:
        """Another of decisively more evidence, not chosen since it leaves most of the excess."""
        own = self.log_evidence[self.operator.__name__]
        name = max(self.log_evidence, key=lambda one: self.log_evidence[one])
        return name if self.log_evidence[name] - own > THRESHOLDS.log_evidence else None


def can_compare(operator: AbstractOperator, recording: Recording) -> bool:
    """Whether `operator` is one whose law `recording` could tell from another."""
    return type(operator) is RAPI and len(recording.amplitudes) > 1


def choose_family(
    scaled: Fit, fit_family: Callable[[type[AbstractOperator]], Fit], recording: Recording
) -> tuple[Fit, FamilyChoice]:
    """The simplest family that is not clearly beaten, and its fit.

    `scaled`: the fit of a `RAPI`; `fit_family`: that of another class. Another family is taken only
    where the evidence is decisive and it removes most of what the simpler one leaves: an effect is
    not a law of thresholds, and what it leaves no law removes. A mixed law also has to beat an
    amplitude law beside the simpler one.
    """
    best, evidence = scaled, {RAPI.__name__: log_evidence(*scaled)}
    chosen: type[AbstractOperator] = RAPI
    families: list[type[AbstractOperator]] = [FixedRAPI]
    if len(recording.amplitudes) >= THRESHOLDS.amplitudes_of_mixed:
        families.append(MixedRAPI)
    for family in families:
        if not _is_doubtful(best[1]):
            break
        found = fit_family(family)
        evidence[family.__name__] = log_evidence(*found)
        if _replaces(found, best) and (family is not MixedRAPI or _beats_effect(found, best)):
            best, chosen = found, family
    return best, FamilyChoice(chosen, evidence)


def log_evidence(refit: Refit, state: State) -> float:
    """The logarithm of a fit's evidence by BIC, less a constant of the recording."""
    lines = state.errors.synchronous.size + state.errors.nonsynchronous.size
    return -0.5 * (state.cost + float(refit.base.free.sum()) * float(np.log(lines)))


def synchronous_excess(state: State) -> float:
    """Synchronous chi-square above what noise alone would leave; no operator changes the rest."""
    return state.synchronous - state.errors.synchronous.size


def _is_doubtful(state: State) -> bool:
    """Whether more is left than chance and than a decisive gain."""
    chance = THRESHOLDS.chance_sigmas * np.sqrt(2.0 * state.errors.synchronous.size)
    return bool(synchronous_excess(state) > max(chance, 2.0 * THRESHOLDS.log_evidence))


def _replaces(found: Fit, simpler: Fit) -> bool:
    """Whether the evidence is decisive, and most of the simpler family's excess is gone."""
    gain = log_evidence(*found) - log_evidence(*simpler)
    left = synchronous_excess(found[1])
    share = THRESHOLDS.share_left * synchronous_excess(simpler[1])
    return bool(gain > THRESHOLDS.log_evidence and left < share)


def _beats_effect(mixed: Fit, simpler: Fit) -> bool:
    """Whether a mixed law leaves clearly less than an amplitude law beside the simpler family."""
    refit, state = simpler
    own = {effect.name for effect in state.effects}
    if AmplitudeLaw.name in own:
        return False
    guesses = initial_guesses(refit, state, [AmplitudeLaw])[AmplitudeLaw.name]
    starts = [
        refit.evaluate(state.values, insert_effect(state.effects, guess)) for guess in guesses
    ]
    ends = [refit.minimise(one, THRESHOLDS.rival_steps) for one in starts if np.isfinite(one.cost)]
    least = min((end.cost for end in ends), default=np.inf)
    return bool(mixed[1].cost + 2.0 * THRESHOLDS.log_evidence < least)
