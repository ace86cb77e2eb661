"""What a new recording changed, at the level of numbers."""

import dataclasses

import numpy as np
import pytest
from populations import draw, random_between, record
from scipy import stats

from fitting.population._change import change_probabilities, credible_changes
from fitting.population._check_against import check_record
from fitting.population._fit_population import fit_records
from fitting.population._thresholds import THRESHOLDS
from rapi_jax import DataError, ModelError

SIZE, DRIFT = 3, np.array([0.01, 0.0, 0.0])


def device(rng, count=31, own=0.5, kind="diagonal", **more):
    between = random_between(rng, SIZE, kind)
    records = draw(rng, between, count=count, own=own, per_day=DRIFT, per_kelvin=0.3, **more)
    return between, records


@pytest.fixture(scope="module")
def population():
    """A device, a recording of its like, and the covariance between recordings."""
    rng = np.random.default_rng(11)
    between, records = device(rng, count=32)
    new = dataclasses.replace(records.pop(20), label="new")
    return fit_records(records), new, between


def changed(new, name, amount):
    values = new.values.copy()
    values[int(name[1:])] += amount
    return dataclasses.replace(new, values=values)


def test_an_unchanged_device_is_unchanged(population):
    found, new, _ = population
    change = check_record(found, new)
    assert not change.changed and change.sentence.startswith("unchanged: as the population")
    assert change.probabilities["none"] > 0.5
    assert sum(change.probabilities.values()) == pytest.approx(1.0)
    assert change.days == pytest.approx(found.covariates.days(new.recorded_at))
    content = change.to_dict()
    assert content["schema"] == "rapi.change/1" and set(content["parameters"]) == set(found.names)


@pytest.mark.parametrize("name", ["x0", "x1", "x2"])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_changed_parameter_is_named_with_its_size(population, name, sign):
    """A change of eight standard deviations of what is expected of it."""
    found, new, between = population
    j = int(name[1:])
    base = check_record(found, new)
    spread = np.hypot(base[name].expected_stderr, base[name].stderr)
    change = check_record(found, changed(new, name, sign * 8.0 * spread))
    assert change.changed and change.set == (name,)
    assert change.probabilities[name] > 0.95
    moved = change[name]
    assert abs(moved.change - sign * 8.0 * spread) < 4.0 * moved.change_stderr
    assert f"`{name}` by {'+' if sign > 0 else '-'}" in change.sentence
    assert change.sentence.endswith("; all else as before")
    assert between[j, j] > 0


def test_several_changes_are_not_blamed_on_one(population):
    found, new, _ = population
    for name in ("x0", "x1"):
        base = check_record(found, new)
        spread = np.hypot(base[name].expected_stderr, base[name].stderr)
        new = changed(new, name, 20.0 * spread)
    change = check_record(found, new)
    assert change.set == ("several",)
    for name in ("x0", "x1"):
        assert f"`{name}` by +" in change.sentence
    assert "`x2`" not in change.sentence


def test_a_pair_that_one_recording_cannot_tell_apart_is_named_as_such():
    """Errors that trade two parameters: a moderate change along them may be of either."""
    rng = np.random.default_rng(12)
    errors = np.array([[1.0, 0.999], [0.999, 1.0]])
    count = 30
    values = 10.0 + rng.multivariate_normal([0, 0], errors, count)
    records = [record(v, errors, label=f"{i}") for i, v in enumerate(values)]
    found = fit_records(records, covariates=())
    off = 10.0 + np.array([0.2, -0.2])  # across the common direction: as of either alone
    change = check_record(found, record(off, errors, label="new"))
    assert change.changed and set(change.set) >= {"x0", "x1"}
    assert "which this recording cannot tell apart" in change.sentence


def test_the_change_of_correlated_parameters_is_given_the_others():
    """`change` is the estimate by generalised least squares, all else held."""
    rng = np.random.default_rng(13)
    records = draw(rng, np.diag([1.0, 1.0]) * 1e-6, count=30, own=1.0)
    found = fit_records(records[1:], covariates=(), drift="line")
    new = records[0]
    change = check_record(found, new)
    own = new.covariance + np.diag([p.scatter**2 for p in found.parameters])
    mean = np.array([p.mean.value for p in found.parameters])
    inverse = np.linalg.inv(own)
    for j, name in enumerate(found.names):
        expected = (inverse @ (new.values - mean))[j] / inverse[j, j]
        assert change[name].change == pytest.approx(expected, abs=0.05 * change[name].change_stderr)


