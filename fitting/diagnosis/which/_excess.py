"""Excess chi-square of a refit, and whether it is more than noise, chance and base misfit."""

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.refit._gauss_newton import State

from ._thresholds import THRESHOLDS
from .screening._base_remainder import BaseRemainder


def excess(state: State) -> float:
    """Chi-square above what noise alone would leave."""
    return (
        state.synchronous
        + state.nonsynchronous
        - state.errors.synchronous.size
        - state.errors.nonsynchronous.size
    )


def nonsynchronous_excess(state: State) -> float:
    """The same of the non-synchronous part."""
    return state.nonsynchronous - state.errors.nonsynchronous.size


def leaves_nonsynchronous(state: State) -> bool:
    """Whether more of what does not repeat is left than chance leaves of noise known exactly.

    No base, however far off, leaves such.
    """
    chance = THRESHOLDS.explained_nonsynchronous_sigmas * np.sqrt(
        2.0 * state.errors.nonsynchronous.size
    )
    return nonsynchronous_excess(state) > float(chance)


def is_unexplained(state: State) -> bool:
    """Whether more is left than noise, and than a base that is not quite the device's."""
    lines = state.errors.synchronous.size
    limit = THRESHOLDS.explained_synchronous * lines
    chance = THRESHOLDS.explained_synchronous_sigmas * np.sqrt(2.0 * lines)
    return bool(state.synchronous > limit + chance) or _exceeds_chance(state.errors.nonsynchronous)


def exceeds_chance(state: State) -> bool:
    """Whether more is left than chance leaves of measured noise."""
    lines = state.errors.synchronous.size
    chance = THRESHOLDS.pair_chance_sigmas * np.sqrt(2.0 * lines)
    return bool(state.synchronous > lines + chance) or _exceeds_chance(state.errors.nonsynchronous)


def exceeds_noise(state: State) -> bool:
    """Whether clearly more is left than noise, by a base that misfits, too."""
    lines = state.errors.synchronous.size
    chance = THRESHOLDS.pair_enough_sigmas * np.sqrt(2.0 * lines)
    return bool(state.synchronous > THRESHOLDS.pair_enough * lines + chance)


def _exceeds_chance(nonsynchronous: Float[np.ndarray, " lines"]) -> bool:
    lines = nonsynchronous.size
    limit = THRESHOLDS.explained_nonsynchronous * lines
    chance = THRESHOLDS.explained_nonsynchronous_sigmas * np.sqrt(2.0 * lines)
    return bool(lines and nonsynchronous @ nonsynchronous > limit + chance)


def is_competitive(state: State, best: State, without: State, share: float) -> bool:
    """Whether `state` is near enough to the best for more work on it.

    Its fall in chi-square from `without` must be more than `share` of the best's, and its excess
    not many times the best's.
    """
    fall, most = without.cost - state.cost, without.cost - best.cost
    least = THRESHOLDS.chance_fall / THRESHOLDS.chance_fall_divisor
    return is_rival(state, best) and fall > max(share * most, least)


def is_rival(state: State, best: State) -> bool:
    """Whether the excess of `state` is not many times that of the best, or of chance."""
    lines = best.errors.synchronous.size + best.errors.nonsynchronous.size
    chance = THRESHOLDS.leader_chance_sigmas * np.sqrt(2.0 * lines)
    return excess(state) < THRESHOLDS.leader_excess * max(excess(best), float(chance))


def reduces_nonsynchronous(state: State, without: State, share: float) -> bool:
    """Whether `state` takes away more than a share of the non-synchronous excess.

    Beside a base that is far off, effects that take away more of the whole may do so by standing in
    for the base; no operator can stand in here.
    """
    before = nonsynchronous_excess(without)
    gain = before - nonsynchronous_excess(state)
    return gain > max(share * before, THRESHOLDS.chance_fall)


def least_falls(remainder: BaseRemainder) -> tuple[float, float]:
    """What a second effect must remove beside a first, which leaves `remainder`: one or the other.

    A large share of the excess, and of what does not repeat; infinite where that is chance.
    """
    whole, nonsynchronous = remainder.excess, np.inf
    if _exceeds_chance(remainder.nonsynchronous):
        nonsynchronous = remainder.nonsynchronous_excess
    return THRESHOLDS.pair_gain * whole, THRESHOLDS.pair_gain * nonsynchronous
