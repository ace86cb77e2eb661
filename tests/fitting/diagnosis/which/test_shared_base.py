"""Where the base is searched, no candidate is credited with a search that ended better."""

import dataclasses

import pytest
from edge_worlds import drives, record

from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._forward_selection import without_effects
from fitting.diagnosis.which.refits._density_refit import refit_on_flexible_base
from fitting.diagnosis.which.refits._shared_base import share_flexible_base
from rapi_jax.effects import Creep, Delay, Etalon

TRUE = Creep.at(gain=0.05)  # of a lag the base is not searched, see `test_flexible_refit`


@pytest.fixture(scope="module")
def found():
    """`none`, and candidates of a record in which nothing repeats, each searched by itself."""
    recording = record(drives((10.0, 25.0), periods=1, samples=300), TRUE)
    fitted = fit_base(WhitenedModel.of(recording), None)
    refit, state = fitted.refit, fitted.state
    assert not refit.whitener.spectrum.measured
    none = without_effects(refit, state, fitted.eta_fixed[1])
    assert none.flexible_refit is not none.refit

    def candidate(effect, steps):
        on_base = refit.minimise(refit.evaluate(state.values, (effect,)), steps)
        _, flexible_refit, flexible = refit_on_flexible_base(refit, on_base, none)
        return Candidate((effect,), on_base, refit, on_base, flexible_refit, flexible, 1.0)

    return none, candidate


def test_a_search_that_was_stuck_ends_as_well_as_that_of_the_same_effect(found):
    none, candidate = found
    good = candidate(TRUE, 40)
    # Where its search began: as if rounding had kept it there.
    refit = good.flexible_refit
    begun = refit.evaluate(refit.base.prior_mean, (Creep.at(gain=0.01),))
    stuck = dataclasses.replace(good, on_flexible_base=begun)
    assert stuck.cost > 1.5 * good.cost
    first, second = share_flexible_base(none, [stuck, good])
    assert first.cost < 1.01 * good.cost
    assert second.cost <= good.cost


def test_no_cost_rises_and_the_order_stays(found):
    none, candidate = found
    before = [
        candidate(effect, 10)
        for effect in (Delay.at(tau=1e-4), TRUE, Etalon.at(amplitude=0.1, spacing=7.0))
    ]
    after = share_flexible_base(none, before)
    assert [c.name for c in after] == ["delay", "creep", "etalon"]
    for old, new in zip(before, after, strict=True):
        assert new is old or new.cost < old.cost
        # What a candidate says it leaves is what its own problem gives.
        state = new.on_flexible_base
        again = new.flexible_refit.evaluate(state.values, state.effects)
        assert again.cost == pytest.approx(new.cost, rel=1e-9)
    assert share_flexible_base(none, []) == []
