"""The base fit: the operator fitted to the recording, without any candidate effect."""

import dataclasses

import numpy as np

from fitting.diagnosis._data_checks import check_enough
from fitting.diagnosis.family._choice import FamilyChoice, can_compare, choose_family
from fitting.diagnosis.noise._detrend import detrend
from fitting.diagnosis.noise._lines import SpectralLines
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum, fast_lines, measure_spectrum
from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._effect_vector import Effects
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.where._tones import find_tones, remove_tones
from fitting.identification._options import default_free
from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import ECDL, RAPI, AbstractOperator, Recording

from ._thresholds import THRESHOLDS
from .refits._flexible_refit import refit_flexible_operator

_UNIT_NOISE = Spectrum.of_white(1.0)


@dataclasses.dataclass(frozen=True, eq=False)
class FittedBase:
    """The fitted base, the noise spectrum it was weighted by, and the errors of a model brought.

    - `refit`, `state`: with all parameters free.
    - `eta_fixed`: with `eta` held, from which effects are searched. Where an effect is missing,
      `eta` trades against thresholds and weights along a flat valley, along which a refit with the
      effect would return only slowly.
    - `given`: the errors of the model as it was brought ("periods phases" by run); `None` where the
      base was identified here.
    - `family`: the law of the thresholds, and what others were tried; `None` where none was, since
      the recording has one amplitude or the model brought is of another kind.
    """

    refit: Refit
    state: State
    eta_fixed: tuple[Refit, State]
    spectrum: Spectrum
    given: list[np.ndarray] | None
    family: FamilyChoice | None = None

    @property
    def operator(self) -> AbstractOperator:
        """The operator as fitted, with all parameters free."""
        return self.refit.whitened.set_values(self.refit.base.operator, self.state.values)

    @property
    def whitener(self) -> Whitener:
        """The whitening for `spectrum`."""
        return self.refit.whitener


def fit_base(whitened: WhitenedModel, ecdl: ECDL | None) -> FittedBase:
    """The base fitted to the recording, from the model brought and from guesses of its kind.

    For a `RAPI` with several amplitudes the law of the thresholds is chosen, too. Raises
    `DataError` where the readings are too few for its parameters.
    """
    recording = whitened.recording
    effects: Effects = () if ecdl is None else ecdl.effects
    starts = _starts(recording, ecdl)
    first = starts[0]
    check_enough(whitened, first)
    raw, spectrum = measure_model_errors(whitened, ECDL(first, effects))
    (refit, state), spectrum = _fit_with_noise(whitened, starts, effects, spectrum)
    family = None
    if can_compare(first, recording):

        def fit_family(
            kind: type[AbstractOperator], plays: int = first.count
        ) -> tuple[Refit, State]:
            order = first.coefficients.size
            starts = kind.initial_guesses(
                recording, plays=plays, order=order, count=THRESHOLDS.guesses
            )
            return fit_starts(whitened, list(starts), effects, spectrum)

        (refit, state), family = choose_family((refit, state), fit_family, recording)
        if family.differs:
            counts = THRESHOLDS.more_plays, THRESHOLDS.many_plays
            sizes = [fit_family(family.operator, plays) for plays in counts]
            refit, state = min([(refit, state), *sizes], key=_flexible_cost)
            # Less is left, by which noise may be read off.
            found = [whitened.set_values(refit.base.operator, state.values)]
            (refit, state), spectrum = _fit_with_noise(whitened, found, effects, spectrum)
    free = with_all_free(refit)
    end = free.minimise(state, THRESHOLDS.base_steps)
    given = None if ecdl is None else raw
    return FittedBase(free, end, (refit, state), spectrum, given, family)


def _fit_with_noise(
    whitened: WhitenedModel,
    starts: list[AbstractOperator],
    effects: Effects,
    spectrum: Spectrum,
) -> tuple[tuple[Refit, State], Spectrum]:
    """The best fit from `starts`, and the noise, of which what a fit leaves tells more.

    Where nothing repeats all of it is read off that; else what is faster than all that repeats.
    """
    while True:
        refit, state = fit_starts(whitened, starts, effects, spectrum)
        better = background_spectrum(state.errors.raw, whitened.blocks, of_fit=True)
        if not _is_news(better, spectrum, whitened.blocks):
            return (refit, state), spectrum
        starts = [whitened.set_values(refit.base.operator, state.values)]
        if spectrum.measured:  # what repeats is the same; once more where nothing else is
            return fit_starts(whitened, starts, effects, better), better
        spectrum = better


def _is_news(better: Spectrum, before: Spectrum, blocks: list[PeriodBlock]) -> bool:
    """Whether the noise that a fit leaves is known better than what was known before it."""
    if not before.measured:
        return better.white < THRESHOLDS.noise_update * before.white
    for block, fast in zip(blocks, fast_lines(blocks), strict=True):
        if fast.any():
            lines = SpectralLines.of(block)
            ratio = better.of_lines(lines)[fast].mean() / before.of_lines(lines)[fast].mean()
            if not THRESHOLDS.noise_update < ratio < 1.0 / THRESHOLDS.noise_update:
                return True
    return False


