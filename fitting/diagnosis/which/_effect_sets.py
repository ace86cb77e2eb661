"""Sets of effects: their names, and one more or less in them."""

from fitting.diagnosis.refit._effect_vector import Effects
from rapi_jax.effects import ALL, AbstractEffect


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
