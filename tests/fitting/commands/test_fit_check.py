"""`rapi fit --check`: a new measurement against what a fit or a certificate claims."""

import json
import re
import shutil

import numpy as np
import pytest

from fitting import Claim
from fitting.cli import app
from fitting.commands.run import run
from rapi_jax import Identified, Recording, predict, repeated, triangle
from rapi_jax.examples import paper_device, paper_recording
from rapi_jax.io import read_drive, read_recording, write_model, write_recording
from tests.support.spoiled import scaled

CLAIM = {
    "rms": 0.0202, "low": 0.0185, "high": 0.0215, "noise": 0.02, "curvature": 5.0,
    "rates_hz": [10.0, 40.0], "swings": [4.5, 4.5], "hours": 0.01, "runs": 8, "unit": "GHz",
}  # fmt: skip


def rapi(*arguments):
    return run(app, [str(a) for a in arguments])


def record(path, device, drives, seed=1, **fields):
    rng = np.random.default_rng(seed)
    clean = [np.asarray(predict(device, drive)) for drive in drives]
    noisy = [y + 0.02 * rng.standard_normal(y.size) for y in clean]
    write_recording(Recording.of(drives, noisy, **fields), path)
    return path


def runs(rates=(12.0, 30.0)):
    return triangle(rates, amplitude=4.5, bias=3.0, samples=1200, periods=3)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A model with a claim, and drives made from it."""
    folder = tmp_path_factory.mktemp("check")
    recording, _ = paper_recording(samples=400)
    (model := folder / "model").mkdir()
    write_model(
        model / "model.rapi", paper_device(), response_unit="GHz", drive_unit="V", trusted=True,
        identified=Identified.of(recording).to_dict(), data_sha256="", claim=CLAIM,
    )  # fmt: skip
    assert Claim.from_dict(CLAIM).runs == 8
    options = ("--span", 70, "--frequency", 15, 30, "--samples", 1024, "--no-plots")
    assert rapi("compensate", model, *options, "-o", folder / "drives") == 0
    return folder


def test_runs_of_the_same_device_hold(results, tmp_path, capsys):
    record(tmp_path / "new", paper_device(), runs())
    assert rapi("fit", "--check", results / "model", tmp_path / "new") == 0
    text = capsys.readouterr().out
    assert "The claim held (2 of 2 judged)" in text and "run01" in text
    assert list(results.joinpath("model").iterdir()) == [results / "model" / "model.rapi"]


def test_the_recording_that_was_fitted_says_nothing_of_its_claim(results, tmp_path, capsys):
    path = record(tmp_path / "fitted", paper_device(), runs())
    recording, _ = paper_recording(samples=400)
    (model := tmp_path / "model").mkdir()
    write_model(
        model / "model.rapi", paper_device(), response_unit="GHz", drive_unit="V", trusted=True,
        identified=Identified.of(recording).to_dict(), claim=CLAIM,
        data_sha256=read_recording(path).sha256(),
    )  # fmt: skip
    assert rapi("fit", "--check", model, path) == 3
    assert "was fitted to this very recording" in capsys.readouterr().err
    assert rapi("fit", "--check", model, record(tmp_path / "new", paper_device(), runs(), 2)) == 0


def test_runs_of_another_device_do_not_and_json_says_so(results, tmp_path, capsys):
    record(tmp_path / "new", scaled(paper_device(), 1.05), runs())
    arguments = ("fit", tmp_path / "new", "--check", results / "model" / "model.rapi")
    assert rapi(*arguments, "--json", "-o", tmp_path / "out") == 4
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads((tmp_path / "out" / "check.json").read_text())
    assert report["schema"] == "rapi.claim-check/1" and report["kind"] == "prediction"
    assert report["held"] is False and [one["held"] for one in report["checked"]] == [False, False]
    assert rapi(*arguments) == 4
    text = " ".join(capsys.readouterr().out.split())
    assert "did NOT hold" in text and "1.05 times" in text and "rapi diagnose" in text


def test_a_run_above_its_interval_that_refutes_nothing_is_not_called_held(
    results, tmp_path, capsys
):
    """Of three runs in the claim the largest of two more may be far above the interval."""
    claim = CLAIM | {"runs": 3, "low": 0.015, "high": 0.021}
    recording, _ = paper_recording(samples=400)
    (model := tmp_path / "model").mkdir()
    write_model(
        model / "model.rapi", paper_device(), response_unit="GHz", drive_unit="V", trusted=True,
        identified=Identified.of(recording).to_dict(), data_sha256="", claim=claim,
    )  # fmt: skip
    two = runs()
    rng = np.random.default_rng(1)
    noisy = [
        np.asarray(predict(paper_device(), drive)) + level * rng.standard_normal(drive.size)
        for drive, level in zip(two, (0.02, 0.022), strict=True)
    ]
    write_recording(Recording.of(two, noisy), tmp_path / "new")
    assert rapi("fit", tmp_path / "new", "--check", model) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert text.startswith("The claim is not refuted: 1 of 2 values exceed the 95 % interval")
    assert "the 97.5 % limit for the largest of 2." in text and "held" not in text[:200]
    assert "rms (MHz)" in text and "GHz" not in text
    assert rapi("fit", tmp_path / "new", "--check", model, "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert [row["within"] for row in report["checked"]] == [True, False] and report["held"]


def test_a_run_outside_is_said_and_not_judged(results, tmp_path, capsys):
    record(tmp_path / "new", paper_device(), runs((12.0, 80.0)))
    assert rapi("fit", tmp_path / "new", "--check", results / "model") == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "(1 of 2 judged)" in text and "not judged: run 'run01': a rate of 80 Hz" in text


@pytest.mark.parametrize("device", ["same", "other"])
def test_scans_are_held_against_their_certificate(results, tmp_path, capsys, device):
    drives = [repeated(read_drive(results / "drives" / f"drive_{f}Hz.csv"), 2) for f in (15, 30)]
    one = paper_device() if device == "same" else scaled(paper_device(), 1.05)
    if device == "other":
        import equinox as eqx

        one = eqx.tree_at(lambda e: e.operator.a, one, replace_fn=lambda a: 1.2 * a)
    record(tmp_path / "scan", one, drives)
    code = rapi("fit", "--check", results / "drives", tmp_path / "scan", "--json")
    report = json.loads(capsys.readouterr().out)
    assert code == (0 if device == "same" else 4) and report["held"] is (device == "same")
    assert report["kind"] == "straightness"
    assert [row["branch"] for row in report["checked"]] == ["up", "down", "up", "down"]
    assert {row["span_asked"] for row in report["checked"]} == {70.0}
    if device == "same":
        assert report["checked"][0]["span"] == pytest.approx(70.0, abs=0.05)
    assert (
        rapi("fit", "--check", results / "drives" / "certificate.json", tmp_path / "scan") == code
    )


def test_scans_of_which_nothing_is_claimed_are_measured(results, tmp_path, capsys):
    """As of drives that were made with the model of a diagnosis."""
    shutil.copytree(results / "drives", folder := tmp_path / "drives")
    _edit(claim=None, unclaimed="the model comes from a diagnosis")(folder)
    drives = [repeated(read_drive(folder / f"drive_{f}Hz.csv"), 2) for f in (15, 30)]
    record(tmp_path / "scan", paper_device(), drives)
    capsys.readouterr()
    assert rapi("fit", "--check", folder, tmp_path / "scan") == 0
    text = " ".join(capsys.readouterr().out.split())
    assert text.startswith("Measured; nothing is claimed to compare it with.")
    assert text.count("comes from a diagnosis") == 1 and "runs 'run00', 'run01'" in text
    assert text.count("asked for were 70 GHz") == 2 and "held" not in text
    assert rapi("fit", "--check", folder, tmp_path / "scan", "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["held"] is None
    for row in report["checked"]:
        assert row["rms"] == pytest.approx(0.02, rel=0.2) and row["span_asked"] == 70.0
        assert row["held"] is None and row["high"] is None


def test_a_span_that_was_not_reached_is_said(results, tmp_path, capsys):
    """A laser whose response is 0.9 of the model's scans as straight, and not as far."""
    drives = [repeated(read_drive(results / "drives" / "drive_15Hz.csv"), 2)]
    record(tmp_path / "scan", scaled(paper_device(), 0.9), drives)
    capsys.readouterr()
    assert rapi("fit", "--check", results / "drives", tmp_path / "scan") == 0
    text = " ".join(capsys.readouterr().out.split())
    found = re.search(r"run 'run00' spans (\S+) GHz, asked for were 70 GHz: 10\.\d % less", text)
    assert found and float(found[1]) == pytest.approx(63.0, abs=0.1)
    assert text.count("asked for were") == 1  # of both branches once


