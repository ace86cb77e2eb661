"""`diagnosis.json` as the contract has it: every key with its type, whatever the verdict."""

import json

import pytest
from diagnosis_contract import check
from edge_worlds import drives, record, wandering

from fitting.diagnosis import diagnose
from fitting.diagnosis._diagnosis import Diagnosis
from rapi_jax.effects import AmplifierLowpass, Etalon, Pickup
from rapi_jax.io import read_model

FEW = (AmplifierLowpass, Etalon)  # each class is compiled


@pytest.fixture(scope="module")
def truth() -> Etalon:
    return Etalon(amplitude=0.3, spacing=20.0, phase=0.4)


@pytest.fixture(scope="module")
def none() -> Diagnosis:
    return diagnose(None, record(drives()), candidates=FEW)


@pytest.fixture(scope="module")
def etalon(truth) -> Diagnosis:
    return diagnose(None, record(drives(), truth), candidates=FEW)


def test_none(none):
    out = check(none)
    assert (out["verdict"]["name"], out["verdict"]["effects"]) == ("none", [])
    assert out["gap"]["noise_floor"] == pytest.approx(0.02, rel=0.1)
    assert out["gap"]["structural"] < 0.01 and out["gap"]["parametric"] == 0.0
    assert not out["gap"]["significant"]
    assert out["shrinkage"]["closed_fraction"] is None  # there was no gap to close
    assert out["faults"] == []
    assert [size["effect"] for size in out["detectability"]] == [cls.name for cls in FEW]
    assert all(size["value"] > 0.0 for size in out["detectability"])


def test_one_effect(etalon, truth):
    """Its parameters within four standard errors; 95 % of the gap is closed at least."""
    out = check(etalon)
    assert out["verdict"]["name"] == "etalon"
    assert out["gap"]["significant"] and out["gap"]["structural"] > 0.1
    (found,) = [h for h in out["hypotheses"] if h["name"] == "etalon"]
    for name in ("amplitude", "spacing"):
        p = found["parameters"][name]
        assert abs(p["value"] - float(getattr(truth, name))) < 4.0 * p["stderr"], name
        assert p["unit"] == "GHz"
    assert found["closed_fraction"]["low"] > 0.95
    assert out["shrinkage"]["held_out"]
    assert [size["effect"] for size in out["detectability"]] == ["amplifier_lowpass"]
    assert out["verdict"]["mechanism"] == found["mechanism"] == "etalon"
    assert out["verdict"]["set"] == ["etalon"] and out["next_scan"] is None


def test_none_of_those_known():
    """Pickup between the lines of the scan, where no candidate could make it."""
    recording = record(drives(), Pickup(amplitude=0.3, hertz=333.0))
    out = check(diagnose(None, recording, candidates=FEW, scan=False))
    assert (out["verdict"]["name"], out["verdict"]["effects"]) == ("unlisted", [])
    assert out["gap"]["significant"]
    assert out["next_scan"] is None


@pytest.mark.slow
def test_nothing_repeats():
    """Noise is unknown: no floor, a note, and a wide verdict or none."""
    out = check(diagnose(None, record([wandering(), wandering()]), candidates=FEW, scan=False))
    assert out["gap"]["noise_floor"] is None and out["shrinkage"]["floor"] is None
    assert any("No run repeats" in note for note in out["notes"])
    assert out["verdict"]["name"] in ("none", "unlisted")


def test_files_hold_what_the_diagnosis_says(etalon, tmp_path):
    """JSON, a page, and the model that is loaded again with its effect."""
    paths = etalon.save(tmp_path / "new" / "folder", name="my <b>scan</b>")
    assert [p.name for p in paths] == ["diagnosis.json", "report.html", "model.rapi"]
    said = json.loads(paths[0].read_text(), parse_constant=pytest.fail)
    assert said["recording"].pop("name") == "my <b>scan</b>"
    assert set(said.pop("files")) == {"report.html", "model.rapi"}
    assert said == etalon.to_dict()
    assert "<b>scan</b>" not in paths[1].read_text()
    model, about = read_model(paths[2])
    assert [type(e) for e in model.effects] == [Etalon] and about["trusted"]
    assert float(model.effects[0].amplitude) == float(etalon.model.effects[0].amplitude)
    assert not list((tmp_path / "new" / "folder").glob(".tmp-*"))


def test_a_diagnosis_shows_itself(none, etalon):
    assert repr(none).startswith("<Diagnosis: none, probability")
    for one in (none, etalon):
        text = str(one)
        assert one.verdict.sentence.split(":")[0] in " ".join(text.split())
        assert "nan" not in text.lower().split()
        assert text == one.summary()
        assert one._repr_html_().startswith("<pre>")


@pytest.mark.slow
def test_a_diagnosis_is_the_same_when_run_again(none):
    again = diagnose(None, none.recording, candidates=FEW).to_dict()
    assert again | {"seconds": 0} == none.to_dict() | {"seconds": 0}
