"""A pair stands only where neither of its effects alone does as well from where the pair ended."""

import dataclasses

import pytest
from edge_worlds import drives, record
from worlds import TRUTHS, ordered

from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._backward_check import check_backward
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._excess import excess
from fitting.diagnosis.which._forward_selection import without_effects
from fitting.diagnosis.which.refits._effect_refit import free_eta
from fitting.diagnosis.which.refits._flexible_refit import refit_and_search
from rapi_jax.effects import Delay, Pickup

DELAY, ETALON = Delay(tau=1e-4), TRUTHS["etalon"]
BAD = Delay(tau=4e-4)
PICKUP = Pickup(amplitude=0.1, hertz=50.3, phase=0.3)
ELSEWHERE = Pickup(amplitude=0.1, hertz=57.3, phase=0.3)


def candidates(effects, *hypotheses):
    """The refits of a session with `effects`; `none`, then `hypotheses` begun at their values."""
    session = drives((10.0, 40.0), amplitudes=(3.0, 2.0))
    fitted = fit_base(WhitenedModel.of(record(session, *ordered(effects))), None)
    eta_fixed, state = fitted.eta_fixed
    none = without_effects(fitted.refit, fitted.state, state)
    refit, flexible = none.flexible_refit, none.on_flexible_base

    def candidate(effects) -> Candidate:
        effects = ordered(effects)
        end = eta_fixed.minimise(eta_fixed.evaluate(state.values, effects), 40)
        on_base = free_eta(fitted.refit, end)
        start = refit.evaluate(flexible.values, on_base.effects)
        on_flexible = refit_and_search(refit, start, flexible.cost)
        free = fitted.refit
        return Candidate(on_flexible.effects, end, free, on_base, refit, on_flexible, 1.0)

    return (eta_fixed, fitted.refit), none, [candidate(one) for one in hypotheses]


def stuck(refits, none, effects, at) -> Candidate:
    """A hypothesis whose refits ended far above: at the base's own values, its effects at `at`."""
    bases = (*refits, none.flexible_refit)
    states = (none.eta_fixed, none.on_base, none.on_flexible_base)
    ended = [base.evaluate(state.values, at) for base, state in zip(bases, states, strict=True)]
    return Candidate(effects, ended[0], refits[1], ended[1], none.flexible_refit, ended[2], 1.0)


def leaves_noise(single) -> bool:
    """Whether what is left is noise, and next to nothing besides."""
    state = single.on_flexible_base
    return excess(state) < 0.1 * (state.errors.synchronous.size + state.errors.nonsynchronous.size)


@pytest.fixture(scope="module")
def one_effect():
    """A session with a delay: no effect, the delay alone, and the delay beside an etalon."""
    return candidates((DELAY,), (DELAY,), (DELAY, ETALON))


def test_a_pair_falls_where_one_of_its_effects_had_stopped_too_early(one_effect):
    refits, none, (_, pair) = one_effect
    early = stuck(refits, none, (BAD,), (BAD,))
    assert early.cost - pair.cost > 1000.0  # as it stands the etalon seems to explain that much
    singles, pairs = check_backward(refits, none, [early], [pair])
    assert not pairs
    assert singles[0].name == "delay"
    assert leaves_noise(singles[0])


def test_an_effect_found_only_beside_another_becomes_a_hypothesis_of_its_own(one_effect):
    refits, none, (_, pair) = one_effect
    etalon = stuck(refits, none, (ETALON,), (ETALON,))
    singles, pairs = check_backward(refits, none, [etalon], [pair])
    assert not pairs
    assert singles[0].name == "delay"
    assert leaves_noise(singles[0])


def test_an_effect_is_refitted_alone_from_the_flexible_base_of_the_pair_too():
    """There alone had the pair's pickup found its frequency; its etalon explains nothing."""
    refits, none, (pair,) = candidates((PICKUP,), (PICKUP, ETALON))
    astray = stuck(refits, none, (), ordered((ELSEWHERE, ETALON)))
    pair = dataclasses.replace(pair, eta_fixed=astray.eta_fixed, on_base=astray.on_base)
    early = stuck(refits, none, (ELSEWHERE,), (ELSEWHERE,))
    singles, pairs = check_backward(refits, none, [early], [pair])
    assert not pairs
    assert singles[0].name == "pickup"
    assert leaves_noise(singles[0])


def test_a_pair_of_two_effects_that_are_there_stands():
    refits, none, (delay, etalon, pair) = candidates(
        (DELAY, ETALON), (DELAY,), (ETALON,), (DELAY, ETALON)
    )
    before = {"delay": delay.cost, "etalon": etalon.cost}
    singles, pairs = check_backward(refits, none, [delay, etalon], [pair, pair])
    assert pairs == [pair]  # once, though it was found beside either
    assert all(single.cost <= before[single.name] for single in singles)
