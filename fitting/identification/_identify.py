"""`identify`: a model from a recording alone, in one call."""

import dataclasses
from collections.abc import Sequence

from rapi_jax import RAPI, AbstractOperator, Recording
from rapi_jax.internal import takes

from ._model_order import ORDERS, PLAYS, choose_order
from ._options import Progress
from ._result import FitResult, UntrustedFit
from .assessment._threshold_law import suggest_law
from .data_checks._data_checks import check_usable
from .data_checks._thinning import thin, turns_densely

_DENSE = (
    "noisy drive: it turns every few samples; import it again with `--drive-as fitted`, or "
    "`averaged` where it is neither a triangle nor a sine. Each step of a fit takes long with such "
    "a drive, so that only the model whose parameters all plays share was fitted, none with a "
    "`lam` for each play. Where the drive is right as it is, give `--each lam`."
)


@takes(recording=Recording)
def identify(
    recording: Recording,
    *,
    plays: int = 10,
    order: int = 3,
    each: tuple[str, ...] | None = None,
    choose: bool = False,
    operator: type[AbstractOperator] = RAPI,
    weights: str | Sequence[float] = "hysteresis",
    loss: str = "squares",
    starts: int = 6,
    history: bool = True,
    drift: bool | None = None,
    hold_out: bool | tuple[str, ...] = True,
    max_steps: int = 120,
    throw: bool = True,
    progress: Progress | None = None,
) -> FitResult:
    """Identify a model from `recording`, by default an RA-PI.

    Steps: check the data; for each structure of model a first guess and a `fit` (starts,
    refinement, standard errors, cross-validation, faults, verdict); choose the structure on
    held-out data; where it leaves more than noise, note an operator whose thresholds follow the
    amplitudes clearly better.

    **Arguments:**

    - `plays`, `order`: N1 and N2.
    - `each`: what has a value for each play; by default both a shared `lam` and one for each play
      are fitted, and held-out data choose; for more than 10 000 samples of a noisy
      drive (one that turns every few samples) only the shared one is fitted.
    - `choose`: choose among several `plays` and `order` too.
    - `operator`: the class to fit; one of your own needs `initial_guesses`.
    - `throw`: raise `UntrustedFit` where the fit is not to be trusted.

    The other arguments are those of `fit`.

    >>> from fitting import identify
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = identify(recording, each=(), starts=2, hold_out=False)  # quick, and not careful
    >>> result.verdict.trusted, result.rmse < 0.025  # GHz: the noise is 0.02
    (True, True)
    """
    check_usable(recording)
    dense = each is None and "lam" in operator.tied_first and turns_densely(recording)
    given, (recording, note) = recording, thin(recording)
    structures = ((), ("lam",)) if "lam" in operator.tied_first and not dense else ((),)
    notes = [one for one in (note, _DENSE if dense else None) if one is not None]
    for said in notes:
        if progress is not None:
            progress(said)
    choices = choose_order(
        recording,
        plays=PLAYS if choose else (plays,),
        order=ORDERS if choose else (order,),
        each=structures if each is None else (each,),
        operator=operator,
        weights=weights,
        loss=loss,
        starts=starts,
        history=history,
        drift=drift,
        hold_out=hold_out,
        max_steps=max_steps,
        progress=progress,
    )
    result = choices[0].result
    for said in notes:
        result = result.noting(said, given)
    law = suggest_law(result, weights, history=history, drift=drift, max_steps=max_steps)
    if law is not None:
        verdict = dataclasses.replace(result.verdict, notes=(*result.verdict.notes, law))
        result = dataclasses.replace(result, verdict=verdict)
    if throw and not result.verdict.trusted:
        raise UntrustedFit(result)
    return result
