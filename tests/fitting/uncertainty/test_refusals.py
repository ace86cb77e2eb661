"""What is refused, by name: undetermined parameters, other losses, chains not to be trusted."""

import dataclasses

import linear_devices as linear
import numpy as np
import pytest

from fitting import (
    UntrustedPosterior,
    laplace_draws,
    nonlinearity_band,
    posterior_draws,
    profile_likelihood,
    sample_posterior,
)
from fitting.commands.shared._intervals import find_intervals
from fitting.uncertainty.bands._responses import draws_of
from fitting.uncertainty.posterior._convergence import failures, import_arviz
from rapi_jax import ModelError


@pytest.fixture(scope="module")
def result():
    return linear.fitted(linear.recording(3))


@pytest.fixture(scope="module")
def redundant():
    """Two plays with one threshold: only the sum of their weights is known."""
    return linear.fitted(linear.recording(3), r=(0.3, 0.3, 1.2))


def chains(change=lambda x: x, draws=500, diverging=0):
    rng = np.random.default_rng(0)
    x = change(rng.standard_normal((4, draws)))
    flags = np.zeros((4, draws), dtype=bool)
    flags[0, :diverging] = True
    return import_arviz().from_dict(posterior={"lam": x}, sample_stats={"diverging": flags})


def test_good_chains_pass():
    assert failures(chains()) == ()


def test_each_failure_is_named_with_its_cure():
    def apart(x):
        return x + np.array([[0.0], [0.0], [0.0], [1.0]])

    found = failures(chains(apart))
    assert any("R-hat of lam" in line and "`draws`" in line for line in found)
    (found,) = failures(chains(diverging=3))
    assert "3 divergent transitions" in found
    found = failures(chains(draws=50))
    assert any("bulk of lam" in line and "not more than 400" in line for line in found)


@pytest.mark.slow
def test_too_few_draws_are_refused_and_can_be_looked_at(result):
    with pytest.raises(UntrustedPosterior, match="independent draws") as caught:
        sample_posterior(result, draws=60)
    assert caught.value.posterior.posterior.sizes["draw"] == 60
    assert caught.value.reasons
    assert sample_posterior(result, draws=60, throw=False).posterior.sizes["draw"] == 60


def test_what_the_data_do_not_fix(redundant):
    found = profile_likelihood(redundant, ("p_1",))["p_1"]
    assert found.open_low and found.open_high and found.remark == "the data do not fix it"
    with pytest.raises(ModelError, match="do not fix p_1, p_2"):
        laplace_draws(redundant)
    with pytest.raises(ModelError, match="do not fix p_1, p_2"):
        sample_posterior(redundant)
    outcome = find_intervals(redundant, "posterior", lambda line: None)
    assert outcome.refused and "p_1, p_2" in outcome.content["refused"][0]


def test_other_losses_and_names(result):
    robust = dataclasses.replace(result, loss="huber")
    with pytest.raises(ModelError, match="'huber' has no likelihood"):
        profile_likelihood(robust)
    with pytest.raises(ModelError, match="no fitted parameter 'zeta'"):
        profile_likelihood(result, ("zeta",))
    with pytest.raises(ValueError, match="`level`"):
        profile_likelihood(result, level=95.0)
    with pytest.raises(ValueError, match="`draws`"):
        sample_posterior(result, draws=0)
    with pytest.raises(ValueError, match="`method`"):
        draws_of(result, "bootstrap", None, 10, 0)


def test_a_posterior_of_another_fit(result):
    with pytest.raises(ModelError, match="does not hold p_1"):
        posterior_draws(result, chains())


def test_values_are_found_in_double_precision_without_the_flag(result):
    import jax

    wanted = profile_likelihood(result, ("p_1",))["p_1"]
    with jax.enable_x64(False):
        found = profile_likelihood(result, ("p_1",))["p_1"]
        band = nonlinearity_band(result, linear.drives()[0], draws=20)
        assert not jax.config.jax_enable_x64
    assert found == wanted
    assert band.up.dtype == np.float64
    again = nonlinearity_band(result, linear.drives()[0], draws=20)
    assert np.array_equal(band.up, again.up)


def test_intervals_for_the_command_line(result):
    found = find_intervals(result, "gauss-newton", lambda line: None)
    low, high = found.ends["p_1"]
    assert low < result["p_1"].value < high and not found.refused
    assert set(found.ends) == set(linear.NAMES)
    assert found.table["intervals"]["method"] == "gauss-newton"
