"""Effects selected beside the noise that they leave, where they explain part of what counted as it.

Noise is read off what does not repeat with the scan. So does not a jump whose instants differ from
period to period, or a slow change; what it does counts as noise until it is explained, and beside
too much noise other effects are not seen.
"""

import dataclasses

import numpy as np

from fitting.diagnosis.noise._lines import SpectralLines
from fitting.diagnosis.noise._spectrum import Spectrum, noise_lines

from ._base import FittedBase, background_spectrum
from ._candidate import Candidate
from ._effect_search import Progress
from ._forward_selection import Attribution, Classes, select_effects
from ._thresholds import THRESHOLDS

_READINGS = 2  # beside too much noise a reading may stay on the wrong side of a jump


def select_with_refined_noise(
    fitted: FittedBase, candidates: Classes, progress: Progress
) -> tuple[FittedBase, Attribution]:
    """Effects selected, and again while noise is less beside them; with the base they stand on."""
    attribution = select_effects(fitted, candidates, progress)
    for _ in range(_READINGS):
        refined = with_refined_noise(fitted, attribution.best)
        if refined is None:
            break
        progress("less noise beside what was found")
        fitted, attribution = refined, select_effects(refined, candidates, progress)
    return fitted, attribution


def with_refined_noise(fitted: FittedBase, best: Candidate) -> FittedBase | None:
    """The base refitted with the noise that `best` leaves; `None` where that is about the same."""
    if not fitted.spectrum.measured or not best.effects:
        return None
    whitened = fitted.refit.whitened
    spectrum = background_spectrum(best.on_base.errors.raw, whitened.blocks, of_fit=True)
    if not _ratio(fitted, spectrum) < THRESHOLDS.noise_left:
        return None
    whitener = whitened.make_whitener(spectrum)
    eta_fixed, refit = (
        dataclasses.replace(one, whitener=whitener) for one in (fitted.eta_fixed[0], fitted.refit)
    )
    effects = fitted.state.effects
    held = eta_fixed.minimise(
        eta_fixed.evaluate(fitted.eta_fixed[1].values, effects), THRESHOLDS.base_steps
    )
    state = refit.minimise(refit.evaluate(fitted.state.values, effects), THRESHOLDS.base_steps)
    return dataclasses.replace(
        fitted, refit=refit, state=state, eta_fixed=(eta_fixed, held), spectrum=spectrum
    )


def _ratio(fitted: FittedBase, spectrum: Spectrum) -> float:
    """Of the noise in `spectrum` to that before, a line from which it is read."""
    logs = []
    for block in fitted.refit.whitened.blocks:
        if block.periods > 1:
            lines = SpectralLines.of(block)
            pick = noise_lines(lines)
            before, after = (s.of_lines(lines)[pick] for s in (fitted.spectrum, spectrum))
            logs.append(np.log(after / before))
    every = np.concatenate([*logs, np.zeros(0)])
    return float(np.exp(every.mean())) if every.size else 1.0
