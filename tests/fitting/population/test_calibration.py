"""Intervals cover what they claim and p-values are uniform, over fresh devices without change."""

import dataclasses

import numpy as np
import pytest
from populations import FIRST, draw, random_between
from scipy import stats

from fitting.population._check_against import check_record
from fitting.population._fit_population import fit_records

DRIFT, WARM = np.array([0.01, 0.0, 0.0]), np.array([0.3, 0.0, -0.2])


def simulate(kind, own, *, seed, replicates, count, size=3):
    """P-values of new recordings and what intervals cover, over `replicates` devices."""
    p_values, changed, covered = [], [], {"mean": [], "time": [], "warm": [], "scatter": []}
    for i in range(replicates):
        rng = np.random.default_rng([seed, i])
        between = random_between(rng, size, kind)
        records = draw(
            rng, between, count=count + 1, own=own, per_day=DRIFT[:size], per_kelvin=WARM[:size]
        )
        new = dataclasses.replace(records.pop(int(rng.integers(count + 1))), label="new")
        found = fit_records(records, drift="line")
        change = check_record(found, new)
        p_values.append(change.p_value)
        changed.append(change.changed)
        begin = (found.covariates.first - FIRST).total_seconds() / 86400.0
        day, warm = found.covariates.means
        mean = 10.0 + DRIFT * (begin + day) + WARM * (warm - 21.0)
        for j, p in enumerate(found.parameters):
            for name, effect, true in (
                ("mean", p.mean, mean[j]),
                ("time", p.time, DRIFT[j]),
                ("warm", p.temperature, WARM[j]),
            ):
                covered[name].append(effect.low <= true <= effect.high)
            scatter = np.sqrt(between[j, j])
            covered["scatter"].append(p.scatter_low <= scatter <= p.scatter_high)
    return np.array(p_values), np.array(changed), covered


def check(p_values, changed, covered, *, size=3):
    """Held against chance alone: one test in a thousand is off by itself."""
    count = len(p_values)
    assert stats.kstest(p_values, "uniform").pvalue > 1e-3
    # Of the parameters of a device some go together, so that as few as devices count.
    slack = 3.3 * np.sqrt(0.95 * 0.05 / count)
    for name, found in covered.items():
        assert abs(np.mean(found) - 0.95) < slack, name
    assert changed.sum() <= stats.binom.ppf(0.999, count, 0.01)
    assert len(covered["mean"]) == count * size


def test_a_few_devices():
    check(*simulate("diagonal", 0.5, seed=41, replicates=12, count=20))


@pytest.mark.calibration
@pytest.mark.parametrize(
    ("kind", "own"), [("diagonal", 0.5), ("full", 0.1), ("factor", 0.3), ("full", 1.0)]
)
def test_many_devices(kind, own):
    check(*simulate(kind, own, seed=42, replicates=500, count=40))


@pytest.mark.calibration
def test_without_any_scatter_changes_are_found_less_often():
    """At the bound of the variance p-values are too large, never too small."""
    p_values, changed, covered = simulate("none", 1.0, seed=43, replicates=300, count=40)
    assert stats.kstest(p_values, "uniform", alternative="greater").pvalue > 1e-3
    assert changed.sum() <= stats.binom.ppf(0.999, 300, 0.01)
    assert all(np.mean(found) > 0.91 for found in covered.values())
