"""Which effects are refitted: by what they explain on the base, or beyond the flexible base."""

import dataclasses

import numpy as np
import pytest

from fitting.blind.protocol._exchange import to_recording
from fitting.blind.simulator._simulated_device import draw_device
from fitting.diagnosis import diagnose
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.refits._effect_refit import _distinct_guesses
from fitting.diagnosis.which.screening._screen import Screened
from fitting.diagnosis.which.screening._screened_effects import ScreenedEffects, may_explain
from rapi_jax.effects import Delay, ModeHop


def screened(*scores: tuple[float, float], expected: float = 1e9) -> list[Screened]:
    return [
        Screened(Delay(1e-3), on, beyond, expected, 1.0, 0.0, np.zeros(1)) for on, beyond in scores
    ]


def test_what_explains_next_to_nothing_beyond_the_flexible_base_is_not_refitted():
    found = ScreenedEffects(
        {
            "stands in": screened((1e6, 10.0)),
            "beyond": screened((0.0, 4e3), (1.0, 5e3)),
            "both": screened((1e5, 1e3)),
            "neither": screened((1e4, 1e2), (2e4, 2e2)),
        }
    )
    assert list(found.promising) == ["beyond", "both"]
    assert found.leading_on_flexible_base == {"beyond"}
    assert found.best_on_flexible_base("beyond") is found.guesses["beyond"][1]


def test_what_a_flexible_base_takes_up_is_judged_on_the_identified_one():
    chance = THRESHOLDS.chance_fall
    found = ScreenedEffects(
        {
            "beyond": screened((1e3, 5e3)),
            "law of thresholds": screened((1e6, 1.0), expected=0.9 * chance),
            "far less": screened((1e4, 1.0), expected=0.9 * chance),
            "would show": screened((1e6, 1.0), expected=1.1 * chance),
        }
    )
    assert list(found.promising) == ["beyond", "law of thresholds"]
    assert found.leading_on_flexible_base == {"beyond"}


def test_where_noise_is_unknown_a_flexible_base_tells_nothing():
    guesses = {"large": screened((1e6, 1e3)), "small": screened((1.0, 1.0))}
    found = ScreenedEffects(guesses, telling=False, least=1e4)
    assert found.promising == guesses
    assert not found.leading_on_flexible_base


def test_an_effect_that_no_score_tells_of_is_refitted_in_any_case():
    guesses = {"large": screened((1e3, 5e3)), "law": screened((0.0, 0.0))}
    assert list(ScreenedEffects(guesses).promising) == ["large"]
    found = ScreenedEffects(guesses, in_any_case=frozenset({"law"}))
    assert found.promising == guesses and found.leading_on_flexible_base == {"large"}


def test_beside_a_refined_guess_one_other_is_enough():
    """But for one that explains no more than chance: there no score tells which guess is near."""
    chance = THRESHOLDS.chance_fall
    guesses = screened(*((score, 0.0) for score in (9.0, 8.0, 7.0, 6.0)))
    few = THRESHOLDS.refitted_guesses
    for beyond, kept in ((2.0 * chance, 1), (0.5 * chance, few)):
        refined = dataclasses.replace(guesses[-1], score=1.0, flexible_score=beyond, refined=True)
        found = _distinct_guesses([*guesses, refined])
        assert found[0] is refined
        assert [one.score for one in found[1:]] == [one.score for one in guesses[:kept]]


def test_so_many_lead_at_most():
    found = {
        name: screened((1.0, score)) for name, score in zip("abc", (7e3, 9e3, 8e3), strict=True)
    }
    assert ScreenedEffects(found).leading_on_flexible_base == {"a", "b", "c"}
    assert ScreenedEffects(found, most=2).leading_on_flexible_base == {"b", "c"}
    assert list(ScreenedEffects(found, most=2).promising) == ["a", "b", "c"]


