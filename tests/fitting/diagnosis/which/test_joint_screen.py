"""Two effects that all but cancel: found together, in closed form, where neither leads alone."""

import numpy as np
import pytest
from edge_worlds import drives, record
from scipy.optimize import nnls
from worlds import ordered

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._forward_selection import without_effects
from fitting.diagnosis.which.refits._density_refit import refit_about_or_on_density
from fitting.diagnosis.which.refits._joint_refit import refit_pairs_at_once
from fitting.diagnosis.which.screening._joint_screen import _joint_falls, screen_pairs
from fitting.diagnosis.which.screening._screen import initial_guesses
from rapi_jax.effects import ALL, AmplifierLowpass, CurrentCoupling

LAG = AmplifierLowpass.at(tau=7e-5)
LEAD = CurrentCoupling.at(coupling=7e-4, lag_s=6e-5)


@pytest.fixture(scope="module")
def cancelling():
    session = drives((30.0, 120.0), amplitudes=(3.6, 2.0), samples=300)
    return fit_base(WhitenedModel.of(record(session, *ordered((LAG, LEAD)))), None)


@pytest.fixture(scope="module")
def none(cancelling):
    return without_effects(cancelling.refit, cancelling.state, cancelling.eta_fixed[1])


def test_falls_are_those_of_least_squares_with_sizes_that_are_not_negative():
    rng = np.random.default_rng(3)
    signatures = rng.normal(size=(7, 40))
    signatures[1] = signatures[0] - 0.3 * signatures[1]  # nearly along each other
    signatures /= np.linalg.norm(signatures, axis=1)[:, None]
    left = -signatures.T @ rng.uniform(-0.5, 2.0, 7) + 0.3 * rng.normal(size=40)
    falls = _joint_falls(signatures, left, ~np.eye(7, dtype=bool))
    seen = 0
    for i in range(7):
        for j in range(7):
            size, rest = nnls(signatures[[i, j]].T, -left)
            both = i != j and bool((size > 1e-12).all())
            expected = float(left @ left - rest**2) if both else 0.0
            assert falls[i, j] == pytest.approx(expected, abs=1e-9)
            seen += both
    assert 10 < seen < 42


def test_the_two_explain_most_together(cancelling, none):
    start = none.on_base
    guesses = initial_guesses(*cancelling.eta_fixed, ALL)
    flexible = FlexibleBase.about(cancelling.refit, start)
    first, *_ = screen_pairs(cancelling.refit, start, flexible, guesses)
    assert {effect.name for effect in first} == {LAG.name, LEAD.name}


def test_refitted_at_once_they_leave_noise(cancelling, none):
    guesses = initial_guesses(*cancelling.eta_fixed, (AmplifierLowpass, CurrentCoupling))
    (pair,) = refit_pairs_at_once(cancelling.refit, none, guesses)
    lag, lead = sorted(pair.effects, key=lambda effect: effect.name)
    lines = pair.on_flexible_base.errors.synchronous.size
    assert pair.on_flexible_base.synchronous < 1.2 * lines < none.on_flexible_base.synchronous
    assert float(lag.tau) == pytest.approx(7e-5, rel=0.1)
    assert float(lead.coupling) == pytest.approx(7e-4, rel=0.1)


def test_a_base_that_ends_far_off_is_not_kept(cancelling, none):
    """At least as little is left as by the density about the base without effects."""
    start = none.on_base
    marginal = FlexibleBase.about(cancelling.refit, start).marginal
    state = marginal.evaluate(start.values, (AmplifierLowpass.at(tau=2e-5),))
    _, _, end = refit_about_or_on_density(cancelling.refit, marginal, state, none)
    assert end.cost <= state.cost
