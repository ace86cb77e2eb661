"""Joint refits of one more effect: from its best trials, first on the operator itself, then on the
richer base, where only what no hysteresis could do counts.
"""

import dataclasses

import numpy as np
from scipy.optimize import minimize

from fitting.diagnosis.refit._effect_vector import (
    Effects,
    effect_values,
    free_parameters,
    with_values,
)
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax import RAPI, parameters
from rapi_jax.effects import ALL, AbstractEffect

from ._flexible_base import flexible_base
from ._jump_segmentation import refit_at_segmented_jumps
from ._screen import Screened

_FIRST, _REST = 4, 40  # steps of the first look, and of the best one afterwards
_FREE = 20  # steps once `eta` is let go
_ROUNDS = 3  # of search and descent, for effects that jump
_SETTLED = 1e-3  # of chi-square: another round that takes away less is the last
_LOOKS = 3  # trials that are refitted
_SIMPLEX = (5e-4, 5e-5)  # of a parameter's size: how wide a simplex begins
_LOOKED = 30  # evaluations of a simplex for each parameter
_HOPE = 0.7  # of the excess without the effect: what leaves more needs no edge so exactly
_FAINT = 0.02  # of the weights: what is left where hysteresis is to begin from nothing
_RICH_STEPS = 20
_RICH_SETTLED = 0.03  # of chi-square: another round on the richer base that takes away less is last
_RICH_SHARE = 2e-3  # of the excess: a slower descent on the richer base is over


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """A set of effects beside the base: refitted on the operator, and on the richer base.

    `effects` are those added to the base's own. `stiff`: with `eta`
    held; `plain`: with all of the operator free.
    `survival`: see `Screened`; of the effect added last.
    """

    effects: Effects
    eta_fixed: State
    plain: State
    rich: State
    flexible_refit: Refit
    survival: float

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
        """Chi-square on the richer base."""
        return self.rich.cost


def hypothesis_name(effects: Effects) -> str:
    """The name of a set of effects, as in reports."""
    return "+".join(sorted(effect.name for effect in effects)) or "none"


def insert_effect(effects: Effects, one: AbstractEffect) -> Effects:
    """`effects` and one more, where light and signal meet it; one that is not ours comes last.

    An etalon fixed in frequency sees what drift and current have made of it, not the reverse.
    """
    place = {cls: k for k, cls in enumerate(ALL)}
    mine = place.get(type(one), len(ALL))
    at = next((k for k, e in enumerate(effects) if place.get(type(e), -1) > mine), len(effects))
    return (*effects[:at], one, *effects[at:])


def added_effects(effects: Effects, to: Effects) -> Effects:
    """Those of `effects` that are not among those it was added `to`."""
    names = {effect.name for effect in to}
    return tuple(effect for effect in effects if effect.name not in names)


def short_refit(refit: Refit, state: State, screened: list[Screened]) -> State | None:
    """The best of a few steps from each of an effect's most promising trials."""
    return _looked(refit, state, screened, _FIRST)


def full_refit(refit: Refit, look: State, without: float) -> State:
    """The joint refit of the operator with one more effect, from a first look.

    `without`: chi-square without the effect.
    """
    return _finished(refit, refit, look, without)


def free_eta(refit: Refit, eta_fixed: State) -> State:
    """What a refit with all of the operator free makes of one with `eta` held."""
    return refit.minimise(eta_fixed, _FREE)


def refit_from_no_hysteresis(
    refit: Refit, straight: tuple[Refit, State], screened: list[Screened]
) -> State | None:
    """A joint refit that begins without hysteresis: the effect first, then all together.

    At one rate a lag and a loop look alike, and a fit that begins with the loop keeps it.
    """
    bent, state = straight
    look = _looked(bent, state, screened, 3 * _FIRST)
    if look is None:
        return None
    return refit.minimise(_finished(bent, refit, look, state.cost), _REST)


