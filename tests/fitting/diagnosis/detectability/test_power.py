"""What must be taken away to be named, against the noncentral chi-square distribution."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import ncx2

from fitting.diagnosis.detectability._power import Demand
from fitting.diagnosis.detectability._thresholds import THRESHOLDS as SEEN
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.evidence._calibration import load_calibration

SIZES = (1000, 3000)


@pytest.mark.parametrize("law", [False, True])
@pytest.mark.parametrize("parameters", [1, 3, 5])
def test_enough_is_named_with_95_percent(parameters, law):
    calibration = load_calibration()
    demand = Demand.of((1000.0, 3000.0), SIZES, calibration, parameters=parameters, law=law)
    named = calibration.parameter * np.log(4000) * parameters + 2 * calibration.chance
    named += 2 * calibration.law * law
    fall = max(named, THRESHOLDS.chance_fall)
    assert ncx2.sf(fall, parameters, SEEN.found * demand.either) == pytest.approx(0.95, abs=1e-6)
    assert demand.share(demand.either, 0.0) == pytest.approx(1.0)
    assert demand.share(0.0, demand.either) == pytest.approx(1.0)


def test_beside_base_misfit_more_is_demanded():
    calibration = load_calibration()
    fits, misfits = (
        Demand.of((x, 3000.0), SIZES, calibration, parameters=1) for x in (900.0, 2000.0)
    )
    assert misfits.share(100.0, 0.0) == pytest.approx(fits.share(100.0, 0.0) / 2)
    assert misfits.share(0.0, 100.0) == pytest.approx(fits.share(0.0, 100.0))


def test_a_second_effect_must_first_leave_too_much():
    calibration = load_calibration()
    first = Demand.of((1000.0, 3000.0), SIZES, calibration, parameters=1)
    second = Demand.of((1000.0, 3000.0), SIZES, calibration, parameters=1, explained=0.0)
    assert second.share(first.either, 0.0) < 1.0
    costly = dataclasses.replace(calibration, second=0.01)
    more = Demand.of((1000.0, 3000.0), SIZES, costly, parameters=1, explained=1e5)
    assert more.either > second.either + 900.0
    limit = THRESHOLDS.explained_synchronous * 1000 + (
        THRESHOLDS.explained_synchronous_sigmas + 1.645
    ) * np.sqrt(2000)
    assert second.share(limit - 1000.0, 0.0) == pytest.approx(1.0, rel=1e-3)
    without = Demand.of((1000.0, 0.0), (1000, 0), calibration, parameters=1, explained=0.0)
    assert without.share(1e6, 0.0) > 1.0
