"""Which effects a recording holds: every candidate refitted with the base, leaders on the richer
base, then forward selection with a backward check.
"""

import dataclasses
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import AbstractEffect

from ._base import FittedBase
from ._candidates import (
    Candidate,
    added_effects,
    free_eta,
    full_refit,
    hypothesis_name,
    refit_flexible_base,
    refit_from_no_hysteresis,
    refit_on_flexible_base,
    refit_without_hysteresis,
    short_refit,
)
from ._screen import orthonormal_basis, screen_effect, search_ranges, summarise_residual

_FIRSTS = 2  # effects beside which a second is looked for
_SWAPS = 2  # pairs whose first effect is looked for anew
_ALONE = 4  # steps of the base with the other effect alone
_LEADERS = 4  # refitted on the richer base
_NEAR, _FAR = 0.5, 0.2  # of the best fall in chi-square: a candidate below is no rival
_BEHIND = 10.0  # times the best's excess, or what chance adds to it: the same
_EXPLAINED = 1.25  # chi-square a locked line: what a base may leave that is not quite the device's
_LOOSE = 1.04  # the same of what does not repeat
_WORTH = 0.5  # of the excess, that a second effect must take away
_OWN = 0.3  # of that gain, that it has on the identified base at least
_POOR = 0.5  # of the excess, left where noise is unknown: then a second effect is looked for
_CHANCE = 60.0  # fall in chi-square that no search over effects and their trials finds in noise

Progress = Callable[[str], None]
Trials = dict[str, list[AbstractEffect]]


@dataclasses.dataclass(frozen=True, eq=False)
class Attribution:
    """All hypotheses that were refitted; `none` first, then by what is left, least first."""

    none: Candidate
    candidates: tuple[Candidate, ...]

    @property
    def best(self) -> Candidate:
        """The candidate that leaves least."""
        return self.candidates[0] if self.candidates else self.none


def excess(state: State) -> float:
    """Chi-square above what noise alone would leave."""
    return (
        state.synchronous
        + state.nonsynchronous
        - state.errors.synchronous.size
        - state.errors.nonsynchronous.size
    )


def is_unexplained(state: State) -> bool:
    """Whether more is left than noise, and than a base that is not quite the device's."""
    lines, nonsynchronous = state.errors.synchronous.size, state.errors.nonsynchronous.size
    return bool(
        state.synchronous > _EXPLAINED * lines + 4.0 * np.sqrt(2.0 * lines)
        or (
            nonsynchronous
            and state.nonsynchronous > _LOOSE * nonsynchronous + 5.0 * np.sqrt(2.0 * nonsynchronous)
        )
    )


def select_effects(
    fitted: FittedBase, candidates: Sequence[type[AbstractEffect]], say: Progress
) -> Attribution:
    """Refit every candidate, and pairs where one is not enough."""
    state = fitted.state
    own = {effect.name for effect in state.effects}
    classes = [cls for cls in candidates if cls.name not in own]
    trials = _initial_guesses(fitted.eta_fixed[0], fitted.eta_fixed[1], classes)
    edges = {k: v for grid in trials.values() for k, v in search_ranges(grid).items()}
    refit = dataclasses.replace(fitted.refit, search_ranges=edges)
    eta_fixed = dataclasses.replace(fitted.eta_fixed[0], search_ranges=edges)
    say("richer base")
    flexible_refit, rich = refit_flexible_base(refit, state)
    none = Candidate((), fitted.eta_fixed[1], state, rich, flexible_refit, 1.0)
    found = _one_more((eta_fixed, refit), none, none, trials, say)
    if not found:
        return Attribution(none, ())
    # The richer base with every leader's values, without its effect: no effect is credited with
    # a better start.
    none = _fairer(none, found)
    pairs: list[Candidate] = []
    best = min([none, *found], key=lambda c: c.cost)
    known = refit.whitener.spectrum.measured
    needed = is_unexplained(best.rich) if known else excess(best.rich) > _POOR * excess(none.rich)
    if needed:
        for first in _firsts(none, found):
            rest = _initial_guesses(
                eta_fixed, first.eta_fixed, [c for c in classes if c.name != first.name]
            )
            say(f"{first.name} and another")
            for pair in _both_ways((eta_fixed, refit), first, none, rest, classes):
                names = {p.name for p in pairs}
                if pair.name not in names and _worth(pair, [first, *found]):
                    pairs.append(pair)
    ordered = sorted([*found, *pairs], key=lambda c: c.cost)
    return Attribution(none, tuple(ordered))


