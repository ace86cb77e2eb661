"""Grids of a recording: effects see the same drives on whatever nodes these stand."""

import jax.numpy as jnp
import numpy as np
import pytest
from edge_worlds import drives, record

from fitting.diagnosis.refit._compiled_stages import apply_drive_effect, apply_optical_effect
from fitting.diagnosis.refit._sampling_grids import nodes_alone
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax.effects import AmplifierLowpass, Creep, CurrentCoupling, Resonance, SlewLimit
from rapi_jax.internal import drive_side, optical_side


@pytest.fixture(scope="module")
def grids():
    return WhitenedModel.of(record(drives((10.0, 25.0), samples=160))).grids


@pytest.mark.parametrize(
    "effect",
    [
        CurrentCoupling.at(coupling=0.01),
        CurrentCoupling.at(coupling=0.01, lag_s=1e-3),
        Resonance.at(hertz=120.0, damping=0.1, share=0.5),
        Creep.at(gain=0.05),
    ],
    ids=["coupling", "lagged coupling", "resonance", "creep"],
)
def test_an_effect_behind_the_operator_needs_the_samples_alone(effect, grids):
    samples = grids.samples
    assert samples.node_u.shape == samples.time.shape
    steps = np.random.default_rng(0).normal(size=samples.time.shape)
    nu = jnp.asarray(np.cumsum(steps, axis=1))
    alone = np.asarray(apply_optical_effect(effect, samples, nu))
    for drives_ in (grids.session, grids.period, grids.session_with_spare_nodes):
        assert not np.array_equal(drives_.node_u, samples.node_u)
        np.testing.assert_allclose(alone, optical_side((effect,), drives_, nu), rtol=1e-9)


@pytest.mark.parametrize("effect", [AmplifierLowpass.at(tau=1e-3), SlewLimit.at(limit=50.0)])
def test_an_effect_on_the_drive_needs_the_nodes_alone(effect, grids):
    for drives_ in (grids.session, grids.session_with_spare_nodes):
        behind, least = apply_drive_effect(effect, nodes_alone(drives_))
        expected = drive_side((effect,), drives_)
        np.testing.assert_allclose(behind.node_u, expected.node_u, rtol=1e-12)
        np.testing.assert_allclose(behind.node_time, expected.node_time, rtol=1e-12)
        np.testing.assert_allclose(least, np.asarray(expected.node_u).min(axis=1), rtol=1e-12)
