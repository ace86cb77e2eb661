"""A candidate: a set of effects with its refits on the base and on the flexible base."""

import dataclasses

from fitting.diagnosis.refit._effect_vector import Effects, free_parameters
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import ALL, AbstractEffect


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """A set of effects refitted jointly with the base.

    - `effects`: those added to the base's own.
    - `eta_fixed`: the refit on the base with `eta` held; `on_base`: with all of the operator free.
    - `on_flexible_base`: the refit on the flexible base, which `flexible_refit` holds.
    - `on_density`: the refit with a density of plays in its place; `None` where noise is unknown.
    - `unabsorbed_fraction`: see `Screened`; of the effect added last.
    """

    effects: Effects
    eta_fixed: State
    on_base: State
    on_flexible_base: State
    flexible_refit: Refit
    unabsorbed_fraction: float
    on_density: tuple[Refit, State] | None = None

    @property
    def name(self) -> str:
        """The effects' names in alphabetical order, joined by +; `none` where there is none."""
        return hypothesis_name(self.effects)

    @property
    def count(self) -> int:
        """Number of parameters added."""
        return sum(len(free_parameters(effect)) for effect in self.effects)

    @property
    def least(self) -> tuple[Refit, State]:
        """The refit on the flexible base or on a density of plays, whichever leaves less."""
        search = self.flexible_refit, self.on_flexible_base
        density = self.on_density
        return density if density is not None and density[1].cost < search[1].cost else search

    @property
    def cost(self) -> float:
        """Chi-square on the flexible base, by search or in closed form."""
        return self.least[1].cost


def hypothesis_name(effects: Effects) -> str:
    """The name of a set of effects, as in reports."""
    return "+".join(sorted(effect.name for effect in effects)) or "none"


def mechanism_name(effects: Effects) -> str:
    """The mechanisms of a set of effects, as `hypothesis_name` has their equations."""
    return "+".join(sorted({type(effect).mechanism for effect in effects})) or "none"


def insert_effect(effects: Effects, one: AbstractEffect) -> Effects:
    """`effects` and one more, in the order of `effects.ALL`; a class not listed there comes last.

    The order is that in which effects act: an etalon fixed in frequency acts on the optical
    frequency that drift and current have changed, not the reverse.
    """
    rank = {cls: k for k, cls in enumerate(ALL)}
    own = rank.get(type(one), len(ALL))
    at = next((k for k, e in enumerate(effects) if rank.get(type(e), -1) > own), len(effects))
    return (*effects[:at], one, *effects[at:])


def added_effects(effects: Effects, to: Effects) -> Effects:
    """Those of `effects` that are not among those it was added `to`."""
    names = {effect.name for effect in to}
    return tuple(effect for effect in effects if effect.name not in names)
