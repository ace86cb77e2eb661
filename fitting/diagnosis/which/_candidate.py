"""A candidate: a set of effects with its refits on the base and on the flexible base."""

import dataclasses
from functools import cached_property

from fitting.diagnosis.refit._effect_vector import Effects, free_parameters
from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._effect_sets import hypothesis_name
from .refits._flexible_refit import refit_flexible_operator


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """A set of effects refitted jointly with the base.

    - `effects`: those added to the base's own.
    - `on_base`: the refit with all of the operator free, and `refit` the problem that it solves;
      `eta_fixed`: with `eta` held, where there was one, else the same.
    - `on_flexible_base`: the refit on the flexible base, which `flexible_refit` holds: on a density
      of plays, or on one that was searched where noise is unknown.
    - `unabsorbed_fraction`: see `Screened`; of the effect added last.
    - `has_other_form`: whether `on_flexible_base` has another form of the effect's mechanism, whose
      functions explain what its equation leaves.
    """

    effects: Effects
    eta_fixed: State
    refit: Refit
    on_base: State
    flexible_refit: Refit
    on_flexible_base: State
    unabsorbed_fraction: float
    has_other_form: bool = False

    @property
    def name(self) -> str:
        """The effects' names in alphabetical order, joined by +; `none` where there is none."""
        return hypothesis_name(self.effects)

    @property
    def count(self) -> int:
        """Number of parameters added."""
        return sum(len(free_parameters(effect)) for effect in self.effects)

    @property
    def cost(self) -> float:
        """Chi-square on the flexible base."""
        return self.on_flexible_base.cost

    @cached_property
    def on_flexible_operator(self) -> tuple[Refit, State]:
        """The refit on a flexible operator, which predicts as a density of plays does not.

        The flexible base itself where it was searched.
        """
        if not self.refit.whitener.spectrum.measured:
            return self.flexible_refit, self.on_flexible_base
        found = self.on_flexible_base.effects
        return refit_flexible_operator(self.refit, self.on_base, found, search=False)
