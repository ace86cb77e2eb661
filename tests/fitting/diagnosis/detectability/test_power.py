"""What must be taken away to be named, against the noncentral chi-square distribution."""

import numpy as np
import pytest
from scipy.stats import ncx2

from fitting.diagnosis.detectability._absorbed import AbsorbedByBase
from fitting.diagnosis.detectability._power import Demand
from fitting.diagnosis.detectability._thresholds import THRESHOLDS as SEEN
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.evidence._calibration import load_calibration

SIZES = (1000, 3000)


@pytest.mark.parametrize("parameters", [1, 3, 5])
def test_enough_is_named_with_95_percent(parameters):
    calibration = load_calibration()
    demand = Demand.of((1000.0, 3000.0), SIZES, calibration, parameters=parameters, second=False)
    named = calibration.parameter * np.log(4000) * parameters + 2 * calibration.chance
    fall = max(named, THRESHOLDS.chance_fall)
    assert ncx2.sf(fall, parameters, SEEN.found * demand.either) == pytest.approx(0.95, abs=1e-6)
    assert demand.share(demand.either, 0.0) == pytest.approx(1.0)
    assert demand.share(0.0, demand.either) == pytest.approx(1.0)


def test_beside_base_misfit_more_is_demanded():
    calibration = load_calibration()
    fits, misfits = (
        Demand.of((x, 3000.0), SIZES, calibration, parameters=1, second=False)
        for x in (900.0, 2000.0)
    )
    assert misfits.share(100.0, 0.0) == pytest.approx(fits.share(100.0, 0.0) / 2)
    assert misfits.share(0.0, 100.0) == pytest.approx(fits.share(0.0, 100.0))


def test_a_second_effect_must_first_leave_too_much():
    calibration = load_calibration()
    first = Demand.of((1000.0, 3000.0), SIZES, calibration, parameters=1, second=False)
    second = Demand.of((1000.0, 3000.0), SIZES, calibration, parameters=1, second=True)
    assert second.share(first.either, 0.0) < 1.0
    limit = THRESHOLDS.explained_synchronous * 1000 + (
        THRESHOLDS.explained_synchronous_sigmas + 1.645
    ) * np.sqrt(2000)
    assert second.share(limit - 1000.0, 0.0) == pytest.approx(1.0, rel=1e-3)
    without = Demand.of((1000.0, 0.0), (1000, 0), calibration, parameters=1, second=True)
    assert without.share(1e6, 0.0) > 1.0


def test_what_a_base_with_priors_leaves_is_that_of_a_least_squares_fit():
    rng = np.random.default_rng(3)
    jacobian, signature = rng.normal(size=(40, 4)), rng.normal(size=40)
    std = np.array([0.1, 2.0, np.inf, np.inf])
    left = AbsorbedByBase.of(jacobian * [1, 1, 1, 0], std).left(signature)
    rows = np.vstack([jacobian[:, :3], np.diag(1.0 / std[:3])])
    target = np.concatenate([signature, np.zeros(3)])
    fitted = np.linalg.lstsq(rows, target, rcond=None)
    assert left == pytest.approx(float(fitted[1][0]), rel=1e-9)
