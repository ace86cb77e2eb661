"""Pairs of initial guesses screened at once: what two effects explain together, in closed form.

Two effects that act alike with opposite signs, such as a lag and a lead, explain little alone and
nearly all together, so that no search of one after the other begins with either. Signatures are
linear in their sizes: of all pairs of guesses the best sizes and the fall in chi-square follow from
the Gram matrix of the signatures.
"""

import numpy as np
from jaxtyping import Bool, Float

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._thresholds import THRESHOLDS
from rapi_jax.effects import AbstractEffect

from ._base_remainder import BaseRemainder
from ._screen import InitialGuesses, effect_signature

Pair = tuple[AbstractEffect, AbstractEffect]


def screen_pairs(
    refit: Refit, state: State, flexible: FlexibleBase, guesses: InitialGuesses
) -> list[Pair]:
    """The pairs of different effects that explain most together, the best guesses of each pair.

    Those first that explain more. `flexible`: about `state`, which lacks both effects.
    """
    remainder = BaseRemainder.beyond_density(state, flexible.covariance)
    left = np.concatenate([remainder.synchronous, remainder.nonsynchronous])
    effects: list[AbstractEffect] = []
    rows: list[Float[np.ndarray, " lines"]] = []
    for effect in (guess for grid in guesses.values() for guess in grid):
        signature = effect_signature(refit, state, effect)
        if signature is None:
            continue
        row = np.concatenate([remainder.reduce(signature[0]), signature[1]])
        whole = float(signature[0] @ signature[0] + signature[1] @ signature[1])
        if row @ row > THRESHOLDS.absorbed_signature * whole:
            effects.append(effect)
            rows.append(row / np.linalg.norm(row))
    if len(rows) < 2:
        return []
    names = np.array([effect.name for effect in effects])
    falls = _joint_falls(np.stack(rows), left, names[:, None] != names[None, :])
    found: dict[frozenset[str], Pair] = {}
    for place in np.argsort(-falls, axis=None):
        first, second = divmod(int(place), len(effects))
        if falls[first, second] <= 0.0 or len(found) == THRESHOLDS.joint_pairs:
            break
        found.setdefault(
            frozenset((effects[first].name, effects[second].name)),
            (effects[first], effects[second]),
        )
    return list(found.values())


def _joint_falls(
    signatures: Float[np.ndarray, "guesses lines"],
    left: Float[np.ndarray, " lines"],
    differ: Bool[np.ndarray, "guesses guesses"],
) -> Float[np.ndarray, "guesses guesses"]:
    """By how much chi-square falls at the best sizes of each two; 0 where one would be negative.

    `signatures`: of unit length. `differ`: whether two guesses are of different effects.
    """
    cosine, alone = signatures @ signatures.T, -signatures @ left
    determinant = 1.0 - cosine**2
    apart = differ & (determinant > 1.0 - THRESHOLDS.parallel_cosine**2)
    size = (alone[:, None] - cosine * alone[None, :]) / np.where(apart, determinant, 1.0)
    both = apart & (size > 0.0) & (size.T > 0.0)
    return np.where(both, size * alone[:, None] + size.T * alone[None, :], 0.0)
