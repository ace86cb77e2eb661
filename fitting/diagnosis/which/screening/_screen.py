"""Screening of initial guesses by score statistics, less what a base can take up."""

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.refit._effect_vector import Effects, effect_values, free_parameters
from fitting.diagnosis.refit._gauss_newton import Refit, SearchRanges, State
from fitting.diagnosis.refit._linear_effects import linear_path
from fitting.diagnosis.refit._whitened_model import WhitenedModel, acts_before_operator
from fitting.diagnosis.which._effect_sets import acts_on_drive, has_orders, insert_effect
from fitting.diagnosis.which._thresholds import THRESHOLDS
from rapi_jax.effects import AbstractEffect, ResidualSummary
from rapi_jax.internal import LinearPath

from ._base_remainder import BaseRemainder

InitialGuesses = dict[str, list[AbstractEffect]]  # by name of the effect


@dataclasses.dataclass(frozen=True, eq=False)
class Screened:
    """One initial guess: its signature against the residual, beside what a base can absorb.

    - `score`: the score statistic, by how much chi-square would fall at the guess's best size, with
      the base's Jacobian projected out; `flexible_score`: the same of what the flexible base
      leaves, less what that takes up.
    - `nonsynchronous_score`: `flexible_score` of what does not repeat alone.
    - `expected_score`: `flexible_score` as it would be, were all of `score` this effect's doing.
    - `unabsorbed_fraction`: length of what the flexible base cannot absorb, over the whole
      signature's.
    - `cost`: chi-square with the guess as it stands, the base's Jacobian projected out.
    - `direction`: the signature beyond the base's Jacobian, of unit length.
    - `refined`: whether it was refitted with the flexible base integrated out.
    - `other_order`: see `insert_effect`.
    """

    effect: AbstractEffect
    score: float
    flexible_score: float
    expected_score: float
    unabsorbed_fraction: float
    cost: float
    direction: np.ndarray
    refined: bool = False
    nonsynchronous_score: float = 0.0
    other_order: bool = False

    def beside(self, effects: Effects) -> Effects:
        """The guess among other effects, in its order."""
        return insert_effect(effects, self.effect, other_order=self.other_order)

    def is_parallel(self, other: "Screened") -> bool:
        """Whether the two signatures are parallel, so that refits from both end alike."""
        return abs(float(self.direction @ other.direction)) > THRESHOLDS.parallel_cosine


def initial_guesses(
    refit: Refit, state: State, classes: Sequence[type[AbstractEffect]]
) -> InitialGuesses:
    """Where a refit with each class may start, by what `state` leaves."""
    summary = _summary_of(refit, state)
    return {cls.name: list(cls.initial_guesses(summary)) for cls in classes}


def _summary_of(refit: Refit, state: State) -> ResidualSummary:
    return summarise_residual(refit.whitened, state, float(np.sqrt(refit.whitener.spectrum.total)))


def summarise_residual(whitened: WhitenedModel, state: State, noise: float) -> ResidualSummary:
    """What effects choose their initial guesses by: all samples, one after the other."""
    blocks = whitened.blocks
    flat = [
        np.concatenate([part.ravel() for part in parts])
        for parts in (
            [b.time for b in blocks],
            [b.drive for b in blocks],
            [e + b.data for e, b in zip(state.errors.raw, blocks, strict=True)],
            [-e for e in state.errors.raw],
            [np.full(b.left.shape, k) for k, b in enumerate(blocks)],
        )
    ]
    drives = whitened.recording.drives
    return ResidualSummary(
        *flat,
        rates=tuple(d.rate for d in drives),
        u_pp=tuple(d.u_pp for d in drives),
        step_s=min(d.step_s for d in drives),
        noise=noise,
        span=float(np.ptp(flat[2])),
        places=_places(whitened, state.effects, flat[1]),
    )


def _places(
    whitened: WhitenedModel, effects: Effects, sent: Float[np.ndarray, " samples"]
) -> tuple[tuple[Float[np.ndarray, " samples"], LinearPath | None], ...]:
    """Before all of `effects`, and behind those that act on the drive: see `ResidualSummary`."""
    behind = tuple(e for e in effects if not acts_before_operator(e))
    on_drive = tuple(filter(acts_on_drive, effects))
    first = (sent, linear_path((*on_drive, *behind), whitened.blocks))
    rows = whitened.reached_rows(on_drive)
    if rows is None:
        return (first,)
    reached = [b.interpolate(row).ravel() for b, row in zip(whitened.blocks, rows, strict=False)]
    return first, (np.concatenate(reached), linear_path(behind, whitened.blocks))