def _looked(refit: Refit, state: State, screened: list[Screened], steps: int) -> State | None:
    ends = []
    for one in _different(screened):
        start = refit.evaluate(state.values, insert_effect(state.effects, one.effect))
        if not np.isfinite(start.cost):
            continue
        if not type(one.effect).smooth:  # what was found on a grid is good, the base beside it not
            start = _beside(refit, start, 3 * _FIRST)
        ends.append(refit.minimise(start, steps))
    if not ends:
        return None
    # Beside a base that is far off, its misfit is noise of that size: what does not repeat counts.
    wide = max(1.0, min(end.synchronous / _lines(end) for end in ends))
    return min(ends, key=lambda end: end.cost + (1.0 / wide - 1.0) * end.synchronous)


def _finished(search: Refit, refit: Refit, look: State, without: float) -> State:
    smooth = all(type(effect).smooth for effect in look.effects)
    for _ in range(1 if smooth else _ROUNDS):
        before = look.cost
        if not smooth:
            look = _searched(search, look, without)
        look = _settled(refit, look, _REST)
        if before - look.cost < _SETTLED * before:
            break
    return look


def _settled(refit: Refit, state: State, steps: int, share: float = 1e-4) -> State:
    """A descent; beside an effect that jumps first of the base and the jump's size alone.

    Slopes of where it jumps mean little, and would hold the base back.
    """
    if not all(type(effect).smooth for effect in state.effects):
        state = _beside(refit, state, steps, share)
    return refit.minimise(state, steps, share)


def _beside(refit: Refit, state: State, steps: int, share: float = 1e-4) -> State:
    """The base beside what jumps, from where it stands and from where the data have the jumps."""
    still = dataclasses.replace(refit, freeze_jumps=True)
    ends = [still.minimise(state, steps, share)]
    other = refit_at_segmented_jumps(still, state, steps, share)
    if other is not None and np.isfinite(other.cost):
        ends.append(still.minimise(other, steps, share))
    return min(ends, key=lambda end: end.cost)


def refit_without_hysteresis(refit: Refit, state: State) -> tuple[Refit, State] | None:
    """The operator with next to no hysteresis, only its polynomial free; `None` for no `RAPI`."""
    base, at = refit.base, 0
    operator = base.operator
    if not isinstance(operator, RAPI):
        return None
    values, free = state.values.copy(), np.zeros(state.values.size, dtype=bool)
    for p in parameters(operator):
        part = slice(at, at + p.size)
        if p.name == "a":
            values[part] *= _FAINT
        free[part] = p.linear
        at += p.size
    bent = dataclasses.replace(refit, base=dataclasses.replace(base, free=free & base.free))
    return bent, bent.minimise(bent.evaluate(values, state.effects), 4)


def _different(screened: list[Screened]) -> list[Screened]:
    """The best few by what the operator leaves, the best by what the richer base leaves.

    And the one that leaves least as it stands: where an effect is far from linear in its
    parameters, a trial that points the right way may still be too far off to descend from.
    Trials that point one way count once: a few slow lags of creep would else be all that is tried.
    """
    best: list[Screened] = []
    for one in screened:
        if len(best) == _LOOKS:
            break
        if not any(one.alike(other) for other in best):
            best.append(one)
    for one in (max(screened, key=_fall_rich), min(screened, key=_left)):
        if all(one is not other for other in best):
            best = [*best, one]
    return best


def _fall_rich(one: Screened) -> float:
    return one.fall_rich


def _left(one: Screened) -> float:
    return one.left


def _searched(refit: Refit, state: State, without: float) -> State:
    """Parameters of effects that jump, moved to and fro by shrinking steps; then all at once.

    `without`: chi-square without the effect.
    """
    jumps = [not type(effect).smooth for effect in state.effects for _ in free_parameters(effect)]
    low, high = refit.bounds(state.effects)
    for share in (3.0, 1.0, 0.5, 0.2, 0.06, 0.02, 0.006, 0.002, 0.0006, 0.0002, 6e-5, 2e-5):
        for i in np.flatnonzero(jumps):
            now = effect_values(state.effects)
            size = abs(now[i]) if now[i] else 0.5
            for sign in (1.0, -1.0):
                other = now.copy()
                other[i] += sign * share * size
                if not low[i] <= other[i] <= high[i]:
                    continue
                new = refit.evaluate(state.values, with_values(state.effects, other))
                if np.isfinite(new.cost) and new.cost < state.cost:
                    state = new
                    break
    noise = state.errors.synchronous.size + state.errors.nonsynchronous.size
    if state.cost - noise > _HOPE * (without - noise):
        return state
    return _together(refit, state, np.flatnonzero(jumps))


