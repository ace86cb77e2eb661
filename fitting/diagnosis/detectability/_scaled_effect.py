"""An effect made stronger or weaker: from where it changes nothing, along one parameter."""

import dataclasses

import numpy as np

from fitting.diagnosis.refit._effect_vector import (
    ScalarParameter,
    effect_values,
    free_parameters,
    strength_names,
    with_values,
)
from rapi_jax.effects import AbstractEffect, ResidualSummary


@dataclasses.dataclass(frozen=True, eq=False)
class ScaledEffect:
    """Effects of one kind that differ in one parameter, which says how strong they are.

    `guess`: of strength 1. `index`: of that parameter among the free ones. `onset`: its value where
    the effect is about to change the recording.
    """

    guess: AbstractEffect
    index: int
    onset: float

    @classmethod
    def along(cls, guess: AbstractEffect, summary: ResidualSummary) -> "list[ScaledEffect]":
        """Along each parameter that says how strong `guess` is; the others of these at the onset.

        In the order in which the effect declares them.
        """
        names = [str(p.path[0]) for p in free_parameters(guess)]
        places = [names.index(name) for name in strength_names(guess)]
        start, end = effect_values((type(guess).onset(summary),)), effect_values((guess,))
        out = []
        for k in places:
            values = end.copy()
            values[places] = start[places]
            values[k] = end[k]
            if np.isfinite(end[k] - start[k]) and end[k] != start[k]:
                out.append(cls(with_values((guess,), values)[0], k, float(start[k])))
        return out

    @property
    def name(self) -> str:
        """Of that parameter."""
        return str(self.parameter.path[0])

    @property
    def parameter(self) -> ScalarParameter:
        """The parameter that says how strong."""
        return free_parameters(self.guess)[self.index]

    def value(self, strength: float) -> float:
        """That parameter of an effect so strong."""
        end = float(effect_values((self.guess,))[self.index])
        return self.onset + strength * (end - self.onset)

    def at(self, strength: float) -> AbstractEffect | None:
        """The effect so strong; `None` beyond the parameter's bounds."""
        value, p = self.value(strength), self.parameter
        if not p.low <= value <= p.high:
            return None
        values = effect_values((self.guess,))
        values[self.index] = value
        return with_values((self.guess,), values)[0]
