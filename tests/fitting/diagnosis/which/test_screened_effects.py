"""Which effects are refitted: by what they explain on the base, or beyond the flexible base."""

import numpy as np
import pytest

from fitting.blind.protocol._exchange import to_recording
from fitting.blind.simulator._simulated_device import draw_device
from fitting.diagnosis import diagnose
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.screening._screen import Screened
from fitting.diagnosis.which.screening._screened_effects import ScreenedEffects
from rapi_jax.effects import Delay


def screened(*scores: tuple[float, float]) -> list[Screened]:
    return [Screened(Delay(1e-3), on, beyond, 1.0, 0.0, np.zeros(1)) for on, beyond in scores]


def test_what_explains_next_to_nothing_on_either_base_is_not_refitted():
    found = ScreenedEffects(
        {
            "large": screened((1e6, 10.0)),
            "beyond": screened((0.0, 4e3), (1.0, 5e3)),
            "both": screened((1e5, 1e3)),
            "neither": screened((1e4, 1e2), (2e4, 2e2)),
        }
    )
    assert list(found.promising) == ["large", "beyond", "both"]
    assert found.leading_on_flexible_base == {"beyond"}
    assert [s.flexible_score for s in found.by_flexible_score("beyond")] == [5e3, 4e3]


def test_a_base_that_ended_early_tells_nothing():
    guesses = {"large": screened((1e6, 1e3)), "small": screened((1.0, 1.0))}
    found = ScreenedEffects(guesses, telling=False, least=1e4)
    assert found.promising == guesses
    assert not found.leading_on_flexible_base


def test_a_second_effect_must_explain_enough_beyond_the_flexible_base():
    guesses = {"large": screened((1e6, 10.0)), "beyond": screened((0.0, 4e3))}
    assert list(ScreenedEffects(guesses, least=100.0).promising) == ["beyond"]
    assert not ScreenedEffects(guesses, least=1e4).promising


def test_chance_leads_nowhere():
    chance = THRESHOLDS.chance_fall
    found = ScreenedEffects({"a": screened((5.0, chance)), "b": screened((4.0, 0.9 * chance))})
    assert not found.leading_on_flexible_base
    assert list(found.promising) == ["a", "b"]
    assert ScreenedEffects({}).promising == {}
    assert not ScreenedEffects({}).leading_on_flexible_base


@pytest.mark.slow
def test_an_effect_beside_a_base_that_misfits_far_more_is_found():
    """The operator leaves 225 of chi-square a line, of which others explain more than creep.

    An amplitude law and an etalon do, each several times as much; beyond the flexible base, creep.
    """
    device = draw_device(955017126, "listed", "creep", 3.514, base_misfit=True)
    found = diagnose(None, to_recording(device.runs), scan=False)
    assert found.verdict.name == "creep"