def _firsts(none: Candidate, found: list[Candidate]) -> list[Candidate]:
    """What a second effect is looked for beside: the best on the richer base, and on the operator.

    Where two effects are missing, the richer base bends to one of them, and then the other alone
    may explain nothing on it.
    """
    out: dict[str, Candidate] = {}
    for cost in (lambda c: c.cost, lambda c: c.plain.cost):
        best = min(cost(c) for c in found)
        if cost(none) - best > _CHANCE:
            near = [c for c in found if cost(none) - cost(c) > _NEAR * (cost(none) - best)]
            out |= {c.name: c for c in sorted(near, key=cost)[: _FIRSTS - len(out)]}
    return list(out.values())


def _both_ways(
    refits: tuple[Refit, Refit],
    first: Candidate,
    none: Candidate,
    grids: Trials,
    classes: Sequence[type[AbstractEffect]],
) -> list[Candidate]:
    """Pairs with `first`; it is looked for anew beside the other where the two leave too much.

    What was found while the other was missing may be the wrong fringe, or the wrong edge.
    """
    cls = next(c for c in classes if c.name == first.name)
    out = _one_more(refits, first, none, grids, _silent)
    for pair in sorted(out, key=lambda c: c.cost)[:_SWAPS]:
        if not is_unexplained(pair.rich):
            continue
        (other,) = (e for e in pair.effects if e.name != first.name)
        kept = (*none.plain.effects, other)
        refit = refits[0]
        alone = refit.minimise(refit.evaluate(pair.eta_fixed.values, kept), _ALONE)
        start = dataclasses.replace(pair, eta_fixed=alone)
        again = _one_more(refits, start, none, _initial_guesses(refit, alone, [cls]), _silent)
        if again and again[0].cost < pair.cost:
            out[out.index(pair)] = again[0]
    return out


def _silent(line: str) -> None:
    pass


def _worth(pair: Candidate, singles: list[Candidate]) -> bool:
    """The backward check: neither of the two alone leaves nearly as little.

    On the identified base too, where there is more to gain: what a second effect takes away only
    beside a hysteresis that was bent for it is not its own.
    """
    members = {effect.name for effect in pair.effects}
    alone = [s for s in singles if s.name in members]
    rich, plain = min(s.cost for s in alone), min(s.plain.cost for s in alone)
    gain = rich - pair.cost
    own = plain - pair.plain.cost > _OWN * gain
    left = min(excess(s.rich) for s in alone)
    steady = min((s.rich for s in alone), key=_wandering)
    # What does not repeat no hysteresis could have taken away, bent or not.
    enough = own and gain > _WORTH * left or _steadies(pair.rich, steady, _WORTH)
    return gain > _CHANCE and enough


def _wandering(state: State) -> float:
    """Chi-square of what does not repeat, above what noise alone would leave."""
    return state.nonsynchronous - state.errors.nonsynchronous.size


