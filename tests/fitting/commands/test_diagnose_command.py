"""`rapi diagnose`: what it writes, exit codes, and every way it refuses; each run is a command."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from edge_worlds import drives, record

from fitting.cli import app
from fitting.commands.diagnose import _naming
from fitting.commands.run import run
from rapi_jax import Identified, Recording, effects
from rapi_jax.effects import AmplifierLowpass, Etalon
from rapi_jax.examples import paper_device
from rapi_jax.io import read_model, write_model, write_recording

TRUTH = Etalon(amplitude=0.3, spacing=20.0, phase=0.4)
FILES = {"diagnosis.json", "report.html", "model.rapi"}


@pytest.fixture(autouse=True)
def few(monkeypatch):
    """Two of the fifteen effects: compiling them all is another test's."""
    monkeypatch.setattr(effects, "ALL", (AmplifierLowpass, Etalon))


@pytest.fixture
def rapi(capfd):
    """`rapi diagnose` in this process: exit code, standard output, standard error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        capfd.readouterr()
        code = run(app, ["diagnose", *map(str, arguments)])
        said = capfd.readouterr()
        return code, said.out, said.err

    return call


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Recordings: without an effect, and with an etalon."""
    root = tmp_path_factory.mktemp("diagnose")
    write_recording(record(drives()), root / "plain")
    write_recording(record(drives(), TRUTH), root / "etalon")
    return root


def assert_one_line(text: str, *words: str) -> None:
    """One line, safe on a terminal, with all words and no traceback."""
    assert text.endswith("\n") and text.count("\n") == 1, text
    assert text[:-1].isprintable() and "Traceback" not in text and "internal error" not in text
    assert [word for word in words if word not in text] == [], text


ABOUT = r"diagnosing[^:]*: \d+ runs?.*; about \d+ "


def assert_introduced(text: str, count: int = 1) -> None:
    """A line for each recording says what is worked on; others tell a step and the time."""
    lines = text.splitlines()
    about = [re.match(ABOUT, line) is not None for line in lines]
    assert sum(about) == count and about[0], text
    assert all(re.search(r" \(\d+ s\)$", x) for x, y in zip(lines, about, strict=True) if not y)


def test_commands_in_notes_name_the_recording():
    note = "thresholds fixed in V: rapi fit RECORDING -o result --operator FixedRAPI"
    (shown,) = _naming({"notes": [note]}, Path("my scans"))["notes"]
    assert shown == note.replace("RECORDING", "'my scans'")


@pytest.mark.parametrize("reasons", [(), ("gap: 3 % of the span is left.", "starts disagree.")])
def test_a_model_that_was_not_trusted_is_said_to_be_one(rapi, folder, tmp_path, reasons):
    """On the terminal, the page and in the JSON; of a trusted one nothing is said."""
    common = dict(response_unit="GHz", drive_unit="V", response_origin="session")
    why = dict(reasons=list(reasons)) if reasons else {}
    write_model(tmp_path / "bad.rapi", paper_device(), trusted=False, **why, **common)
    write_model(tmp_path / "good.rapi", paper_device(), trusted=True, **common)
    said = {}
    for name in ("bad", "good"):
        model = tmp_path / f"{name}.rapi"
        code, out, _ = rapi(folder / "etalon", "--model", model, "--no-scan", "-o", tmp_path / name)
        assert code == 0
        notes = json.loads((tmp_path / name / "diagnosis.json").read_text())["notes"]
        said[name] = [note for note in notes if "not to be trusted" in note]
        page = (tmp_path / name / "report.html").read_text()
        assert ("not to be trusted" in " ".join(out.split())) == (name == "bad")
        assert ("not to be trusted" in page) == (name == "bad")
    (note,) = said["bad"]
    assert not said["good"] and "diagnose without `--model`" in note
    if reasons:
        assert "gap: 3 % of the span is left (and 1 more)." in note


def test_one_recording(rapi, folder, tmp_path):
    """The verdict is shown, the files are written; the exit code does not depend on it."""
    output = tmp_path / "new" / "out"
    code, out, err = rapi(folder / "etalon", "-o", output, "--no-scan")
    assert code == 0
    assert_introduced(err)
    assert {p.name for p in output.iterdir()} == FILES
    said = json.loads((output / "diagnosis.json").read_text(), parse_constant=pytest.fail)
    assert said["verdict"]["name"] == "etalon" and said["recording"]["name"] == "etalon"
    assert said["next_scan"] is None
    assert "The gap is an etalon in the light path" in out and str(output) in out.replace("\n", "")
    assert "\x1b" not in out
    model, about = read_model(output / "model.rapi")
    assert [type(e) for e in model.effects] == [Etalon] and about["trusted"]


