"""The base model: what RA-PI alone makes of a recording, whether a model was brought or not."""

import dataclasses

import numpy as np

from fitting.diagnosis._data_checks import check_enough
from fitting.diagnosis.noise._detrend import detrend
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum, measure_spectrum
from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._effect_vector import Effects
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.where._spectral_lines import find_tones, remove_tones
from fitting.identification._fit import default_free
from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import ECDL, RAPI, AbstractOperator, Recording

_GUESSES = 4
_STEPS = 40
_FAR_LESS = 0.3  # of the excess of one with shared values


@dataclasses.dataclass(frozen=True, eq=False)
class FittedBase:
    """The base at its best, the noise by which it was judged, and the model given, if any.

    `stiff`: the refit with `eta` held, from which effects are looked for, and its end. Where an
    effect is missing, `eta` trades against thresholds and weights along a valley that a refit with
    the effect would have to crawl back. `state`: with all let go.
    `given`: the errors of the model as it was brought ("periods phases" by run); `None` where the
    base was identified here.
    """

    refit: Refit
    state: State
    eta_fixed: tuple[Refit, State]
    spectrum: Spectrum
    given: list[np.ndarray] | None

    @property
    def whitener(self) -> Whitener:
        """The whitening for `spectrum`."""
        return self.refit.whitener


def fit_base(whitened: WhitenedModel, ecdl: ECDL | None) -> FittedBase:
    """The base fitted to the recording, from the model brought and from guesses of its make.

    Raises `DataError` where the readings are too few for its parameters.
    """
    recording = whitened.recording
    effects: Effects = () if ecdl is None else ecdl.effects
    starts = _starts(recording, ecdl)
    first = starts[0]
    check_enough(whitened, first)
    values = BaseModel.of(whitened, first).prior_mean
    nodes = whitened.operator_response(first, values, effects)
    raw = whitened.evaluate_errors(whitened.make_whitener(_ONE), effects, nodes).raw
    spectrum = _quiet(raw, whitened.blocks)
    while True:
        found: list[tuple[Refit, State]] = []
        for operator in starts:
            base = BaseModel.of(whitened, operator, _free(whitened, operator))
            refit = Refit(whitened, whitened.make_whitener(spectrum), base.with_fixed("eta"))
            found.append((refit, refit.minimise(refit.evaluate(base.prior_mean, effects), _STEPS)))
        refit, state = _simplest(found)
        better = _quiet(state.errors.raw, whitened.blocks)
        if spectrum.measured or better.white > 0.5 * spectrum.white:
            break
        spectrum = better  # without repeats the noise is read off what the fit leaves
        starts = [whitened.set_values(refit.base.operator, state.values)]
    base = BaseModel.of(whitened, refit.base.operator, _free(whitened, refit.base.operator))
    nonsynchronous = dataclasses.replace(refit, base=base)
    end = nonsynchronous.minimise(state, _STEPS)
    return FittedBase(nonsynchronous, end, (refit, state), spectrum, None if ecdl is None else raw)


def _simplest(found: list[tuple[Refit, State]]) -> tuple[Refit, State]:
    """The best fit; one with a value for each play only where it leaves far less.

    Such plays bend to what an effect does, and then hide it.
    """
    best = min(found, key=_cost_of)
    tied = [pair for pair in found if not _each(pair[0].base.operator)]
    if not tied or not _each(best[0].base.operator):
        return best
    simple = min(tied, key=_cost_of)
    noise = simple[1].errors.synchronous.size + simple[1].errors.nonsynchronous.size
    return best if best[1].cost - noise < _FAR_LESS * (simple[1].cost - noise) else simple


def _cost_of(pair: tuple[Refit, State]) -> float:
    return pair[1].cost


def _each(operator: AbstractOperator) -> bool:
    """Whether plays have shapes of their own."""
    return isinstance(operator, RAPI) and any(
        np.ndim(getattr(operator, name)) > 0 for name in ("alpha", "lam", "eta")
    )


_ONE = Spectrum(1.0, 0.0, 1.0, True)


def _quiet(errors: list[np.ndarray], blocks: list[PeriodBlock]) -> Spectrum:
    """The noise spectrum, less slow changes and tones that do not follow the scan: they leak."""
    spectrum = measure_spectrum(errors, blocks)
    if not spectrum.measured:
        return spectrum
    steady = detrend(errors, blocks, spectrum)
    if steady is not errors:
        spectrum = measure_spectrum(steady, blocks)
    found = find_tones(steady, blocks, spectrum)
    return measure_spectrum(remove_tones(steady, blocks, found), blocks) if found else spectrum


def _starts(recording: Recording, ecdl: ECDL | None) -> list[AbstractOperator]:
    """Operators to start from. Plays share `lam`, `eta` and `alpha` in all but the one brought.

    With a value for each play a refit ends in one of many valleys; that freedom is the richer
    base's, which starts from here.
    """
    if ecdl is None:
        return list(RAPI.guesses(recording, count=_GUESSES))
    operator = ecdl.operator
    if not isinstance(operator, RAPI):
        return [operator]
    guesses = RAPI.guesses(recording, plays=operator.count, order=operator.d.size, count=2)
    return [operator, *guesses]


def _free(whitened: WhitenedModel, operator: AbstractOperator) -> np.ndarray:
    """Which values may move: those that these data can tell apart, as in a fit."""
    ecdl = ECDL(operator)
    return ParameterVector.of(ecdl).mask(ecdl, default_free(ecdl, whitened.recording))