def test_a_second_effect_must_explain_enough():
    guesses = {"large": screened((1e6, 10.0)), "beyond": screened((0.0, 4e3))}
    assert list(ScreenedEffects(guesses, least=100.0).promising) == ["beyond"]
    assert not ScreenedEffects(guesses, least=1e4).promising


@pytest.mark.parametrize(
    ("effect", "refined", "times"),
    [
        (Delay(1e-3), False, THRESHOLDS.foreseen_of_grid),
        (Delay(1e-3), True, THRESHOLDS.foreseen_of_refit),
        (ModeHop.at(), True, THRESHOLDS.foreseen_of_jumps),
        (ModeHop.at(), False, THRESHOLDS.foreseen_of_grid),
    ],
)
def test_what_an_effect_may_explain_is_foreseen_from_its_best_guess(effect, refined, times):
    low, high = screened((0.0, 10.0), (0.0, 100.0))
    guesses = [low, dataclasses.replace(high, effect=effect, refined=refined)]
    assert may_explain(guesses, 0.99 * times * 100.0)
    assert not may_explain(guesses, 1.01 * times * 100.0)


def test_what_does_not_repeat_is_explained_by_what_does_not_repeat():
    """Beside a small part that does not repeat, an effect of the other part may explain little."""
    (repeats,) = screened((0.0, 1000.0))
    enough = 1e6, 100.0
    assert may_explain([repeats], *enough[:1]) is False
    assert not may_explain([repeats], *enough)
    loose = dataclasses.replace(repeats, nonsynchronous_score=100.0)
    assert may_explain([loose], *enough)
    assert not may_explain([loose], 1e6, np.inf)


def test_chance_leads_nowhere():
    chance = THRESHOLDS.chance_fall
    found = ScreenedEffects({"a": screened((5.0, chance)), "b": screened((4.0, 0.9 * chance))})
    assert found.leading_on_flexible_base == {"a"}
    assert list(found.promising) == ["a", "b"]
    least = THRESHOLDS.screened_chance
    weak = {"a": screened((5.0, 0.5 * least)), "b": screened((4.0, 0.9 * least))}
    assert not ScreenedEffects(weak, least=least).promising
    assert ScreenedEffects({}).promising == {}
    assert not ScreenedEffects({}).leading_on_flexible_base


def test_guesses_of_a_jump_that_score_alike_are_all_begun_from_and_of_a_smooth_effect_the_best():
    smooth = screened((1.0, 100.0), (2.0, 99.0), (3.0, 50.0))
    jumps = [dataclasses.replace(one, effect=ModeHop.at()) for one in smooth]
    found = ScreenedEffects({"delay": smooth, "mode_hop": jumps})
    assert found.starts_on_flexible_base("delay") == [smooth[:1]]
    assert found.starts_on_flexible_base("mode_hop") == [jumps[:2]]
    many = ScreenedEffects({"mode_hop": 9 * jumps[:1]})
    assert len(many.starts_on_flexible_base("mode_hop")[0]) == THRESHOLDS.tied_guesses


@pytest.mark.slow
def test_an_effect_beside_a_base_that_misfits_far_more_is_found():
    """The operator leaves 225 of chi-square a line, of which others explain more than creep.

    An amplitude law and an etalon do, each several times as much; beyond the flexible base, creep.
    """
    device = draw_device(955017126, "listed", "creep", 3.514, base_misfit=True)
    found = diagnose(None, to_recording(device.runs), scan=False)
    assert found.verdict.name == "creep"


@pytest.mark.slow
def test_a_law_beside_a_mode_hop_is_refitted_though_its_score_is_small():
    """The mode hop leaves 19 of chi-square a line; the rate law scores a tenth of that.

    Its signature is that of a base which has not followed: refitted beside it, 1.0 is left.
    """
    device = draw_device(
        3243787796, "pair", "mode_hop+rate_law", 14.756, base_misfit=True, any_session=True
    )
    found = diagnose(None, to_recording(device.runs), scan=False)
    assert found.verdict.name == "mode_hop+rate_law"
