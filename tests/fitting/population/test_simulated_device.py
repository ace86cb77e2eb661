"""A hundred recordings of one simulated device through real fits: its ageing, and a change."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from scipy import stats

from fitting import check_against, fit_many, fit_population
from rapi_jax import ECDL, RAPI, Recording, predict
from rapi_jax.examples import NOISE, paper_device, paper_drives

pytestmark = pytest.mark.slow

COUNT, NEW = 100, 30
SCATTER = 0.003  # relative, of every parameter
YEARLY = {"alpha": 0.02, "a": -0.015}  # relative, a year
WARM = {"d_1": 0.001}  # relative, a kelvin
FIRST = datetime(2026, 1, 1, 8, tzinfo=UTC)
CHANGED = {"a": 5.0, "lam": -5.0}  # in standard deviations of the scatter


def device(rng, day, warm, changes):
    """The paper's device on that day, at that temperature."""
    operator = paper_device().operator
    fields = {name: np.array(getattr(operator, name)) for name in
              ("alpha", "zeta", "lam", "eta", "a", "b", "d", "d_0")}  # fmt: skip
    for name, value in fields.items():
        factor = 1.0 + SCATTER * rng.standard_normal(value.shape)
        factor = factor + YEARLY.get(name, 0.0) * day / 365.25 + SCATTER * changes.get(name, 0.0)
        if name == "d":
            factor[0] += WARM["d_1"] * (warm - 21.0)
        fields[name] = value * (factor if name != "d_0" else 1.0)
    return ECDL(RAPI(**fields, plays=10))


def recording(rng, day, changes=None):
    warm = rng.normal(21.0, 1.0)
    one = device(rng, day, warm, changes or {})
    drives = paper_drives(samples=500)
    clean = [np.asarray(predict(one, drive)) for drive in drives]
    responses = [y + NOISE * rng.standard_normal(y.size) for y in clean]
    at = (FIRST + timedelta(days=float(day))).isoformat()
    return Recording.of(
        drives, responses, provenance={"recorded_at": at, "temperature_c": f"{warm:.3f}"}
    )


@pytest.fixture(scope="module")
def results():
    rng = np.random.default_rng(51)
    days = np.sort(rng.uniform(0.0, 365.0, COUNT + NEW))
    new = rng.permutation(COUNT + NEW)[:NEW]
    old = np.setdiff1d(np.arange(COUNT + NEW), new)
    recordings = [recording(rng, day) for day in np.r_[days[old], days[new]]]
    recordings += [recording(rng, 370.0, {name: size}) for name, size in CHANGED.items()]
    return fit_many(paper_device(), recordings)


@pytest.fixture(scope="module")
def population(results):
    return fit_population(results[:COUNT])


def test_the_fits_are_trusted(results):
    assert sum(result.verdict.trusted for result in results) >= 0.98 * len(results)


def test_ageing_is_recovered_and_nothing_else_drifts(population):
    truth = {p.name: p for p in population.parameters}
    paper = paper_device().operator
    values = {name: float(getattr(paper, name)) for name in ("alpha", "a")}
    values["d_1"] = float(paper.d[0])
    for name, share in YEARLY.items():
        drift = truth[name].per_year
        assert drift.low <= share * values[name] <= drift.high and drift.p_holm < 1e-3
    for name, share in WARM.items():
        warm = truth[name].temperature
        assert warm.low <= share * values[name] <= warm.high
    for p in population.parameters:
        if p.name not in YEARLY:
            assert p.time.p_holm > 0.01, p.name
        if p.name not in WARM:
            assert p.temperature.p_holm > 0.01, p.name
    assert not population.outliers


def test_the_scatter_is_recovered(population):
    """Of nine intervals of 95 % at most two miss."""
    paper = paper_device().operator
    missed = 0
    for p in population.parameters:
        base, _, power = p.name.partition("_")
        value = paper.d[int(power) - 1] if base == "d" else getattr(paper, base)
        missed += not p.scatter_low <= SCATTER * abs(float(value)) <= p.scatter_high
    assert missed <= 2


def test_unchanged_recordings_are_unchanged(population, results):
    changes = [check_against(population, r) for r in results[COUNT : COUNT + NEW]]
    assert stats.kstest([c.p_value for c in changes], "uniform").pvalue > 1e-3
    assert sum(c.changed for c in changes) <= 2


@pytest.mark.parametrize(("place", "name"), list(enumerate(CHANGED)))
def test_a_changed_device_is_found_and_named(population, results, place, name):
    change = check_against(population, results[COUNT + NEW + place])
    assert change.changed and change.set[0] == name, change.sentence
    assert change.probabilities[name] > 0.9
    value = float(getattr(paper_device().operator, name))
    expected = CHANGED[name] * SCATTER * value
    moved = change[name]
    assert abs(moved.change - expected) < 4.0 * moved.change_stderr
