"""The standard error of an effect beside plays that are not those of the identified operator."""

import dataclasses

import numpy as np
import pytest

from fitting.diagnosis import diagnose
from fitting.diagnosis.refit.estimates._misfit_errors import clustered_errors
from rapi_jax import ECDL, PI, Recording, predict, triangle
from rapi_jax.effects import Delay

TAU = 5e-5  # s


def recorded(seed: int) -> Recording:
    """A classical operator of weights drawn play by play, and a delay; white noise of 20 MHz."""
    rng = np.random.default_rng(seed)
    r = np.linspace(0.05, 2.0, 12)
    p = 0.9 * rng.uniform(0.2, 1.0, 12) * np.exp(-r / rng.uniform(0.5, 2.0))
    drives, start = [], 0.0
    for amplitude in (3.0, 4.5):
        for hz in (10.0, 20.0, 40.0):
            (drive,) = triangle(hz, amplitude=amplitude, bias=3.0, samples=2000, periods=4)
            drives.append(dataclasses.replace(drive, start_s=start))
            start += 4.0 / hz + 0.2
    device = ECDL(PI(r=r, p=p, d=(14.0, -0.4, 0.01)), (Delay.at(tau=TAU),))
    clean = [np.asarray(predict(device, drive)) for drive in drives]
    return Recording.of(drives, [y + 0.02 * rng.standard_normal(y.size) for y in clean])


@pytest.mark.parametrize("seed", [0, 1])
def test_the_interval_of_a_delay_holds_it_where_the_base_misfits(seed):
    """With residuals taken for white the delay is off by 2.5 and 5.4 standard errors here."""
    found = diagnose(None, recorded(seed), candidates=(Delay,), scan=False)
    (entry,) = [one for one in found.content["hypotheses"] if one["name"] == "delay"]
    tau = entry["parameters"]["tau"]
    assert found.verdict.name == "delay"
    assert abs(tau["value"] - TAU) < 2.6 * tau["stderr"]  # 99 %
    assert tau["stderr"] < 0.03 * TAU


def test_clustered_errors_are_the_scatter_of_estimates():
    """Regression with one error common to each of 12 groups, against 2000 repetitions of it."""
    rng = np.random.default_rng(0)
    group = np.repeat(np.arange(12), 25)
    x = np.column_stack([np.ones(300), group % 4 + 0.1 * rng.standard_normal(300)])
    x = np.column_stack([x, rng.standard_normal(300)])
    solve = np.linalg.pinv(x)
    estimates, stated = [], []
    for _ in range(2000):
        error = rng.standard_normal(12)[group] + 0.3 * rng.standard_normal(300)
        found = solve @ error
        estimates.append(found)
        stated.append(clustered_errors(x, np.zeros(3), x @ found - error, group) ** 2)
    scatter, mean = np.std(estimates, axis=0), np.sqrt(np.mean(stated, axis=0))
    white = 1.04 * np.sqrt(np.diag(np.linalg.inv(x.T @ x)))
    assert mean == pytest.approx(scatter, rel=0.15)
    assert scatter[1] > 3.0 * white[1]  # what errors taken for white would state
    assert np.isinf(clustered_errors(np.c_[x, np.zeros(300)], np.zeros(4), error, group)[3])
