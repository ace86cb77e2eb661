"""Which recordings, parameters and covariates a population is of, and what it says and writes."""

import dataclasses
import json

import numpy as np
import pytest
from populations import draw, random_between, record

from fitting import fit_population
from fitting.population._fit_population import fit_records
from fitting.report.population._files import write_population
from rapi_jax import DataError, ModelError, plot


def records(count=14, size=2, **more):
    rng = np.random.default_rng(21)
    return draw(rng, random_between(rng, size, "diagonal"), count=count, own=0.5, **more)


def replaced(found, at, **fields):
    out = list(found)
    out[at] = dataclasses.replace(out[at], **fields)
    return out


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"structure": (("operator", "RAPI"), ("plays", 8))}, "r003: plays 8, but r000 has 10"),
        ({"structure": (("operator", "PI"), ("plays", 10))}, "r003: operator PI, but r000 has"),
        ({"names": ("x0", "lam_1")}, "r003: its parameters are not those of r000"),
        ({"units": ("1", "V")}, "r003: its parameters are not those of r000"),
        ({"sha256": "r001"}, "r003: of the same recording as r001"),
        ({"recorded_at": None}, "r003: no `recorded_at`. Write `recorded_at = 2026-11-24T10"),
        ({"temperature_c": None}, "r003: no `temperature_c`. Write `temperature_c = 21.3`"),
    ],
)
def test_fits_that_do_not_go_together_are_refused(fields, words):
    with pytest.raises(DataError, match=words):
        fit_records(replaced(records(), 3, **fields))


def test_values_held_at_different_places_are_refused():
    held = np.array([False, True])
    found = [dataclasses.replace(r, held=held, values=np.r_[r.values[0], 3.0]) for r in records()]
    assert fit_records(found, drift="line").names == ("x0",)
    moved = replaced(found, 4, values=np.r_[found[4].values[0], 3.1])
    with pytest.raises(DataError, match=r"r004: `x1` was held at 3.1, but in r000 at 3"):
        fit_records(moved)


def test_too_few_are_refused():
    with pytest.raises(ModelError, match="2 trusted fits are too few: at least 5 are needed"):
        fit_records(records(2))
    with pytest.raises(ModelError, match="6 trusted fits are too few: at least 7 are needed"):
        fit_records(records(6))
    with pytest.raises(ModelError, match="no parameter `x7` to leave out; there are x0, x1"):
        fit_records(records(), without=("x7",))
    with pytest.raises(ValueError, match="`covariates` must be of time, temperature, but has 'age"):
        fit_records(records(), covariates=("age",))
    with pytest.raises(ValueError, match="`drift` must be one of line, smooth, auto"):
        fit_population([], drift="bent")


def test_a_covariate_that_nothing_is_known_of_is_noted():
    found = [dataclasses.replace(r, temperature_c=None) for r in records()]
    cold = fit_records(found, drift="line")
    assert cold.covariates.names == ("time",) and cold.parameters[0].temperature is None
    assert "no recording has `temperature_c`: nothing is said of temperature." in cold.notes
    found = [dataclasses.replace(r, temperature_c=21.0) for r in records()]
    assert any("the same temperature" in note for note in fit_records(found, drift="line").notes)
    bare = fit_records(found, covariates=())
    assert bare.parameters[0].time is None and not bare.notes
    assert bare.expectation().values[0] == pytest.approx(bare.parameters[0].mean.value)


def test_covariates_that_go_together_are_refused():
    days = np.arange(14.0)
    found = [
        dataclasses.replace(r, temperature_c=20.0 + day)
        for r, day in zip(records(days=days), days, strict=True)
    ]
    with pytest.raises(DataError, match="cannot be told apart"):
        fit_records(found)


