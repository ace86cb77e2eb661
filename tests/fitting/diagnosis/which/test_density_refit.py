"""Effects refitted with a density of plays in place of the flexible base."""

import dataclasses

import numpy as np
import pytest
from edge_worlds import drives, record
from worlds import ordered

from fitting.blind.protocol._exchange import to_recording
from fitting.blind.simulator._simulated_device import draw_device
from fitting.diagnosis import diagnose
from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._density_refit import refit_on_density
from rapi_jax.effects import Delay

DELAY = Delay.at(tau=1e-4)


@pytest.fixture(scope="module")
def fitted():
    session = drives((10.0, 40.0), amplitudes=(3.0, 2.0))
    return fit_base(WhitenedModel.of(record(session, *ordered((DELAY,)))), None)


def test_the_effect_is_found_from_a_guess_where_the_base_ended_far_off(fitted):
    free, without = fitted.refit, fitted.state
    far = free.evaluate(without.values, (Delay.at(tau=4e-3),))
    on_base, density = refit_on_density(free, far, without, Delay.at(tau=8e-5))
    assert density is not None
    refit, end = density
    assert on_base.cost < far.cost
    assert float(end.effects[0].tau) == pytest.approx(1e-4, rel=0.05)
    assert end.synchronous < 1.2 * end.errors.synchronous.size
    _, alone = refit_on_density(free, without)
    assert alone is not None and end.cost < alone[1].cost and alone[1].effects == ()
    assert refit.log_determinant > 0.0


def test_costs_are_those_of_likelihoods(fitted):
    """Less a constant: `r' C^-1 r + log det C`, here with the covariance written out."""
    free, state = fitted.refit, fitted.state
    plain = free.evaluate(state.values, (DELAY,)).errors
    flexible = FlexibleBase.about(free, state)
    u, v = flexible.covariance.directions, flexible.covariance.variance
    finite = np.isfinite(v)
    left = plain.synchronous - u[:, ~finite] @ (u[:, ~finite].T @ plain.synchronous)
    covariance = np.eye(left.size) + (u[:, finite] * v[finite]) @ u[:, finite].T
    sign, log_determinant = np.linalg.slogdet(covariance)
    expected = left @ np.linalg.solve(covariance, left) + log_determinant
    expected += plain.nonsynchronous @ plain.nonsynchronous
    assert sign == 1.0
    assert flexible.marginal.evaluate(state.values, (DELAY,)).cost == pytest.approx(expected)


def test_a_candidate_counts_by_whichever_leaves_less(fitted):
    free, state = fitted.refit, fitted.state
    low, high = (free.evaluate(state.values, (Delay.at(tau=t),)) for t in (1e-4, 4e-3))
    assert low.cost < high.cost
    for search, density in ((low, high), (high, low)):
        found = Candidate((DELAY,), low, low, search, free, 1.0, (free, density))
        assert found.cost == low.cost and found.least == (free, low)
    assert Candidate((DELAY,), low, low, high, free, 1.0).least == (free, high)


def test_without_a_measured_noise_there_is_none(fitted):
    spectrum = dataclasses.replace(fitted.spectrum, measured=False)
    refit = dataclasses.replace(
        fitted.refit, whitener=fitted.refit.whitened.make_whitener(spectrum)
    )
    assert refit_on_density(refit, fitted.state) == (fitted.state, None)


@pytest.mark.slow
def test_an_effect_is_named_where_the_search_of_a_flexible_base_is_stuck():
    """It ends at 130 of chi-square a line with the amplitude law, and at 75 without any effect.

    In closed form the amplitude law leaves 1.05, and no effect 75.
    """
    device = draw_device(3237685900, "form", "amplitude_law", 16.702, base_misfit=True)
    found = diagnose(None, to_recording(device.runs), scan=False)
    assert found.verdict.name == "amplitude_law"
