"""Sets of effects: their names, and one more or less in them."""

from fitting.diagnosis.refit._effect_vector import Effects
from rapi_jax.effects import ALL, AbstractDriveEffect, AbstractEffect


def hypothesis_name(effects: Effects) -> str:
    """The name of a set of effects, as in reports."""
    return "+".join(sorted(effect.name for effect in effects)) or "none"


def mechanism_name(effects: Effects) -> str:
    """The mechanisms of a set of effects, as `hypothesis_name` has their equations."""
    return "+".join(sorted({type(effect).mechanism for effect in effects})) or "none"


def insert_effect(effects: Effects, one: AbstractEffect, *, other_order: bool = False) -> Effects:
    """`effects` and one more, in the order of `effects.ALL`; a class not listed there comes last.

    The order is that in which effects act: an etalon fixed in frequency acts on the optical
    frequency that drift and current have changed, not the reverse. `other_order`: of those that
    change the drive, the one more is put at the other end.
    """
    rank = {cls: k for k, cls in enumerate(ALL)}
    own = rank.get(type(one), len(ALL))
    at = next((k for k, e in enumerate(effects) if rank.get(type(e), -1) > own), len(effects))
    if other_order and has_orders(effects, one):
        places = [k for k, e in enumerate(effects) if acts_on_drive(e)]
        at = places[-1] + 1 if at <= places[-1] else places[0]
    return (*effects[:at], one, *effects[at:])


def has_orders(effects: Effects, one: AbstractEffect) -> bool:
    """Whether it may come first or last: a drive is rounded or cut off before a lag, or behind it.

    Of effects behind the operator the order is that of the light's path.
    """
    return acts_on_drive(one) and any(map(acts_on_drive, effects))


def acts_on_drive(effect: AbstractEffect) -> bool:
    """Whether an effect changes the drive that reaches the operator."""
    return isinstance(effect, AbstractDriveEffect)


def added_effects(effects: Effects, to: Effects) -> Effects:
    """Those of `effects` that are not among those it was added `to`."""
    names = {effect.name for effect in to}
    return tuple(effect for effect in effects if effect.name not in names)