def test_missing_estimates_say_nothing():
    """A parameter held in some recordings: as if these had infinite errors there."""
    found = records(20)
    at_bound = np.array([False, True])
    part = [dataclasses.replace(r, at_bound=at_bound) if i < 5 else r for i, r in enumerate(found)]
    missing = fit_records(part, drift="line", structure="full", keep_outliers=True)
    assert any("`x1` has no estimate in 5 of 20" in note for note in missing.notes)
    wide = [
        dataclasses.replace(r, stderr=r.stderr * [1.0, 1e6], correlation=np.eye(2)) if i < 5 else r
        for i, r in enumerate(found)
    ]
    same = fit_records(wide, drift="line", structure="full", keep_outliers=True)
    for one, other in zip(missing.parameters, same.parameters, strict=True):
        assert one.mean.value == pytest.approx(other.mean.value, rel=1e-4)
        assert one.scatter == pytest.approx(other.scatter, rel=1e-2)
    few = [dataclasses.replace(r, at_bound=at_bound) if i > 3 else r for i, r in enumerate(found)]
    left = fit_records(few, drift="line")
    assert left.names == ("x0",) and any("`x1` is left out" in note for note in left.notes)


def test_a_distribution_that_reaches_a_bound_is_noted():
    rng = np.random.default_rng(3)
    found = [
        record(
            np.abs(rng.normal(1.0, 1.0, 1)), [[1e-4]], label=f"{i}", bounds=np.array([[0.0], [9]])
        )
        for i in range(12)
    ]
    assert any("`x0` scatters up to a bound" in n for n in fit_records(found, covariates=()).notes)


@pytest.mark.slow
def test_a_curve_in_time_is_found_and_a_line_is_left_a_line():
    rng = np.random.default_rng(22)

    def curve(day):
        return np.array([3.0 * np.sin(day / 60.0), 0.0])

    bent = draw(rng, np.diag([0.25, 0.25]), count=40, own=0.3, curve=curve)
    found = fit_records(bent)
    assert found["x0"].smooth and not found["x1"].smooth and found["x0"].scatter < 1.0
    for day in (100.0, 200.0, 300.0):
        expected = found.expectation(days=day)
        first = (found.covariates.first - bent[0].recorded_at).total_seconds()
        assert first == 0.0
        true = 10.0 + curve(day + found_offset(bent))
        assert abs(expected.values[0] - true[0]) < 4.0 * expected.stderr[0]
    far = found.expectation(days=2000.0)
    assert far.stderr[0] > 3.0 * found.expectation(days=200.0).stderr[0]
    assert found.to_dict()["smooth"]["amplitudes"].keys() == {"x0"}
    straight = draw(rng, np.diag([0.25, 0.25]), count=40, own=0.3, per_day=0.02)
    line = fit_records(straight)
    assert line.selected.curves is None and line["x0"].time.p_holm < 1e-6
    assert fit_records(straight, drift="smooth")["x1"].smooth


def found_offset(found):
    from populations import FIRST

    return (found[0].recorded_at - FIRST).total_seconds() / 86400.0


def test_files_and_text(tmp_path):
    found = fit_records(records(), drift="line")
    written = write_population(found, tmp_path)
    assert [path.name for path in written] == ["population.json", "population.png"]
    content = json.loads((tmp_path / "population.json").read_text(), parse_constant=pytest.fail)
    assert content["schema"] == "rapi.population/1" and content["change"] is None
    assert set(content["files"]) == {"population.png"}
    first = content["parameters"]["x0"]
    assert {"mean", "per_day", "per_year", "per_kelvin", "scatter", "unit"} <= first.keys()
    assert first["per_year"]["value"] == pytest.approx(365.25 * first["per_day"]["value"])
    assert len(content["recordings"]) == 14 and content["recordings"][0]["parameters"]["x1"]
    text = found.summary()
    assert "Population of 14 recordings" in text and "Change a year" in text
    assert "Change a kelvin" in text and max(len(line) for line in text.split("\n")) <= 80


def test_a_panel_says_whether_its_parameter_drifts():
    rng = np.random.default_rng(3)
    records = draw(rng, np.diag([0.01, 0.01]), count=30, own=0.1, per_day=np.array([0.02, 0.0]))
    titles = [axis.get_title() for axis in plot.population(fit_records(records)).axes[:2]]
    assert titles[0].startswith("x0 drifts by +") and titles[0].endswith(" % in 30 days")
    assert titles[1] == "x1: no drift seen"
