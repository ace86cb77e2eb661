"""`rapi range`: what it writes and says, and its exit codes; each run is a command."""

import csv
import dataclasses
import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from fringe_scans import FringeScans

from fitting.cli import app
from fitting.commands.run import run
from rapi_jax.io import write_fringe_records
from rapi_jax.ranging import AirState

FILES = {"range.json", "range.csv", "range.png", "report.html"}
AIR = AirState(20.0, 101325.0, 0.5)
SCANS = FringeScans(bend=(0.01, -0.08), first_turn_s=0.004)
KEYS = {"schema", "unit", "air_index", "method", "scans", "track", "budget", "faults", "versions"}


@pytest.fixture
def rapi(capfd):
    """`rapi range` in this process: exit code, standard output, standard error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        capfd.readouterr()
        code = run(app, ["range", *map(str, arguments)])
        said = capfd.readouterr()
        return code, said.out, said.err

    return call


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    """A target at rest, 0.7 m of optical path away, in known air."""
    folder = tmp_path_factory.mktemp("range") / "still"
    write_fringe_records(SCANS.records(SCANS.record(0.7)).replace(air=AIR), folder)
    return folder


def test_files(rapi, still, tmp_path):
    output = tmp_path / "new" / "out"
    code, out, err = rapi(still, "-o", output)
    assert (code, err) == (0, "")
    assert {p.name for p in output.iterdir()} == FILES
    content = json.loads((output / "range.json").read_text(), parse_constant=pytest.fail)
    assert content.keys() >= KEYS
    assert (content["schema"], content["unit"]) == ("rapi.range/1", "m")
    assert content["method"] == "resample-phase" and content["faults"] == []
    assert set(content["files"]) == FILES - {"range.json"}
    assert len(content["scans"]) == len(content["track"]) == 5
    for scan in content["scans"]:
        assert scan.keys() >= {"time_s", "direction", "distance", "stderr", "span_hz"}
        assert abs(scan["distance"] * content["air_index"] - 0.7) < 1e-6 < 1e-3 > scan["stderr"] > 0
        assert scan["problem"] == ""
    assert [scan["direction"] for scan in content["scans"]] == ["up", "down", "up", "down", "up"]
    for state in content["track"]:
        assert state.keys() >= {
            "time_s", "distance", "distance_stderr", "velocity", "velocity_stderr",
        }  # fmt: skip
        assert abs(state["velocity"]) < 5 * state["velocity_stderr"]
    assert 1.00026 < content["air_phase_index"] < content["air_index"] < 1.00028
    assert 0 < content["air_index_stderr"] < 2e-7
    assert content["scale"]["path_m"] == pytest.approx(7.34, rel=1e-5)
    assert (output / "range.png").read_bytes().startswith(b"\x89PNG")
    said = " ".join(out.split())
    assert "resample-phase, the least sensitive to noise" in said and "mean of 5 scans" in said
    assert f"{0.7e3 / content['air_index']:.3f}" in said and "report.html" in said


def test_the_table_holds_what_the_json_does(rapi, still, tmp_path):
    rapi(still, "-o", tmp_path)
    content = json.loads((tmp_path / "range.json").read_text())
    rows = list(csv.DictReader((tmp_path / "range.csv").read_text().splitlines()))
    for name in ("time_s", "distance", "stderr", "span_hz"):
        assert [float(r[name]) for r in rows] == [s[name] for s in content["scans"]]
    assert [float(r["velocity"]) for r in rows] == [s["velocity"] for s in content["track"]]
    assert [float(r["track_distance"]) for r in rows] == [s["distance"] for s in content["track"]]


def test_json_is_all_that_standard_output_has(rapi, still, tmp_path):
    code, out, err = rapi(still, "-o", tmp_path, "--json", "--no-plots")
    assert (code, err) == (0, "")
    assert json.loads(out) == json.loads((tmp_path / "range.json").read_text())
    assert {p.name for p in tmp_path.iterdir()} == FILES - {"range.png"}


@pytest.mark.parametrize("method", ["counting", "counting-region", "resample-fft"])
def test_methods_without_a_filter(rapi, still, tmp_path, method):
    code, out, _ = rapi(still, "-o", tmp_path, "--method", method, "--no-kalman", "--json")
    content = json.loads(out)
    assert code == 0 and content["method"] == method and content["track"] == []
    assert content["summary"]["velocity"] is None
    distances = np.array([scan["distance"] for scan in content["scans"]]) * content["air_index"]
    assert np.abs(distances - 0.7).max() < 2e-5
    assert "not estimated" in (tmp_path / "report.html").read_text()


def test_a_range_that_is_expected(rapi, still, tmp_path):
    code, out, _ = rapi(still, "-o", tmp_path, "--expected", "0.5", "1", "--json")
    assert code == 0 and json.loads(out)["expected_m"] == [0.5, 1.0]
    code, _, err = rapi(still, "-o", tmp_path, "--expected", "1", "0.5")
    assert code == 3 and "the lowest possible distance in m, 0 or more, then the highest" in err


@pytest.mark.fault(name="wrong options and paths of `rapi range`", promise="exit 2 or 3, one line")
@pytest.mark.parametrize(
    ("arguments", "code", "word"),
    [
        (("missing", "-o", "out"), 3, "no manifest.toml"),
        (("{still}",), 2, "--output"),
        (("-o", "out"), 2, "RECORDS is missing"),
        (("{still}", "-o", "out", "--method", "best"), 2, "best"),
        (("{still}", "-o", "{still}/manifest.toml"), 3, "not a folder"),
    ],
)
def test_refusals_are_one_line(rapi, still, tmp_path, monkeypatch, arguments, code, word):
    monkeypatch.chdir(tmp_path)
    found, out, err = rapi(*(a.format(still=still) for a in arguments))
    assert (found, out) == (code, "")
    assert err.count("\n") == 1 and word in err, err


def test_no_target(rapi, tmp_path):
    """Everything is written, no number is made up, and the exit code says so."""
    record = SCANS.record(0.7)
    noise = 0.45 + 2e-3 * np.random.default_rng(1).standard_normal(record.size)
    empty = dataclasses.replace(record, measurement=noise.astype(np.float32))
    write_fringe_records(SCANS.records(empty), tmp_path / "empty")
    code, out, err = rapi(tmp_path / "empty", "-o", tmp_path / "out")
    assert code == 3 and err.count("\n") == 1
    assert "no scan gave a distance: no target" in err
    assert "none: no scan could be read" in out
    assert {p.name for p in (tmp_path / "out").iterdir()} == FILES
    text = (tmp_path / "out" / "range.json").read_text()
    content = json.loads(text, parse_constant=pytest.fail)
    assert content["summary"]["distance"] is None and content["track"] == content["budget"] == []
    assert {scan["distance"] for scan in content["scans"]} == {None}


@pytest.mark.fault(name="fringe records whose manifest is wrong", promise="exit 3, one line")
@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"excitation_hz": 5.0}, "Is `excitation_hz` right?"),
        ({"interferometer_path_m": 7340.0}, "Is it in m?"),
        ({"cavity_spacing_hz": 1.5}, "Is it in Hz?"),
        ({"sample_hz": 1e3}, "no turns of the laser are seen"),
        ({"relative_humidity": -1.0}, "from 0 to 1"),
    ],
)
def test_a_manifest_that_is_wrong(rapi, still, tmp_path, change, word):
    spoiled = tmp_path / "spoiled"
    shutil.copytree(still, spoiled)
    lines = (spoiled / "manifest.toml").read_text().splitlines()
    for key, value in change.items():
        lines = [f"{key} = {value}" if line.startswith(f"{key} =") else line for line in lines]
    (spoiled / "manifest.toml").write_text("\n".join(lines))
    code, out, err = rapi(spoiled, "-o", tmp_path / "out")
    assert (code, out) == (3, "")
    assert err.count("\n") == 1 and word in err, err


def test_faults_are_shown_everywhere(rapi, tmp_path):
    two = SCANS.record(0.7, more=((0.02, 0.1),))
    write_fringe_records(SCANS.records(two), tmp_path / "two")
    code, out, _ = rapi(tmp_path / "two", "-o", tmp_path / "out")
    assert code == 0
    content = json.loads((tmp_path / "out" / "range.json").read_text())
    assert any("a second reflector" in line for line in content["faults"])
    for text in (out, (tmp_path / "out" / "report.html").read_text()):
        assert "second reflector" in text and "state of the air is not given" in " ".join(
            text.split()
        )


def test_rows_appear_on_a_terminal_while_records_are_read(still, tmp_path):
    """And not where output is no terminal."""
    import os
    import pty

    ours, theirs = pty.openpty()
    call = [sys.executable, "-m", "fitting.cli", "range", str(still), "-o", str(tmp_path)]
    with subprocess.Popen(call, stdout=theirs, stderr=theirs, stdin=theirs) as process:
        os.close(theirs)
        text = b""
        while True:
            try:
                more = os.read(ours, 4096)
            except OSError:  # the other end is closed
                break
            if not more:
                break
            text += more
    os.close(ours)
    assert process.returncode == 0, text
    assert b"5 scans read" in text and b"written to" in text