@pytest.mark.slow
def test_the_papers_inverse_is_expected_to_leave_what_the_model_says(results, tmp_path, capsys):
    options = ("--span", 75, "--frequency", 20, "--inverse", "paper", "--samples", 1024)
    assert rapi("compensate", results / "model", *options, "--no-plots", "-o", tmp_path) == 0
    (row,) = json.loads((tmp_path / "certificate.json").read_text())["drives"]
    assert min(row["nonlinearity"].values()) > 0.03
    drive = repeated(read_drive(tmp_path / "drive_20Hz.csv"), 2)
    record(tmp_path / "scan", paper_device(), [drive])
    capsys.readouterr()
    assert rapi("fit", "--check", tmp_path, tmp_path / "scan", "--json") == 0
    up, down = json.loads(capsys.readouterr().out)["checked"]
    assert up["rms"] > row["nonlinearity"]["up"] and down["rms"] > row["nonlinearity"]["down"]


def _mixed(folder):
    text = (folder / "drive_15Hz.csv").read_text()
    (folder / "drive_15Hz.csv").write_text(text.replace("\n0.", "\n0.0", 1))


def _edit(**fields):
    def edit(folder):
        path = folder / "certificate.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | fields))

    return edit


@pytest.mark.fault(name="a certificate that cannot be used", promise="exit 3, one line")
@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda f: (f / "certificate.json").write_text("{"), "not a certificate"),
        (lambda f: (f / "certificate.json").write_text("[1]"), "not a certificate"),
        (_edit(schema="rapi.other/1"), "schema rapi.other/1"),
        (lambda f: (f / "certificate.json").unlink(), "no such model"),
        (lambda f: (f / "model.rapi").write_text(""), "holds a model and a certificate"),
        (lambda f: (f / "drive_15Hz.csv").unlink(), "no such file"),
        (_mixed, "is not the file that certificate.json"),
        (_edit(schema="rapi.unfinished/1"), "not all written"),
    ],
)
def test_a_certificate_that_cannot_be_used_is_refused_in_one_line(
    results, tmp_path, capsys, damage, message
):
    shutil.copytree(results / "drives", folder := tmp_path / "drives")
    damage(folder)
    drive = read_drive(results / "drives" / "drive_15Hz.csv")
    record(tmp_path / "scan", paper_device(), [drive])
    assert rapi("fit", "--check", folder, tmp_path / "scan") == 3
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (("--plays", 5), 2, "--plays is for a fit"),
        (("--no-plots",), 2, "--plots is for a fit"),
        (("--check", "nowhere"), 3, "nowhere"),
    ],
)
def test_what_makes_no_sense_with_a_check_is_refused(
    results, tmp_path, capsys, options, code, message
):
    record(tmp_path / "new", paper_device(), runs())
    check = () if "--check" in options else ("--check", results / "model")
    assert rapi("fit", tmp_path / "new", *check, *options) == code
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1


def test_another_unit_is_refused(results, tmp_path, capsys):
    record(tmp_path / "um", paper_device(), runs(), response_unit="um")
    assert rapi("fit", tmp_path / "um", "--check", results / "model") == 3
    assert rapi("fit", tmp_path / "um", "--check", results / "drives") == 3
    assert capsys.readouterr().err.count("response_unit is GHz, the recording's um") == 2


@pytest.mark.parametrize("trusted", [True, False])
def test_a_model_without_a_claim_is_refused(tmp_path, capsys, trusted):
    recording, _ = paper_recording(samples=400)
    write_model(
        tmp_path / "model.rapi", paper_device(), response_unit="GHz", drive_unit="V",
        identified=Identified.of(recording).to_dict(), trusted=trusted,
    )  # fmt: skip
    record(tmp_path / "new", paper_device(), runs())
    assert rapi("fit", tmp_path / "new", "--check", tmp_path) == 3
    assert ("has no claim" if trusted else "claims nothing") in capsys.readouterr().err


def test_without_check_an_output_is_needed(tmp_path, capsys):
    assert rapi("fit", tmp_path) == 2
    assert "--output is missing. `rapi fit --help`" in capsys.readouterr().err