@pytest.mark.slow
def test_several_recordings_have_a_folder_each(rapi, folder, tmp_path):
    """Of one name they are numbered; JSON is one list on standard output."""
    other = tmp_path / "other" / "plain"
    other.parent.mkdir()
    write_recording(record(drives(), seed=1), other)
    output = tmp_path / "out"
    given = (folder / "plain", folder / "etalon", other)
    code, out, err = rapi(*given, "-o", output, "--json", "--no-scan")
    assert code == 0
    assert_introduced(err, 3)
    assert {p.name for p in output.iterdir()} == {"plain_1", "etalon", "plain_2"}
    listed = json.loads(out, parse_constant=pytest.fail)
    assert [one["verdict"]["name"] for one in listed] == ["none", "etalon", "none"]
    for name, one in zip(("plain_1", "etalon", "plain_2"), listed, strict=True):
        assert {p.name for p in (output / name).iterdir()} == FILES
        written = json.loads((output / name / "diagnosis.json").read_text())
        assert written["data_sha256"] == one["data_sha256"]
        assert written["recording"].pop("name") == name
        assert one["recording"].pop("name", name) == name
        assert written == one


def test_a_model_that_fit_wrote_and_one_that_diagnose_wrote(rapi, folder, tmp_path):
    """Refitting what was fitted takes next to nothing away; the second finds its own effect."""
    options = ("--each", "none", "--starts", "2", "--no-plots", "-o", str(tmp_path / "fit"))
    assert run(app, ["fit", str(folder / "plain"), *options]) == 0
    arguments = ("--model", tmp_path / "fit", "-o", tmp_path / "first", "--json", "--no-scan")
    code, out, err = rapi(folder / "etalon", *arguments)
    first = json.loads(out)
    assert (code, first["verdict"]["name"]) == (0, "etalon")
    assert_introduced(err)
    assert first["gap"]["total"] > 0.1
    for model in (tmp_path / "first", tmp_path / "first" / "model.rapi"):
        arguments = ("--model", model, "-o", tmp_path / "second", "--json", "--no-scan")
        code, out, err = rapi(folder / "etalon", *arguments)
        second = json.loads(out)
        assert (code, second["verdict"]["name"]) == (0, "none")
        assert_introduced(err)
        assert second["model"]["effects"] == ["Etalon"]
        assert second["gap"]["total"] == pytest.approx(0.02, rel=0.1)


def test_masked_readings(rapi, folder, tmp_path):
    path = tmp_path / "masked"
    write_recording(record(drives()), path)
    lines = (path / "run00.csv").read_text().splitlines()
    for i in range(50, 55):
        lines[i] = lines[i].rsplit(",", 1)[0] + ",nan"
    (path / "run00.csv").write_text("\n".join(lines) + "\n")
    code, out, err = rapi(path, "-o", tmp_path / "out", "--no-scan")
    assert (code, out) == (3, "") and not (tmp_path / "out").exists()
    assert_one_line(err, "run00.csv", "--nan mask")
    code, out, err = rapi(path, "-o", tmp_path / "out", "--nan", "mask", "--json", "--no-scan")
    assert code == 0 and json.loads(out)["verdict"]["name"] == "none"
    assert_introduced(err)


def test_a_dead_sensor_is_refused_and_noise_is_not(rapi, tmp_path):
    runs, rng = drives(), np.random.default_rng(0)
    write_recording(Recording.of(runs, [np.full(d.size, 5.0) for d in runs]), tmp_path / "dead")
    code, out, err = rapi(tmp_path / "dead", "-o", tmp_path / "out")
    assert (code, out) == (3, "") and not list(tmp_path.glob("out/*"))
    assert_one_line(err, "rest", "cable")
    hiss = Recording.of(runs, [20.0 * rng.standard_normal(d.size) for d in runs])
    write_recording(hiss, tmp_path / "hiss")
    code, out, err = rapi(tmp_path / "hiss", "-o", tmp_path / "out", "--no-scan")
    assert code == 0 and "nothing explained" in out
    assert_introduced(err)
    assert not read_model(tmp_path / "out" / "model.rapi")[1]["trusted"]


