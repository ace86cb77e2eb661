"""The odds that a scan would give, by which the answer will be given."""

import dataclasses

import numpy as np
import pytest
from scan_worlds import (
    N,
    P,
    choose_next_scan,
    rival_set,
    world,
)

from fitting.diagnosis.next_scan._candidates import Candidate
from fitting.diagnosis.next_scan._discrimination import (
    linear_discrimination,
)
from fitting.diagnosis.next_scan._rated_scan import rate_scans
from fitting.diagnosis.next_scan._rival_refit import refit_rival
from fitting.diagnosis.next_scan._rival_set import probability_left
from fitting.diagnosis.which.evidence._tempering import Tempering
from rapi_jax import triangle

FORM = Tempering(misfit=1.5, base=4.0, form=0.01)


@pytest.mark.parametrize(("power", "stake"), [(100.0, 0.0), (100.0, 500.0), (20.0, 80.0)])
def test_so_many_more_periods_are_what_separates_and_no_fewer(power, stake):
    rivals = dataclasses.replace(rival_set(world("lags")), tempering=FORM)
    n = rivals.repeats_needed((0, 1), power, stake)
    assert 0.0 < n < np.inf
    assert rivals.log_odds((0, 1), n * power, n * stake) == pytest.approx(np.log(19), rel=1e-3)


def test_no_number_of_periods_separates_what_differs_by_less_than_equations_are_good_to():
    rivals = dataclasses.replace(rival_set(world("lags")), tempering=FORM)
    assert rivals.repeats_needed((0, 1), 100.0, 2000.0) == np.inf
    least = 100.0 / (2.0 * FORM.misfit * FORM.form * 2000.0)
    assert rivals.log_odds((0, 1), 1e9 * 100.0, 1e9 * 2000.0) == pytest.approx(least, rel=1e-3)
    found = choose_next_scan(*world("lags"), tempering=Tempering(1.0, 4.0, 10.0))
    assert "ore periods would not separate them" in found.reason
    assert "The wrong one, refitted to all data, would differ" in found.reason


def test_nothing_left_is_what_even_odds_after_the_scan_say():
    assert probability_left(0.0) == 0.5
    assert probability_left(np.log(19)) == pytest.approx(0.05)
    assert probability_left(1e9) == pytest.approx(0.0, abs=1e-300)


def test_what_two_effects_explain_in_a_scan_is_what_no_effect_misses_there():
    """A lag is nearly all of the stake in its own scan; a pair's stake is beside what is common."""
    setup = world("lags")
    rivals = rival_set(setup, FORM, {frozenset(): 100.0, frozenset({"delay"}): 7.0})
    assert rivals.stake[0, 1] == 100.0 and [r.name for r in rivals.simpler] == ["none"]
    whitened, whitener, base, said = setup
    pair = dataclasses.replace(
        said[1], name="amplifier_lowpass+delay", effects=(*said[0].effects, *said[1].effects)
    )
    both = rival_set((whitened, whitener, base, [said[0], pair]), FORM, rivals_excess())
    assert both.stake[0, 1] == 7.0 and [r.name for r in both.simpler] == ["delay"]


def rivals_excess():
    return {frozenset(): 100.0, frozenset({"delay"}): 7.0}


def test_the_stake_of_a_scan_is_what_no_effect_could_not_follow_there():
    """By a joint refit of no effect to the old data and the scan, within the power's 10 %."""
    setup = world("lags")
    whitened, whitener, _, _ = setup
    rivals = rival_set(setup)
    (drive,) = triangle(60.0, amplitude=2.0, bias=3.0, samples=N * P, periods=P)
    drive = dataclasses.replace(drive, start_s=100.0)
    scan = Candidate("triangle", 60.0, 2.0, 3.0, drive)
    (found,) = rate_scans([scan], rivals, whitener, 1)
    (none,) = rivals.simpler
    prediction = found.predictions[0]
    first = linear_discrimination(prediction, found.batch.predict(none)[0])
    shown = refit_rival(found.batch, 0, prediction, none, first)
    assert found.stake[0, 1] == pytest.approx(shown, rel=0.1)
    assert found.stake[0, 1] > 30.0 * found.power((0, 1)) > 0.0


def test_equations_that_are_less_exact_leave_more_to_the_wrong_one():
    exact, inexact = (
        choose_next_scan(*world("lags"), tempering=Tempering(1.0, 4.0, form)) for form in (0.0, 0.1)
    )
    assert exact.left < inexact.left < 0.5
    assert exact.power >= 0.9 * inexact.power
