"""Guesses refitted with the base integrated out: what a score that is linear in one size misses."""

import dataclasses

import numpy as np
import pytest
from edge_worlds import drives, record
from worlds import ordered

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which.screening._marginal_refit import refine_guesses
from fitting.diagnosis.which.screening._screen import Screened
from fitting.diagnosis.which.screening._screened_effects import best_of_each_kind, guesses_to_refine
from rapi_jax.effects import Creep, Delay, Etalon, ModeHop

TRUTH = Etalon(amplitude=0.3, spacing=7.0, phase=0.3)


@pytest.fixture(scope="module")
def marginal():
    """The refit beside a density of plays on a session with an etalon, and the base's state."""
    session = drives((10.0, 40.0), amplitudes=(3.0, 2.0))
    fitted = fit_base(WhitenedModel.of(record(session, *ordered((TRUTH,)))), None)
    return FlexibleBase.about(fitted.refit, fitted.state).marginal, fitted.state


def guess(effect, score: float, along: int = 0) -> Screened:
    """A guess whose signature points along one of three axes."""
    return Screened(effect, score, score, score, 1.0, 0.0, np.eye(3)[along])


def test_a_guess_nearby_becomes_the_effect_and_its_score_what_it_explains(marginal):
    refit, state = marginal
    near = guess(Etalon(amplitude=0.1, spacing=7.05, phase=0.0), 1e3)
    (first, found) = refine_guesses(refit, state, {"etalon": [near]})["etalon"]
    assert first is near and found.refined
    assert float(found.effect.spacing) == pytest.approx(7.0, rel=0.01)
    alone = refit.evaluate(state.values, ())
    with_it = refit.evaluate(state.values, (found.effect,))
    assert found.flexible_score == pytest.approx(alone.cost - with_it.cost)
    assert found.flexible_score > 1e3


def test_a_guess_that_gains_nothing_keeps_its_score_and_is_marked(marginal):
    refit, state = marginal
    found = refine_guesses(refit, state, {"delay": [guess(Delay(1e-4), 1e9)]})["delay"]
    assert [(one.refined, one.flexible_score) for one in found] == [(True, 1e9)]
    assert float(found[0].effect.tau) == 1e-4


def test_a_guess_that_scores_less_as_it_stands_but_explains_more_is_found(marginal):
    refit, state = marginal
    wrong = guess(Etalon(amplitude=0.1, spacing=11.3, phase=0.0), 1e3, 0)
    right = guess(Etalon(amplitude=0.1, spacing=7.05, phase=0.0), 8e2, 1)
    found = refine_guesses(refit, state, {"etalon": [wrong, right]})["etalon"]
    best = max(found, key=lambda one: one.flexible_score)
    assert best.refined and float(best.effect.spacing) == pytest.approx(7.0, rel=0.01)


def test_guesses_to_refine_are_few_near_the_best_and_of_other_signatures():
    near = [guess(Delay(1e-4 * k), score, k % 3) for k, score in enumerate((9.0, 8.0, 7.0, 6.5), 1)]
    assert guesses_to_refine(near) == near[:3]  # the fourth points along the first
    far = guess(Delay(1e-3), 0.69 * 9.0, 2)
    assert guesses_to_refine([near[0], far]) == [near[0]]
    jumps = [guess(ModeHop.at(size=1.0, threshold=k, width=0.1), 9.0 - k, k) for k in range(3)]
    assert guesses_to_refine(jumps) == [jumps[0]]  # a search for its jumps takes seconds


def test_what_explains_next_to_nothing_of_the_best_is_left_as_it_is(marginal):
    refit, state = marginal
    guesses = {"etalon": [guess(TRUTH, 1e6)], "delay": [guess(Delay(1e-4), 1.0)]}
    found = refine_guesses(refit, state, guesses)
    assert found["delay"] is guesses["delay"]
    assert not dataclasses.replace(found["delay"][0]).refined


@pytest.mark.parametrize(("score", "count"), [(900.0, 2), (400.0, 1)])
def test_the_best_of_each_kind_that_scores_nearly_as_well_is_refitted(score, count):
    driven = [guess(Creep.at(gain=g), s) for g, s in ((0.01, 1e3), (0.02, 990.0))]
    rested = [guess(Creep.at(gain=0.01, lead_s=lead), score - lead) for lead in (0.1, 0.2)]
    found = best_of_each_kind([*rested, *driven])
    assert found == [driven[0], rested[0]][:count]
    assert best_of_each_kind([guess(TRUTH, 1.0), guess(TRUTH, 2.0)])[0].score == 2.0
