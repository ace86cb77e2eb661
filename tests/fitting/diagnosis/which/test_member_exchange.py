"""Pairs in which another effect takes one's place, and the order of two effects on the drive."""

import numpy as np
import pytest
from edge_worlds import drives, record
from worlds import TRUTHS, ordered

from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._excess import is_unexplained
from fitting.diagnosis.which._forward_selection import select_effects, without_effects
from fitting.diagnosis.which._member_exchange import exchange_members
from fitting.diagnosis.which.refits._density_refit import (
    is_near_base,
    refit_on_density,
    refit_on_flexible_base,
)
from fitting.diagnosis.which.refits._leading_effects import make_candidate
from rapi_jax.effects import (
    ALL,
    AmplifierLowpass,
    CurrentCoupling,
    Delay,
    ModeHop,
    Quantisation,
    Saturation,
    SlewLimit,
)

HOP = ModeHop.at(size=0.7, threshold=60.0, width=0.5)
LAG, SLEW = Delay.at(tau=2e-4), SlewLimit.at(limit=225.0)
COUPLING = CurrentCoupling.at(coupling=2e-3, lag_s=1e-5)


def fitted(session, *effects):
    """The base without effects, of a recording of the paper's device with these, in this order."""
    return fit_base(WhitenedModel.of(record(session, *effects)), None)


@pytest.fixture(scope="module")
def lagging():
    """A lag and a coupling; no effect, and what stands for them: a low-pass beside the coupling."""
    base = fitted(drives((10.0, 40.0), amplitudes=(3.0, 2.0)), *ordered((LAG, COUPLING)))
    none = without_effects(base.refit, base.state, base.eta_fixed[1])
    begin = (AmplifierLowpass.at(tau=2e-4), COUPLING)
    ends = refit_on_density(base.refit, none.on_base.values, begin, none.cost)
    return base, none, make_candidate(none, base.refit, ends[0], ends, 1.0)


def test_an_effect_that_acts_alike_takes_the_place_of_the_wrong_one(lagging):
    base, none, wrong = lagging
    assert is_unexplained(wrong.on_flexible_base)
    found = {c.name: c for c in exchange_members(base.refit, none, [wrong], ALL)}
    right = found["current_coupling+delay"]
    assert right.cost == min(c.cost for c in found.values())
    assert not is_unexplained(right.on_flexible_base)
    tau = next(float(e.tau) for e in right.effects if e.name == "delay")
    assert tau == pytest.approx(2e-4, rel=0.02)


def test_it_does_where_noise_is_unknown_too():
    """Of one period of each run, so that the flexible base is searched."""
    session = drives((5.0, 20.0, 80.0), periods=1, samples=400)
    base = fitted(session, *ordered((AmplifierLowpass.at(tau=3e-4), TRUTHS["rate_law"])))
    assert not base.refit.whitener.spectrum.measured
    none = without_effects(base.refit, base.state, base.eta_fixed[1])
    stands_in = ordered((Delay.at(tau=3e-4), TRUTHS["rate_law"]))
    begun = base.refit.evaluate(none.on_base.values, stands_in)
    ends = refit_on_flexible_base(base.refit, base.refit.minimise(begun, 20), none)
    wrong = make_candidate(none, base.refit, ends[0], ends, 1.0)
    found = {c.name: c for c in exchange_members(base.refit, none, [wrong], ALL)}
    right = found["amplifier_lowpass+rate_law"]
    assert right.cost == min(c.cost for c in found.values())
    assert is_unexplained(wrong.on_flexible_base) and not is_unexplained(right.on_flexible_base)
    tau = next(float(e.tau) for e in right.effects if e.name == "amplifier_lowpass")
    assert tau == pytest.approx(3e-4, rel=0.02)


def test_no_pair_gets_worse_or_lost(lagging):
    base, none, wrong = lagging
    found = {c.name: c for c in exchange_members(base.refit, none, [wrong], (Delay,))}
    assert found.keys() == {wrong.name, "current_coupling+delay"}
    assert found[wrong.name].cost <= wrong.cost
    assert exchange_members(base.refit, none, [], ALL) == []


def test_a_drive_held_at_rest_is_far_from_the_base(lagging):
    """To first order another base would make of nothing all that was read."""
    base, none, wrong = lagging
    marginal, values = wrong.flexible_refit, wrong.on_flexible_base.values
    at_rest = marginal.evaluate(values, (SlewLimit.at(limit=1e-6),))
    assert not is_near_base(base.refit, at_rest, none)
    assert is_near_base(base.refit, marginal.evaluate(values, wrong.effects), none)
    assert is_near_base(base.refit, marginal.evaluate(values, ()), none)


@pytest.mark.parametrize(
    "effects",
    [
        (AmplifierLowpass.at(tau=1e-3), Quantisation.at(step=0.0713, origin=0.0217)),
        (Quantisation.at(step=0.0713, origin=0.0217), AmplifierLowpass.at(tau=1e-3)),
        (AmplifierLowpass.at(tau=4e-4), Saturation.at(high=4.45)),
        (Saturation.at(high=4.45), AmplifierLowpass.at(tau=4e-4)),
    ],
    ids=lambda effects: "-".join(effect.name for effect in effects),
)
def test_which_comes_first_is_found(effects):
    base = fitted(drives((5.0, 20.0), amplitudes=(3.0, 2.0), samples=400), *effects)
    classes = (AmplifierLowpass, Delay, Quantisation, Saturation)
    best = select_effects(base, classes, lambda line: None).best
    assert [e.name for e in best.on_flexible_base.effects] == [e.name for e in effects]
    assert not is_unexplained(best.on_flexible_base)
    for found, true in zip(best.on_flexible_base.effects, effects, strict=True):
        for name in ("tau", "step", "high"):
            if hasattr(true, name):
                np.testing.assert_allclose(
                    float(getattr(found, name)), float(getattr(true, name)), rtol=0.02
                )


def test_a_slew_limit_beside_a_mode_hop_is_found_in_place_of_a_lag():
    """Beside a hop alone the base follows the limit, and lags explain more of what it leaves."""
    base = fitted(drives((10.0, 40.0), amplitudes=(3.0, 2.0), samples=400), SLEW, HOP)
    best = select_effects(base, ALL, lambda line: None).best
    assert best.name == "mode_hop+slew_limit" and not is_unexplained(best.on_flexible_base)
