"""Costs on the flexible base are nested: an effect added never costs, wherever its refit ended."""

import dataclasses

import pytest
from edge_worlds import drives, record
from worlds import TRUTHS

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._flexible_comparison import compare_on_flexible_base
from rapi_jax.effects import ALL, Etalon

SHORT = ("delay", "etalon", "mode_hop")
ROUNDING = 1e-6  # of chi-square
EVERY = [pytest.param(cls.name, marks=() if cls.name in SHORT else pytest.mark.slow) for cls in ALL]


@pytest.fixture(scope="module")
def null():
    """A session without effects, its refit and what stands for no effect."""
    session = drives((10.0, 40.0), amplitudes=(3.0, 2.0))
    fitted = fit_base(WhitenedModel.of(record(session)), None)
    base = FlexibleBase.about(fitted.refit, fitted.state)
    bare = base.marginal.evaluate(fitted.state.values, ())
    return fitted.refit, Candidate((), fitted.eta_fixed[1], fitted.state, base, bare, 1.0)


def stuck(null, effects) -> Candidate:
    """A candidate whose refit ended at effects that are not there."""
    refit, none = null
    state = refit.evaluate(none.on_base.values, effects)
    return dataclasses.replace(none, effects=effects, on_base=state, eta_fixed=state)


@pytest.mark.parametrize("name", EVERY)
def test_an_effect_that_is_not_there_costs_no_more_than_none(null, name):
    refit, none = null
    wrong = stuck(null, (TRUTHS[name],))
    assert wrong.on_base.cost > none.on_base.cost
    after, (candidate,) = compare_on_flexible_base(refit, none, [wrong])
    assert candidate.name == name
    assert candidate.cost <= after.cost * (1.0 + ROUNDING)


def test_a_pair_costs_no_more_than_its_members(null):
    refit, none = null
    etalon, delay = Etalon(amplitude=0.2, spacing=7.0, phase=0.3), TRUTHS["delay"]
    others = [stuck(null, effects) for effects in ((etalon,), (delay,), (delay, etalon))]
    after, found = compare_on_flexible_base(refit, none, others)
    cost = {candidate.name: candidate.cost for candidate in found}
    assert cost["delay+etalon"] <= min(cost["delay"], cost["etalon"]) * (1.0 + ROUNDING)
    assert max(cost.values()) <= after.cost * (1.0 + ROUNDING)