def fit_starts(
    whitened: WhitenedModel,
    starts: list[AbstractOperator],
    effects: Effects,
    spectrum: Spectrum,
    *,
    hold_effects: bool = False,
    whitener: Whitener | None = None,
) -> tuple[Refit, State]:
    """The best fit from `starts`, with `eta` held, and the effects where that is asked for.

    `whitener`: another than that of the recording for `spectrum`, such as one of more free origins.
    """
    found: list[tuple[Refit, State]] = []
    whitener = whitened.make_whitener(spectrum) if whitener is None else whitener
    for operator in starts:
        base = BaseModel.of(whitened, operator, _free(whitened, operator))
        refit = Refit(whitened, whitener, base.with_fixed("eta"))
        solved = dataclasses.replace(refit, hold_effects=hold_effects)
        start = solved.evaluate(base.prior_mean, effects)
        found.append((refit, solved.minimise(start, THRESHOLDS.base_steps)))
    return _simplest(found)


def measure_model_errors(whitened: WhitenedModel, ecdl: ECDL) -> tuple[list[np.ndarray], Spectrum]:
    """Errors of a model as it is ("periods phases" by run), and the noise spectrum in them."""
    values = BaseModel.of(whitened, ecdl.operator).prior_mean
    nodes = whitened.operator_response(ecdl.operator, values, ecdl.effects)
    unit = whitened.make_whitener(_UNIT_NOISE)
    raw = whitened.evaluate_errors(unit, ecdl.effects, nodes).raw
    return raw, background_spectrum(raw, whitened.blocks)


def _simplest(found: list[tuple[Refit, State]]) -> tuple[Refit, State]:
    """The best fit; one with values of their own for each play only where it leaves far less.

    Such plays adapt to what an effect does, and then hide it.
    """
    best = min(found, key=_cost)
    shared = [pair for pair in found if not _has_individual_plays(pair[0].base.operator)]
    if not shared or not _has_individual_plays(best[0].base.operator):
        return best
    simple = min(shared, key=_cost)
    noise = simple[1].errors.synchronous.size + simple[1].errors.nonsynchronous.size
    limit = THRESHOLDS.individual_plays_excess * (simple[1].cost - noise)
    return best if best[1].cost - noise < limit else simple


def _flexible_cost(pair: tuple[Refit, State]) -> float:
    """What the flexible base leaves that begins from a fit."""
    return refit_flexible_operator(*pair)[1].cost


def _cost(pair: tuple[Refit, State]) -> float:
    return pair[1].cost


def _has_individual_plays(operator: AbstractOperator) -> bool:
    """Whether plays have shapes of their own."""
    return any(np.ndim(getattr(operator, name)) > 0 for name in operator.tied_first)


def background_spectrum(
    errors: list[np.ndarray], blocks: list[PeriodBlock], *, of_fit: bool = False
) -> Spectrum:
    """The noise spectrum without slow changes and non-synchronous tones, which leak into it."""
    spectrum = measure_spectrum(errors, blocks, of_fit=of_fit)
    if not spectrum.measured:
        return spectrum
    detrended = detrend(errors, blocks, spectrum)
    if detrended is not errors:
        spectrum = measure_spectrum(detrended, blocks, of_fit=of_fit)
    tones = find_tones(detrended, blocks, spectrum)
    if not tones:
        return spectrum
    return measure_spectrum(remove_tones(detrended, blocks, tones), blocks, of_fit=of_fit)


def _starts(recording: Recording, ecdl: ECDL | None) -> list[AbstractOperator]:
    """Operators to start from. Plays share `lam`, `eta` and `alpha` in all but the one brought.

    With a value for each play a refit ends in one of many local minima; that freedom is the
    flexible base's, which starts from here.
    """
    if ecdl is None:
        return list(RAPI.initial_guesses(recording, count=THRESHOLDS.guesses))
    operator = ecdl.operator
    order = operator.coefficients.size
    guesses = operator.initial_guesses(
        recording,
        plays=operator.count,
        order=order,
        count=THRESHOLDS.guesses_beside_given,
    )
    return [operator, *guesses]


def with_all_free(refit: Refit) -> Refit:
    """The problem with all that these data can tell apart free."""
    whitened, operator = refit.whitened, refit.base.operator
    base = BaseModel.of(whitened, operator, _free(whitened, operator))
    return dataclasses.replace(refit, base=base)


def _free(whitened: WhitenedModel, operator: AbstractOperator) -> np.ndarray:
    """Which values may move: those that these data can tell apart, as in a fit."""
    ecdl = ECDL(operator)
    return ParameterVector.of(ecdl).mask(ecdl, default_free(ecdl, whitened.recording))
