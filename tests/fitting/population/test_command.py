"""`rapi population` on folders of fits: exit codes, files, messages."""

import json
import shutil
from datetime import timedelta

import numpy as np
import pytest
from command_output import assert_one_line
from populations import FIRST

from fitting.cli import app
from fitting.commands.run import run

NAMES = {"alpha": ("1", 0.28, 0.001), "a": ("GHz/V", 0.63, 0.002), "d_0": ("GHz", 3.0, 1.0)}


def rapi(*arguments):
    return run(app, [str(a) for a in arguments])


def model(rng, day, *, trusted=True, **changes):
    """The content of a `model.json`; `changes` are added to parameters."""
    parameters = {}
    for name, (unit, value, stderr) in NAMES.items():
        drift = 5e-5 * day if name == "alpha" else 0.0
        value += drift + stderr * rng.standard_normal() + changes.get(name, 0.0)
        parameters[name] = {
            "value": value, "stderr": stderr, "unit": unit, "at_bound": False,
            "bounds": [0.0, None], "held": False,
        }  # fmt: skip
    return {
        "schema": "rapi.model/1", "operator": "RAPI", "plays": 10, "order": 3, "effects": [],
        "parameters": parameters, "unit": "GHz", "drive_unit": "V",
        "correlation": {"names": list(NAMES), "matrix": np.eye(3).tolist()},
        "verdict": {"trusted": trusted, "reasons": [] if trusted else ["two starts disagree"]},
        "recorded_at": (FIRST + timedelta(days=day)).isoformat(),
        "temperature_c": 21.0 + 0.5 * rng.standard_normal(), "data_sha256": f"sha {day}",
    }  # fmt: skip


def written(folder, content):
    folder.mkdir(parents=True)
    (folder / "model.json").write_text(json.dumps(content))
    return folder


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    """A folder of 20 fits, one of them not to be trusted."""
    folder, rng = tmp_path_factory.mktemp("fits"), np.random.default_rng(31)
    for i in range(20):
        written(folder / f"r{i:02d}", model(rng, 15.0 * i, trusted=i != 5))
    return folder


@pytest.fixture(scope="module")
def outcome(fits, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    assert rapi("population", fits, "-o", out, "--drift", "line") == 0
    return out


def test_a_folder_of_fits(outcome):
    content = json.loads((outcome / "population.json").read_text())
    assert len(content["recordings"]) == 19 and set(content["parameters"]) == {"alpha", "a"}
    (left,) = content["left_out"]
    assert left["recording"] == "r05" and "two starts disagree" in left["reason"]
    assert content["parameters"]["alpha"]["per_day"]["p_holm"] < 0.01
    assert (outcome / "population.png").read_bytes()[:4] == b"\x89PNG"


def test_a_new_result_is_checked(fits, tmp_path, capsys):
    rng = np.random.default_rng(32)
    same = written(tmp_path / "same", model(rng, 310.0))
    other = written(tmp_path / "other", model(rng, 311.0, a=0.05))
    common = ("--drift", "line", "--no-plots", "--json")
    assert rapi("population", fits, "-o", tmp_path / "o1", "--check", same, *common) == 0
    first = json.loads(capsys.readouterr().out)["change"]
    assert not first["changed"] and first["sentence"].startswith("unchanged")
    assert rapi("population", fits, "-o", tmp_path / "o2", "--check", other, *common[:3]) == 4
    text = " ".join(capsys.readouterr().out.split())
    assert "changed since: `a` by +" in text and "all else as before" in text
    # One of the folder is left out there, and so may be checked.
    assert rapi("population", fits, "-o", tmp_path / "o3", "--check", fits / "r07", *common) == 0
    assert len(json.loads(capsys.readouterr().out)["recordings"]) == 18
    bad = fits / "r05"
    assert rapi("population", fits, "-o", tmp_path / "o4", "--check", bad, *common) == 4
    assert_one_line(capsys.readouterr().err, "not to be trusted:", "r05", "two starts disagree")


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda t: t.pop("recorded_at"), ["r03", "`recorded_at`", "manifest.toml"]),
        (lambda t: t.update(recorded_at="noon"), ["r03", "`recorded_at` must be", "'noon'"]),
        (lambda t: t.update(temperature_c="x"), ["r03", "`temperature_c` must be a number"]),
        (lambda t: t.update(schema="rapi.range/1"), ["r03", "schema rapi.range/1"]),
        (lambda t: t.update(schema="rapi.unfinished/1"), ["r03", "not written to its end"]),
        (lambda t: t.update(plays=8), ["r03: plays 8, but r00 has 10"]),
        (lambda t: t.pop("correlation"), ["r03", "damaged"]),
        (lambda t: t["correlation"].update(matrix=[[1, 2], [3, 4]]), ["r03", "damaged"]),
        (
            lambda t: t["correlation"].update(matrix=[[1, 2, 0], [2, 1, 0], [0, 0, 1]]),
            ["r03", "no correlation matrix"],
        ),
        (lambda t: t.update(data_sha256="sha 0.0"), ["r03: of the same recording as r00"]),
    ],
)
def test_bad_results_are_refused_in_one_line(fits, tmp_path, capsys, spoil, words):
    shutil.copytree(fits, copy := tmp_path / "fits")
    path = copy / "r03" / "model.json"
    content = json.loads(path.read_text())
    spoil(content)
    path.write_text(json.dumps(content))
    assert rapi("population", copy, "-o", tmp_path / "o") == 3
    assert_one_line(capsys.readouterr().err, "bad data:", *words)
    assert not (tmp_path / "o" / "population.json").exists()


def test_folders_without_fits_are_refused(tmp_path, capsys):
    assert rapi("population", tmp_path / "none", "-o", tmp_path / "o") == 3
    assert_one_line(capsys.readouterr().err, "bad data:", "none: no such folder")
    (tmp_path / "empty").mkdir()
    assert rapi("population", tmp_path / "empty", "-o", tmp_path / "o") == 3
    assert_one_line(capsys.readouterr().err, "bad data:", "no model.json in it", "rapi batch")
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "model.json").write_text("[")
    assert rapi("population", tmp_path / "bad", "-o", tmp_path / "o") == 3
    assert_one_line(capsys.readouterr().err, "bad data:", "bad/model.json", "not a result")
    assert rapi("population", "-o", tmp_path / "o") == 2
    assert_one_line(capsys.readouterr().err, "usage:", "RESULT")
