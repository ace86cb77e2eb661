"""Effects drawn and brought to the size asked for."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fitting.blind.simulator._signal_path import ORDER, Effect

from ._projected_size import solve_strength
from ._recipe import Recipe, Setting

TRIES = 5  # draws of an effect's other parameters, where its strength alone does not reach
NEAR = 0.05  # of the size asked for

Maker = Callable[[np.random.Generator, Setting], Recipe]
Size = Callable[[tuple[Effect, ...]], float]


@dataclass(frozen=True, eq=False)
class ScaledEffects:
    """Effects with their parameters and their projected size together, in GHz."""

    effects: tuple[Effect, ...]
    parameters: dict[str, dict[str, Any]]
    size: float
    single_sizes: tuple[float, ...]  # GHz, of each effect by itself


def scale_to_size(
    rng: np.random.Generator, made: Sequence[Maker], setting: Setting, size: Size
) -> ScaledEffects:
    """All effects of a device, together of the size asked for as nearly as they can be.

    Each of two is solved alone for its share (of equal order, in quadrature), then both once more
    for shares corrected by what they came to together.
    """
    if len(made) == 1:
        return _scale_one(rng, made[0], setting, size)
    angle = float(rng.uniform(0.5, 1.07))
    shares = (np.cos(angle), np.sin(angle))
    recipes = [
        _reach_target(rng, maker, replace(setting, target=float(share) * setting.target), size)
        for maker, share in zip(made, shares, strict=True)
    ]
    both = _combine(recipes, size)
    for _ in range(2):
        if abs(both.size / setting.target - 1) < NEAR:
            break
        factor = setting.target / both.size
        recipes = [
            (r, *solve_strength(lambda x, r=r: size((r.build(x),)), found * factor, r.low, r.high))
            for r, _, found in recipes
        ]
        again = _combine(recipes, size)
        if abs(np.log(again.size / setting.target)) < abs(np.log(both.size / setting.target)):
            both = again
    return both


def _scale_one(
    rng: np.random.Generator, maker: Maker, setting: Setting, size: Size
) -> ScaledEffects:
    recipe, strength, found = _reach_target(rng, maker, setting, size)
    return ScaledEffects(
        (recipe.build(strength),), {recipe.name: recipe.settings(strength)}, found, (found,)
    )


def _reach_target(
    rng: np.random.Generator, maker: Maker, setting: Setting, size: Size
) -> tuple[Recipe, float, float]:
    """A recipe, its strength and its size: the first draw near the target, or else the nearest."""
    best: tuple[float, Recipe, float, float] | None = None
    for _ in range(TRIES):
        recipe = maker(rng, setting)
        strength, found = solve_strength(
            lambda x, r=recipe: size((r.build(x),)), setting.target, recipe.low, recipe.high
        )
        off = abs(float(np.log(max(found, 1e-12) / setting.target)))
        if best is None or off < best[0]:
            best = (off, recipe, strength, found)
        if off < NEAR or not recipe.parameters:
            break
    assert best is not None  # noqa: S101
    return best[1:]


def _combine(recipes: Sequence[tuple[Recipe, float, float]], size: Size) -> ScaledEffects:
    """The effects of several recipes in the order of the light path, alphabetical before it."""
    place = {name: k for k, name in enumerate(ORDER)}
    ordered = sorted(recipes, key=lambda found: (place.get(found[0].name, -1), found[0].name))
    effects = tuple(recipe.build(strength) for recipe, strength, _ in ordered)
    parameters = {recipe.name: recipe.settings(strength) for recipe, strength, _ in ordered}
    return ScaledEffects(
        effects, parameters, size(effects), tuple(size((effect,)) for effect in effects)
    )
