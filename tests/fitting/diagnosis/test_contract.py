"""`diagnosis.json` as the contract has it: every key with its type, whatever the verdict."""

import json
import math
from typing import Any

import pytest
from edge_worlds import drives, record, wandering

from fitting.diagnosis import diagnose
from fitting.diagnosis._diagnosis import Diagnosis
from rapi_jax.effects import AmplifierLowpass, Etalon, Pickup
from rapi_jax.io import read_model

FEW = (AmplifierLowpass, Etalon)  # each class is compiled
NUMBER, FRACTION = (float, int), {"value": float, "low": float, "high": float}
GAP = {"total": float, "noise_floor": (float, None), "parametric": float, "structural": float}
WHERE = {
    "run": int,
    "excitation_hz": (float, None),  # None: the drive is not periodic
    "direction": str,
    "region": str,
    "rms": float,
    "share": float,
}
SCAN = {
    "waveform": str,
    "excitation_hz": float,
    "amplitude": float,
    "bias": float,
    "separates": [str],
}
WHOLE = {
    "schema": str,
    "unit": str,
    "gap": GAP,
    "where": [WHERE],
    "hypotheses": [{"effects": [str], "name": str, "probability": float}],
    "verdict": {"name": str, "effects": [str], "set": [str], "reason": str},
    "shrinkage": {
        "before": float,
        "after": float,
        "floor": (float, None),
        "closed_fraction": (FRACTION, None),
        "held_out": [str],
    },
    "next_scan": (SCAN, None),
    "seconds": float,
    "versions": dict,
    "data_sha256": str,
    "notes": [str],
    "faults": [{"kind": str, "run": str, "message": str}],
}
NAMED = {
    "survival": float,
    "parameters": dict,
    "closed_fraction": (FRACTION, None),
}


def fits(value: Any, kind: Any, at: str = "") -> None:
    """Assert that `value` is of `kind`: a type, a dict of kinds, a list of one, or any of some."""
    if isinstance(kind, tuple):
        if value is None:
            assert None in kind, at
            return
        (kind,) = [k for k in kind if k is not None]
    if isinstance(kind, dict):
        assert isinstance(value, dict), at
        assert kind.keys() <= value.keys(), f"{at}: {kind.keys() - value.keys()} missing"
        for key, own in kind.items():
            fits(value[key], own, f"{at}.{key}")
    elif isinstance(kind, list):
        assert isinstance(value, list), at
        for i, one in enumerate(value):
            fits(one, kind[0], f"{at}[{i}]")
    else:
        assert type(value) is kind, f"{at}: {value!r} is no {kind.__name__}"


def check(diagnosis: Diagnosis) -> dict[str, Any]:
    """What holds of every diagnosis; the dictionary as a strict reader of the file sees it."""
    out = json.loads(json.dumps(diagnosis.to_dict(), allow_nan=False), parse_constant=pytest.fail)
    assert out == diagnosis.to_dict()
    fits(out, WHOLE)
    assert out["schema"] == "rapi.diagnosis/1"
    gap = out["gap"]
    parts = gap["parametric"] ** 2 + gap["structural"] ** 2 + (gap["noise_floor"] or 0.0) ** 2
    assert gap["total"] ** 2 == pytest.approx(parts, rel=1e-9)
    hypotheses, verdict = out["hypotheses"], out["verdict"]
    chance = [h["probability"] for h in hypotheses]
    assert math.fsum(chance) == pytest.approx(1.0, abs=1e-9)
    assert all(0.0 <= p <= 1.0 for p in chance) and chance == sorted(chance, reverse=True)
    names = [h["name"] for h in hypotheses]
    assert len(set(names)) == len(names) and {"none", "unlisted"} <= set(names)
    for h in hypotheses:
        assert h["effects"] == sorted(h["effects"])
        assert h["name"] == ("+".join(h["effects"]) or h["name"])
        if h["effects"]:
            fits(h, NAMED, h["name"])
            for name, p in h["parameters"].items():
                fits(p, {"value": float, "stderr": (float, None), "unit": str}, name)
            assert 0.0 <= h["survival"] <= 1.0 + 1e-9
            closed(h["closed_fraction"])
    assert verdict["name"] == names[0] and verdict["effects"] == hypotheses[0]["effects"]
    # Smallest: the likeliest, with the last of them just enough.
    count = len(verdict["set"])
    assert verdict["set"] == names[:count]
    assert math.fsum(chance[:count]) >= 0.95 > math.fsum(chance[: count - 1])
    closed(out["shrinkage"]["closed_fraction"])
    shares = [entry["share"] for entry in out["where"]]
    assert shares == sorted(shares, reverse=True)
    assert {e["direction"] for e in out["where"]} <= {"up", "down"}
    assert {e["region"] for e in out["where"]} <= {"edge", "middle"}
    assert out["data_sha256"] == diagnosis.recording.sha256()
    return out


def closed(fraction: dict[str, float] | None) -> None:
    if fraction is not None:
        assert fraction["low"] <= fraction["value"] <= fraction["high"]
        assert fraction["value"] <= 1.0 + 0.01


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


def test_none_of_those_known():
    """Pickup between the lines of the scan, where no candidate could make it."""
    recording = record(drives(), Pickup(amplitude=0.3, hertz=333.0))
    out = check(diagnose(None, recording, candidates=FEW, scan=False))
    assert (out["verdict"]["name"], out["verdict"]["effects"]) == ("unlisted", [])
    assert out["gap"]["significant"]
    assert out["next_scan"] is None


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


def test_a_diagnosis_is_the_same_when_run_again(none):
    again = diagnose(None, none.recording, candidates=FEW).to_dict()
    assert again | {"seconds": 0} == none.to_dict() | {"seconds": 0}
