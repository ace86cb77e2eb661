"""Costs on the flexible base are nested: an effect added never costs, wherever its refit ended."""

import dataclasses

import pytest
from edge_worlds import drives, record
from worlds import TRUTHS

from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._forward_selection import without_effects
from fitting.diagnosis.which._nested_costs import nest_costs, without_strength
from fitting.diagnosis.which.screening._screen import summarise_residual
from rapi_jax.effects import ALL, Etalon

SHORT = ("delay", "etalon", "mode_hop", "saturation")
ROUNDING = 1e-6  # of chi-square
EVERY = [pytest.param(cls.name, marks=() if cls.name in SHORT else pytest.mark.slow) for cls in ALL]


@pytest.fixture(scope="module")
def none():
    """A session without effects, and what stands for no effect."""
    session = drives((10.0, 40.0), amplitudes=(3.0, 2.0))
    fitted = fit_base(WhitenedModel.of(record(session)), None)
    return without_effects(fitted.refit, fitted.state, fitted.eta_fixed[1])


def stuck(none, effects) -> Candidate:
    """A candidate whose refit ended at effects that are not there."""
    state = none.flexible_refit.evaluate(none.on_flexible_base.values, effects)
    return dataclasses.replace(none, effects=effects, on_flexible_base=state)


@pytest.mark.parametrize("name", EVERY)
def test_an_effect_that_is_not_there_costs_no_more_than_none(none, name):
    wrong = stuck(none, (TRUTHS[name],))
    assert wrong.cost > none.cost
    (candidate,) = nest_costs(none, [wrong])
    assert candidate.name == name
    assert candidate.cost <= none.cost * (1.0 + ROUNDING)


def test_a_pair_costs_no_more_than_its_members(none):
    etalon, delay = Etalon(amplitude=0.2, spacing=7.0, phase=0.3), TRUTHS["delay"]
    others = [stuck(none, effects) for effects in ((delay, etalon), (etalon,), (delay,))]
    found = nest_costs(none, others)
    assert [c.name for c in found] == ["delay+etalon", "etalon", "delay"]
    cost = {candidate.name: candidate.cost for candidate in found}
    assert cost["delay+etalon"] <= min(cost["delay"], cost["etalon"]) * (1.0 + ROUNDING)
    assert max(cost.values()) <= none.cost * (1.0 + ROUNDING)


def test_what_is_nested_already_stays_as_it_is(none):
    (same,) = nest_costs(none, [dataclasses.replace(none, effects=(TRUTHS["delay"],))])
    assert same.on_flexible_base is none.on_flexible_base


@pytest.mark.parametrize("cls", ALL, ids=lambda cls: cls.name)
def test_without_strength_an_effect_changes_nothing_and_keeps_its_kind(none, cls):
    refit, state = none.flexible_refit, none.on_flexible_base
    summary = summarise_residual(refit.whitened, state, 0.02)
    weak = without_strength(TRUTHS[cls.name], summary)
    state = refit.evaluate(state.values, (weak,))
    assert state.cost == pytest.approx(none.cost, rel=1e-9)
    if cls.name in ("etalon", "pickup", "resonance"):
        kind = "spacing" if cls.name == "etalon" else "hertz"
        assert float(getattr(weak, kind)) == float(getattr(TRUTHS[cls.name], kind))