def of_another_unit(path):
    about = {
        "response_unit": "um",
        "drive_unit": "V",
        "trusted": True,
        "identified": Identified.of(record(drives())).to_dict(),
        "data_sha256": "",
    }
    path.mkdir()
    write_model(path / "model.rapi", paper_device(), **about)
    return path


REFUSED = {
    "no recording": (("nowhere", "-o", "out"), 3, ("nowhere", "no such file")),
    "one of several is missing": (("plain", "nowhere", "-o", "out"), 3, ("nowhere",)),
    "no model": (("plain", "-o", "out", "--model", "plain"), 3, ("no such model",)),
    "a model of another unit": (
        ("plain", "-o", "out", "--model", "um"),
        3,
        ("response_unit is um", "GHz", "same unit"),
    ),
    "no limits": (("plain", "-o", "out", "--limits", "no.toml"), 3, ("no.toml",)),
    "no output": (("plain",), 2, ("--output is missing", "rapi diagnose --help")),
    "no argument": (("-o", "out"), 2, ("RECORDING is missing", "rapi diagnose --help")),
    "misspelt option": (("plain", "-o", "out", "--modle", "x"), 2, ("--modle",)),
    "no such policy": (("plain", "-o", "out", "--nan", "guess"), 2, ("guess", "mask")),
    "a file in the way": (("plain", "-o", "um/model.rapi"), 3, ("is not a folder", "`-o`")),
}


@pytest.mark.fault(
    name="wrong option, path, unit, model, file in the way of `rapi diagnose`",
    promise="exit 2 or 3, one line, nothing computed or written",
)
@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_done_is_refused_at_once(name, rapi, folder, tmp_path, monkeypatch):
    """In one line, before anything is computed, and nothing is written."""
    arguments, code, words = REFUSED[name]
    (tmp_path / "plain").symlink_to(folder / "plain")
    of_another_unit(tmp_path / "um")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("fitting.diagnosis.diagnose", None)
    got, out, err = rapi(*arguments)
    assert (got, out) == (code, ""), err
    assert_one_line(err, *words)
    assert not list(tmp_path.glob("out/*"))


@pytest.mark.fault(name="an interrupt in `rapi diagnose`", promise="exit 130, nothing half-written")
def test_an_interrupt_leaves_nothing_half_written(rapi, folder, tmp_path, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("fitting.diagnosis.diagnose", interrupt)
    code, _, err = rapi(folder / "plain", "-o", tmp_path / "out")
    assert code == 130 and not (tmp_path / "out").exists()
    assert_one_line(err, "interrupted")


HELP = """
import sys, time
from fitting.commands.run import run
from fitting.cli import app
assert run(app, ["diagnose", "--help"]) == 0
assert run(app, ["diagnose"]) == 2
heavy = {"jax", "numpy", "scipy", "equinox"} & set(sys.modules)
assert not heavy, heavy
"""


def test_help_loads_nothing_heavy():
    done = subprocess.run([sys.executable, "-c", HELP], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "--model" in done.stdout and "RECORDING" in done.stdout


def test_compare_says_what_changed(rapi, folder, tmp_path):
    """The two recordings of this file differ by an etalon, which no parameter of a fit explains."""
    other = tmp_path / "other"
    write_recording(record(drives(), seed=1), other)
    code, out, err = rapi("--compare", folder / "plain", other, "-o", tmp_path / "out", "--json")
    said = json.loads(out, parse_constant=pytest.fail)
    assert (code, err) == (0, "") and said["schema"] == "rapi.comparison/1"
    assert not said["changed"] and said["recordings"]["after"]["name"] == "other"
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"comparison.json", "report.html"}
    code, out, err = rapi(folder / "plain", folder / "etalon", "--compare", "-o", tmp_path / "two")
    assert (code, err) == (0, "") and "changed: yes" in out
    assert "An effect that the model lacks came up between the recordings" in " ".join(out.split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--compare", "plain", "-o", "out"), ("two recordings", "BEFORE and AFTER", "not 1")),
        (("plain", "etalon", "plain", "--compare", "-o", "out"), ("two recordings", "not 3")),
        (("plain", "--effects", "-o", "out"), ("--effects needs --compare",)),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    arguments, words, rapi, folder, tmp_path, monkeypatch
):
    monkeypatch.chdir(folder)
    code, out, err = rapi(*arguments[:-1], tmp_path / "out")
    assert (code, out) == (2, "")
    assert_one_line(err, *words, "rapi diagnose --help")