def _one_more(
    refits: tuple[Refit, Refit],
    start: Candidate,
    none: Candidate,
    grids: Trials,
    say: Progress,
) -> list[Candidate]:
    """Every class beside the effects of `start`; the leaders also on the richer base."""
    refit, free = refits
    state, rich = start.eta_fixed, start.rich
    plain_basis = orthonormal_basis(refit.jacobian_base(state))
    rich_basis = orthonormal_basis(start.flexible_refit.jacobian_base(rich))
    straight = refit_without_hysteresis(refit, state) if _one_rate(refit) else None
    looks: list[tuple[State, float]] = []
    ends: list[tuple[State, float]] = []
    for name, trials in grids.items():
        say(name)
        found = screen_effect(refit, state, trials, plain_basis, rich_basis)
        if not found:
            continue
        look = short_refit(refit, state, found)
        if look is not None:
            looks.append((look, found[0].survival))
        if straight is not None:
            bent = orthonormal_basis(straight[0].jacobian_base(straight[1]))
            look = refit_from_no_hysteresis(
                refit, straight, screen_effect(*straight, trials, bent, bent)
            )
            if look is not None:
                looks.append((look, found[0].survival))
    say("the best of them")
    for look, survival in sorted(looks, key=lambda pair: pair[0].cost):
        best = min((end for end, _ in ends), key=_cost, default=None)
        if best is None or _rivals(look, best, state, _FAR) or _steadies(look, state, _FAR):
            ends.append((full_refit(refit, look, state.cost), survival))
    ends = _one_each(end for end in ends if end[0].cost < state.cost)
    best = ends[0][0] if ends else state
    leaders = [
        pair
        for k, pair in enumerate(ends)
        if k <= _LEADERS and _rivals(pair[0], best, state, _NEAR) or _steadies(pair[0], state, _FAR)
    ] or ends[:1]
    own = none.plain.effects
    out = []
    for end, survival in leaders:
        say(f"{hypothesis_name(added_effects(end.effects, own))} on the richer base")
        plain = free_eta(free, end)
        flexible_refit, rich = refit_on_flexible_base(
            free, plain, (start.flexible_refit, start.rich)
        )
        effects = added_effects(rich.effects, own)
        out.append(Candidate(effects, end, plain, rich, flexible_refit, survival))
    return out


def _cost(state: State) -> float:
    return state.cost


def _rivals(one: State, best: State, none: State, share: float) -> bool:
    """Whether what `one` leaves is near enough to what the best does for more work on it."""
    fall, most = none.cost - one.cost, none.cost - best.cost
    chance = 4.0 * np.sqrt(2.0 * (best.errors.synchronous.size + best.errors.nonsynchronous.size))
    near = excess(one) < _BEHIND * max(excess(best), float(chance))
    return near and fall > max(share * most, _CHANCE / 4)


def _steadies(one: State, without: State, share: float) -> bool:
    """Whether `one` takes away more than a share of what does not repeat.

    Beside a base that is far off, others take away more by standing in for it.
    """
    gain = _wandering(without) - _wandering(one)
    return gain > max(share * _wandering(without), _CHANCE)


def _one_each(ends: Iterable[tuple[State, float]]) -> list[tuple[State, float]]:
    """The best end of each effect, the best of all first."""
    best: dict[str, tuple[State, float]] = {}
    for end, survival in sorted(ends, key=lambda pair: pair[0].cost):
        best.setdefault(hypothesis_name(end.effects), (end, survival))
    return list(best.values())


def _initial_guesses(refit: Refit, state: State, classes: Sequence[type[AbstractEffect]]) -> Trials:
    """Where each class may start, by what `state` leaves."""
    spectrum = refit.whitener.spectrum
    seen = summarise_residual(refit.whitened, state, float(np.sqrt(spectrum.white + spectrum.red)))
    return {cls.name: list(cls.initial_guesses(seen)) for cls in classes}


def _one_rate(refit: Refit) -> bool:
    """Whether all runs have about one rate: a lag and hysteresis then look alike."""
    rates = refit.whitened.recording.rates
    return bool(max(rates) <= 1.2 * min(rates))


def _fairer(none: Candidate, found: list[Candidate]) -> Candidate:
    """`none`, from the best of the leaders' richer bases where that leaves less."""
    best = min(found, key=lambda c: c.cost)
    refit = best.flexible_refit
    start = refit.evaluate(best.rich.values, none.plain.effects)
    if not np.isfinite(start.cost) or start.cost > 3.0 * none.cost:
        return none
    end = refit.minimise(start, 12, 2e-3)
    if end.cost < none.cost:
        return dataclasses.replace(none, rich=end, flexible_refit=refit)
    return none