def test_probabilities_are_those_of_normal_models():
    """With a known variance, against densities written out."""
    rng = np.random.default_rng(14)
    half = rng.standard_normal((3, 3))
    v = half @ half.T + np.eye(3)
    d = rng.multivariate_normal(np.zeros(3), 4.0 * v)
    inverse = np.linalg.inv(v)
    z = inverse @ d / np.sqrt(np.diag(inverse))
    found = change_probabilities(["a", "b", "c"], z, float(d @ inverse @ d), np.inf)
    normal = stats.multivariate_normal
    expected = {"none": 0.5 * normal.pdf(d, cov=v), "several": 0.0}
    sizes = THRESHOLDS.change_sizes
    for j, name in enumerate("abc"):
        e = np.zeros(3)
        e[j] = 1.0 / np.sqrt(inverse[j, j])
        pdf = [normal.pdf(d, cov=v + k**2 * np.outer(e, e)) for k in sizes]
        expected[name] = 0.4 / 3.0 * np.mean(pdf)
    expected["several"] = 0.1 * np.mean([normal.pdf(d, cov=(1 + k**2) * v) for k in sizes])
    total = sum(expected.values())
    assert found == pytest.approx({name: p / total for name, p in expected.items()})
    assert credible_changes({"none": 0.9, "a": 0.06, "b": 0.039, "several": 0.001}) == ("a", "b")


def test_a_missing_parameter_is_not_looked_at(population):
    found, new, _ = population
    held = dataclasses.replace(new, held=np.array([False, True, False]))
    change = check_record(found, changed(held, "x0", 30.0))
    assert change.set == ("x0",) and np.isnan(change["x1"].measured)
    assert any("no estimate of x1" in note for note in change.notes)
    with pytest.raises(ModelError, match="no estimate of any parameter"):
        check_record(found, dataclasses.replace(new, held=np.ones(SIZE, dtype=bool)))


def test_what_cannot_be_checked_is_refused(population):
    found, new, _ = population
    with pytest.raises(ModelError, match="not to be trusted.*: no convergence"):
        check_record(found, dataclasses.replace(new, trusted=False, reasons=("no convergence",)))
    inside = found.estimates.records[3]
    with pytest.raises(DataError, match=f"{inside.label}: this recording is one of the population"):
        check_record(found, inside)
    with pytest.raises(DataError, match="new: no `temperature_c`. Write `temperature_c = 21.3`"):
        check_record(found, dataclasses.replace(new, temperature_c=None))


def test_a_recording_beyond_the_population_is_said_to_be(population):
    found, new, _ = population
    late = dataclasses.replace(new, recorded_at=new.recorded_at.replace(year=2029))
    change = check_record(found, late)
    assert any("beyond the population's" in note for note in change.notes)
    inside = check_record(found, new)
    assert change["x1"].expected_stderr > inside["x1"].expected_stderr


@pytest.mark.parametrize("name", ["x0", "x2"])
def test_an_outlier_is_reported_and_left_out(name):
    rng = np.random.default_rng(15)
    _, records = device(rng)
    clean = fit_records(records, drift="line")
    spoiled = list(records)
    for at in (7, 8):  # two alike, so that each hides the other
        spoiled[at] = changed(records[at], name, 30.0)
    found = fit_records(spoiled, drift="line")
    assert [one.label for one in found.outliers] == ["r007", "r008"]
    assert all(one.p_holm < 0.01 for one in found.outliers)
    assert found[name].scatter == pytest.approx(clean[name].scatter, rel=0.15)
    kept = fit_records(spoiled, drift="line", keep_outliers=True)
    assert not kept.outliers and kept[name].scatter > 3.0 * clean[name].scatter
    assert "r007 is an outlier" in found.summary()
    check_record(found, spoiled[7])  # no part of it, so it may be held against it


def test_a_device_that_changed_in_between_is_no_series_of_outliers():
    rng = np.random.default_rng(16)
    _, records = device(rng)
    after = [changed(r, "x1", 40.0) if i >= 21 else r for i, r in enumerate(records)]
    found = fit_records(after, drift="line")
    assert len(found.outliers) == 0 or len(found.outliers) <= 6
    if not found.outliers:
        assert found["x1"].scatter > 5.0 or found["x1"].time.p_holm < 0.01
