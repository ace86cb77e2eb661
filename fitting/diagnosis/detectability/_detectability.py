"""For each effect that is not named, the smallest size that this recording would have shown."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.diagnosis.refit._effect_vector import effect_values, free_parameters, strength_names
from fitting.diagnosis.refit._gauss_newton import SearchRanges
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._excess import excess
from fitting.diagnosis.which.evidence._calibration import load_calibration
from fitting.diagnosis.which.screening._screen import (
    effect_signature,
    search_ranges,
    summarise_residual,
)
from rapi_jax.effects import AbstractEffect, AbstractLawEffect

from ._power import Demand
from ._scaled_effect import ScaledEffect
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class SmallestSize:
    """The smallest value of one parameter of an effect that is named with a probability of 95 %.

    `value`: in `unit`; `None` where no size shows. `others`: the parameters that say of what kind
    the effect is, which the value is for. For an effect that only limits the drive, the value is
    the largest limit that shows.
    """

    effect: str
    parameter: str
    value: float | None
    unit: str
    others: dict[str, dict[str, Any]]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, for a file."""
        return dataclasses.asdict(self) | {"level": THRESHOLDS.level}


def smallest_sizes(
    top: Candidate, classes: Sequence[type[AbstractEffect]], explained: float = 0.0
) -> list[SmallestSize]:
    """Of each class that is not among the effects of `top`, the likeliest hypothesis.

    `explained`: the chi-square that these take away, of which a share is not credited to another.
    Without measured noise nothing can be promised: no value.
    """
    named = {effect.name for effect in top.on_base.effects}
    search = SizeSearch(top, explained)
    return [search.of(cls) for cls in classes if cls.name not in named]


class SizeSearch:
    """The search beside one hypothesis, less what the flexible base would absorb."""

    def __init__(self, top: Candidate, explained: float = 0.0) -> None:
        refit, state = top.flexible_refit, top.on_flexible_base
        whitened, spectrum = refit.whitened, refit.whitener.spectrum
        self.top, self.refit, self.state, self.explained = top, refit, state, explained
        self.possible = spectrum.measured and np.isfinite(state.cost)
        self.summary = summarise_residual(whitened, state, float(np.sqrt(spectrum.total)))
        recording = whitened.recording
        self.units = {"x": recording.response_unit, "u": recording.drive_unit}

    def of(self, cls: type[AbstractEffect]) -> SmallestSize:
        """The median over kinds of the effect, as its first guesses have them."""
        guesses = list(cls.initial_guesses(self.summary))
        every = max(len(guesses) // THRESHOLDS.guesses, 1)
        rays = [ray for g in guesses[::every] for ray in ScaledEffect.along(g, self.summary)]
        looked = [(ray, self._first_strength(ray)) for ray in rays]
        seen = {ray.name for ray, strength in looked if np.isfinite(strength)}
        first = next((name for name in strength_names(cls.at()) if name in seen), None)
        if first is None:
            p = next(
                p for p in free_parameters(cls.at()) if p.path[0] == strength_names(cls.at())[0]
            )
            return SmallestSize(cls.name, str(p.path[0]), None, p.unit.format(**self.units), {})
        same = sorted((pair for pair in looked if pair[0].name == first), key=_distance)
        ray, strength = same[(len(same) - 1) // 2]
        return self._reported(ray, self._refined(ray, strength), search_ranges(guesses))

    def _share(self, ray: ScaledEffect, strength: float) -> float:
        """Of what is demanded; 0 where the effect cannot be so strong, or changes nothing."""
        effect = ray.at(strength)
        if not self.possible or effect is None:
            return 0.0
        signature = effect_signature(self.refit, self.state, effect)
        if signature is None:
            return 0.0
        synchronous, nonsynchronous = signature
        errors = self.state.errors
        demand = Demand.of(
            (self.state.synchronous, self.state.nonsynchronous),
            (errors.synchronous.size, errors.nonsynchronous.size),
            load_calibration(),
            parameters=len(free_parameters(effect)),
            explained=self.explained if self.top.effects else None,
            by_density=excess(self.top.on_base) - excess(self.state),
            law=isinstance(effect, AbstractLawEffect),
        )
        left = float(synchronous @ synchronous)  # a density of plays has taken away its part
        return demand.share(left, float(nonsynchronous @ nonsynchronous))

    def _first_strength(self, ray: ScaledEffect) -> float:
        """The strength looked for, were chi-square as its square; infinite where none shows."""
        share = self._share(ray, 1.0)
        return 1.0 / np.sqrt(share) if share > 0 else np.inf

    def _refined(self, ray: ScaledEffect, strength: float) -> float:
        """By secants of the logarithms; `nan` where it leaves the parameter's bounds."""
        at, low = np.log(strength), 0.0
        last, share_last = low, self._share(ray, 1.0)
        for _ in range(THRESHOLDS.rounds):
            share = self._share(ray, float(np.exp(at)))
            if not share > 0:
                return float("nan")
            if abs(np.log(share)) < THRESHOLDS.accuracy:
                break
            run = at - last
            slope = np.log(share / share_last) / run if abs(run) > 1e-6 else 2.0
            slope = float(np.clip(slope, *THRESHOLDS.slopes)) if np.isfinite(slope) else 2.0
            last, share_last = at, share
            at -= np.log(share) / slope
        return float(np.exp(at))

    def _reported(self, ray: ScaledEffect, strength: float, ranges: SearchRanges) -> SmallestSize:
        guess, p = ray.guess, ray.parameter
        inside = strength < THRESHOLDS.strongest and ray.at(strength) is not None
        pairs = zip(free_parameters(guess), effect_values((guess,)), strict=True)
        others = {
            str(q.path[0]): {"value": float(value), "unit": q.unit.format(**self.units)}
            for q, value in pairs
            if q.path[0] not in strength_names(guess) and np.isfinite(value)
        }
        value = ray.value(strength) if inside else None
        low, high = ranges.get((guess.name, p.path), (-np.inf, np.inf))
        if value is not None:  # no smaller one is looked for
            value = float(np.clip(value, low, high))
            value = abs(value) if ray.onset == 0 else value  # either sign shows alike
        return SmallestSize(guess.name, ray.name, value, p.unit.format(**self.units), others)


def _distance(pair: tuple[ScaledEffect, float]) -> float:
    """How far the value looked for lies from the onset."""
    ray, strength = pair
    return abs(ray.value(strength) - ray.onset) if np.isfinite(strength) else np.inf
