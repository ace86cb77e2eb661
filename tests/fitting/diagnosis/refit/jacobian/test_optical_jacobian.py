"""Columns behind optical effects against a directional derivative of the effect itself."""

import jax
import numpy as np
import pytest
from edge_worlds import drives, record

from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.refit.jacobian._operator_jacobian import Linearised
from fitting.diagnosis.refit.jacobian._optical_jacobian import linearise_optical_effects
from rapi_jax.effects import (
    ALL,
    AbstractCouplingEffect,
    AbstractLinearEffect,
    AbstractOpticalEffect,
    CurrentCoupling,
    Drift,
    Etalon,
    GainDrift,
    ModeHop,
    Pickup,
)
from rapi_jax.internal import optical_side

STRONG = (
    Etalon.at(amplitude=0.6, spacing=9.0, phase=0.3, sharpness=0.4),
    Drift.at(amplitude=0.5, tau=0.2),
    Pickup.at(amplitude=0.3, hertz=53.0),
    CurrentCoupling.at(coupling=3e-3, lag_s=1e-3),
    ModeHop.at(size=1.5, threshold=30.0, width=4.0),
    ModeHop.at(size=1.5, threshold=30.0, width=4.0, settle_s=2e-3),
    GainDrift.at(rate=0.2, tau=0.5),
)


@pytest.fixture(scope="module")
def session():
    return WhitenedModel.of(record(drives(periods=2))).grids.session


def test_every_optical_effect_that_is_not_linear_is_here():
    behind = [
        e
        for e in ALL
        if issubclass(e, AbstractOpticalEffect | AbstractCouplingEffect)
        and not issubclass(e, AbstractLinearEffect)
    ]
    assert set(behind) == {type(effect) for effect in STRONG}


@pytest.mark.parametrize("effect", STRONG, ids=lambda e: f"{e.name}-{getattr(e, 'settle_s', 0)}")
@pytest.mark.parametrize("count", [1, 5, 70])
def test_columns_are_directional_derivatives(effect, count, session):
    rng = np.random.default_rng(count)
    nu = 11.0 * np.asarray(session.node_u)[:, np.asarray(session.place)[0]]
    columns = rng.normal(size=(count, *nu.shape))
    found = linearise_optical_effects([effect], session, Linearised(nu, columns))
    assert found.shape == columns.shape
    for column, got in zip(columns[:3], found[:3], strict=False):
        _, want = jax.jvp(lambda x: optical_side((effect,), session, x), (nu,), (column,))
        np.testing.assert_allclose(got, want, rtol=1e-12, atol=1e-12)


def test_effects_follow_one_another(session):
    """The second sees what the first makes of the response."""
    nu = 11.0 * np.asarray(session.node_u)[:, np.asarray(session.place)[0]]
    column = np.random.default_rng(0).normal(size=(1, *nu.shape))
    pair = (STRONG[0], STRONG[-1])
    found = linearise_optical_effects(pair, session, Linearised(nu, column))
    _, want = jax.jvp(lambda x: optical_side(pair, session, x), (nu,), (column[0],))
    np.testing.assert_allclose(found[0], want, rtol=1e-12, atol=1e-12)