def search_ranges(guesses: Iterable[AbstractEffect]) -> SearchRanges:
    """How far the parameters of an effect may go: a little beyond the range of its guesses.

    Only for positive parameters over which the guesses spread; those that may be zero may always
    go there.
    """
    found: dict[tuple[str, tuple[str | int, ...]], list[float]] = {}
    bounds: dict[tuple[str, tuple[str | int, ...]], tuple[float, float]] = {}
    for guess in guesses:
        for p, value in zip(free_parameters(guess), effect_values((guess,)), strict=True):
            found.setdefault((guess.name, p.path), []).append(float(value))
            bounds[guess.name, p.path] = (p.low, p.high)
    margin, spread = THRESHOLDS.search_margin, THRESHOLDS.search_spread
    out: SearchRanges = {}
    for key, values in found.items():
        least, most = min(values), max(values)
        low, high = bounds[key]
        if least > 0 and np.isfinite(most) and most > spread * least and low >= 0:
            out[key] = (max(least / margin, low) if low > 0 else 0.0, min(margin * most, high))
    return out


def own_search_ranges(
    refit: Refit, state: State, classes: Sequence[type[AbstractEffect]]
) -> SearchRanges:
    """Those that effects state themselves, for this recording."""
    summary = _summary_of(refit, state)
    return {
        (cls.name, (name,)): limits
        for cls in classes
        for name, limits in cls.search_ranges(summary).items()
    }


def screen_effect(
    refit: Refit,
    state: State,
    guesses: Iterable[AbstractEffect],
    basis: np.ndarray,
    flexible: BaseRemainder,
) -> list[Screened]:
    """Every guess beside the state, the largest score first; in each order that matters.

    `basis`: see `orthonormal_basis`, of the base. `flexible`: what the flexible base leaves.
    """
    screened = [
        _screen(refit, state, guess, basis, flexible, other_order=other_order)
        for guess in guesses
        for other_order in ((False, True) if has_orders(state.effects, guess) else (False,))
    ]
    return sorted((one for one in screened if one is not None), key=lambda one: -one.score)


def effect_signature(
    refit: Refit, state: State, effect: AbstractEffect, *, other_order: bool = False
) -> tuple[np.ndarray, np.ndarray] | None:
    """What an effect beside the state changes of synchronous and of non-synchronous errors.

    `None` where it changes nothing, or its response is not finite. `other_order`: see
    `insert_effect`.
    """
    whitened = refit.whitened
    effects = insert_effect(state.effects, effect, other_order=other_order)
    nodes = (
        whitened.operator_response(refit.base.operator, state.values, effects)
        if acts_before_operator(effect)
        else state.operator_response
    )
    errors = whitened.evaluate_errors(refit.whitener, effects, nodes)
    s = errors.synchronous - state.errors.synchronous
    t = errors.nonsynchronous - state.errors.nonsynchronous
    whole = float(s @ s + t @ t)
    return (s, t) if np.isfinite(whole) and whole > 0 else None


def _screen(
    refit: Refit,
    state: State,
    guess: AbstractEffect,
    basis: np.ndarray,
    flexible: BaseRemainder,
    *,
    other_order: bool = False,
) -> Screened | None:
    """One guess; `None` where it changes nothing, or its response is not finite."""
    signature = effect_signature(refit, state, guess, other_order=other_order)
    if signature is None:
        return None
    s, t = signature
    whole = float(s @ s + t @ t)
    changed, others = state.errors.synchronous + s, state.errors.nonsynchronous + t
    along = basis.T @ changed
    cost = float(changed @ changed - along @ along + others @ others)
    beyond = s - basis @ (basis.T @ s)
    left = state.errors.synchronous, state.errors.nonsynchronous
    score, square = _score(beyond, t, left, whole)
    left = flexible.synchronous, flexible.nonsynchronous
    flexible_score, unabsorbed = _score(flexible.reduce(s), t, left, whole)
    loose, _ = _score(s[:0], t, (s[:0], flexible.nonsynchronous), float(t @ t))
    expected = score * unabsorbed / square if square > 0 else 0.0
    direction = np.concatenate([beyond, t]).astype(np.float32)
    direction /= max(float(np.linalg.norm(direction)), 1e-30)
    fraction = float(np.sqrt(unabsorbed / whole))
    return Screened(
        guess,
        score,
        flexible_score,
        expected,
        fraction,
        cost,
        direction,
        nonsynchronous_score=loose,
        other_order=other_order,
    )


def _score(
    synchronous: np.ndarray,
    nonsynchronous: np.ndarray,
    left: tuple[np.ndarray, np.ndarray],
    whole: float,
) -> tuple[float, float]:
    """The score statistic of a signature less what a base absorbs, and that remainder's square.

    `left`: what the base leaves. `whole`: the square of the whole signature. A signature that
    points away from what is left would need the opposite sign, which its effect has not: its score
    is 0.
    """
    square = float(synchronous @ synchronous + nonsynchronous @ nonsynchronous)
    inner = -float(synchronous @ left[0] + nonsynchronous @ left[1])
    if square <= THRESHOLDS.absorbed_signature * whole or inner <= 0:
        return 0.0, square
    return inner**2 / square, square