def _together(refit: Refit, state: State, moved: np.ndarray) -> State:
    """The parameters at `moved` all at once, by a simplex: valleys across them are narrow.

    Edges at both ends of the drive stay where they are when a step grows and its origin moves.
    """
    if moved.size < 2:
        return state
    found, now = [state], effect_values(state.effects)
    low, high = refit.bounds(state.effects)
    size = np.where(now[moved] != 0.0, np.abs(now[moved]), 0.5)

    def cost(x: np.ndarray) -> float:
        other = now.copy()
        other[moved] += x * size
        if (other < low).any() or (other > high).any():
            return 1e300
        new = refit.evaluate(state.values, with_values(state.effects, other))
        if np.isfinite(new.cost) and new.cost < found[0].cost:
            found[0] = new
        return new.cost if np.isfinite(new.cost) else 1e300

    options = {"maxfev": _LOOKED * moved.size, "xatol": 1e-8}
    for width in _SIMPLEX:
        best = effect_values(found[0].effects)
        start = (best - now)[moved] / size
        corners = start + width * np.concatenate([np.zeros((1, moved.size)), np.eye(moved.size)])
        minimize(cost, start, method="Nelder-Mead", options=options | {"initial_simplex": corners})
    return found[0]


def refit_flexible_base(refit: Refit, state: State) -> tuple[Refit, State]:
    """The richer base without any effect but the base's own."""
    base = flexible_base(refit.whitened, refit.base, state.values) or refit.base
    rich = dataclasses.replace(refit, base=base)
    values = base.prior_mean if base is not refit.base else state.values
    return rich, rich.minimise(rich.evaluate(values, state.effects), _RICH_STEPS, _RICH_SHARE)


def refit_on_flexible_base(
    refit: Refit, plain: State, none: tuple[Refit, State]
) -> tuple[Refit, State]:
    """The richer base with the effects of `plain`: from there, or from the richer base without.

    The better of the two starts is followed; the other only where the first ends above it.
    """
    base = flexible_base(refit.whitened, refit.base, plain.values) or refit.base
    own = dataclasses.replace(refit, base=base)
    values = base.prior_mean if base is not refit.base else plain.values
    other, before = none
    starts = [
        (own, own.evaluate(values, plain.effects)),
        (other, other.evaluate(before.values, plain.effects)),
    ]
    starts = sorted((s for s in starts if np.isfinite(s[1].cost)), key=lambda s: s[1].cost)
    first, state = starts[0]
    end = _enriched(first, state, before.cost)
    # A base that was bent to a jump costs much beside it at first, and may yet be the better start.
    jumps = not all(type(effect).smooth for effect in plain.effects)
    near = len(starts) > 1 and (jumps or starts[1][1].cost < 3.0 * end.cost)
    if near and end.synchronous > 1.2 * _lines(end):
        second = _enriched(*starts[1], before.cost)
        if second.cost < end.cost:
            return starts[1][0], second
    return first, end


def _enriched(refit: Refit, state: State, without: float) -> State:
    """A descent on the richer base; where an effect jumps, with another look for its edges.

    On the operator alone they were fitted to what its misfit left.
    """
    end = _settled(refit, state, _RICH_STEPS, _RICH_SHARE)
    for _ in range(_ROUNDS * any(not type(effect).smooth for effect in end.effects)):
        if end.synchronous < 1.2 * _lines(end):
            break
        before, end = end, _settled(refit, _searched(refit, end, without), _RICH_STEPS, _RICH_SHARE)
        if before.cost - end.cost < _RICH_SETTLED * before.cost:
            break
    return end


def _lines(state: State) -> int:
    return state.errors.synchronous.size
