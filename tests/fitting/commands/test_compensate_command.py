"""`rapi compensate`: what it writes, and every way it refuses; each run is a whole command."""

import dataclasses
import json
import re

import numpy as np
import pytest
from parsed_page import Page

from fitting.cli import app
from fitting.commands.run import run
from fitting.commands.shared.files._unclaimed import reading_notes
from rapi_jax import ECDL, RAPI, Identified, Run, linearity, predict, repeated
from rapi_jax.effects import AmplifierLowpass, Creep, Etalon
from rapi_jax.examples import paper_device, paper_recording
from rapi_jax.io import read_afg, read_drive, read_model, read_recording, write_model

RATES = ("10", "25", "40")


def rapi(*arguments):
    return run(app, [str(a) for a in arguments])


def write(folder, ecdl, recording, **about):
    folder.mkdir()
    fields = {
        "response_unit": "GHz",
        "drive_unit": "V",
        "trusted": True,
        "identified": Identified.of(recording).to_dict(),
        "data_sha256": recording.sha256(),
    }
    write_model(folder / "model.rapi", ecdl, **(fields | about))
    return folder


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """The paper's device itself as the model."""
    recording, _ = paper_recording(samples=400)
    return write(tmp_path_factory.mktemp("compensate") / "model", paper_device(), recording)


def test_drives_make_the_device_scan_straight(model, tmp_path, capsys):
    arguments = ("--span", 75, "--frequency", *RATES, "-o", tmp_path / "out", "--json")
    assert rapi("compensate", model, *arguments) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert report["schema"] == "rapi.compensation/1" and report["unit"] == "GHz"
    assert {"nonlinearity", "nonlinearity_band", "expected"} < set(report["meanings"])
    assert report["notes"] == [] and report["limits_from"] == "identification"
    for rate, entry in zip(RATES, report["drives"], strict=True):
        assert entry["certificate"]["invertible"] and entry["file"] == f"drive_{rate}Hz.csv"
        assert entry["bias"] == pytest.approx(3.0, abs=2e-3)  # centre of the identified range
        drive = read_drive(tmp_path / "out" / entry["file"])
        assert drive.value.argmin() == 0 and drive.rate == pytest.approx(float(rate))
        pair = read_recording(tmp_path / "out" / f"drive_{rate}Hz.nc")
        wanted = pair.runs[0].response
        answer = np.asarray(predict(paper_device(), pair.runs[0].drive))
        assert np.abs(answer - answer.min() - wanted).max() < 1e-8
        assert np.ptp(wanted) == pytest.approx(75.0)
        wave = read_afg(tmp_path / "out" / f"drive_{rate}Hz.afg")
        assert wave.frequency_hz == float(rate) and wave.codes.size == 131072
    assert (tmp_path / "out" / "compensation.png").read_bytes().startswith(b"\x89PNG")
    text = (tmp_path / "out" / "drives.html").read_text()
    page = Page(text)
    assert len(text) < 1_000_000 and not page.scripts and "drives.html" in report["files"]
    assert f"straight scans of 75 GHz at {', '.join(map(str, RATES))} Hz" in page.text
    cells = [text for tag, text in page.texts if tag in ("th", "td")]
    assert cells[cells.index("steepest slope") + 1].endswith(" V/s")
    assert cells.count("0, to rounding") == len(RATES)


def test_bias_shape_and_limits_are_followed(model, tmp_path, capsys):
    limits = tmp_path / "limits.toml"
    limits.write_text("low_v = 0.0\nhigh_v = 7.0\nslew_v_per_s = 5000.0\n")
    options = ("--bias", 2.8, "--limits", limits, "--rise", 0.8, "--corner", 0.05, "--no-plots")
    arguments = ("--span", 60, "--frequency", 20, "-o", tmp_path / "out")
    assert rapi("compensate", model, *arguments, *options) == 0
    text = capsys.readouterr().out
    assert "(GHz/V)" in text and re.search(r"[\d.]+ at [\d.]+ V ", text)
    report = json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert report["drives"][0]["bias"] == pytest.approx(2.8)
    assert report["limits_from"] == "file" and report["limits"]["high_v"] == 7.0
    drive = read_drive(tmp_path / "out" / "drive_20Hz.csv")
    moved = 2 * 0.05 * (0.5 - 0.8)  # rounding moves both turns into the steeper branch
    assert drive.value.argmax() / drive.size == pytest.approx(0.8 + moved, abs=0.002)
    assert not (tmp_path / "out" / "compensation.png").exists()


@pytest.mark.fault(
    name="wrong option, range, rate or limits file of `rapi compensate`",
    promise="exit 2 or 3, one line, no file",
)
@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (("--span", 75), 2, "frequency"),
        (("--frequency", 10), 2, "span"),
        (("--span", -3, "--frequency", 10), 2, "positive"),
        (("--span", "wide", "--frequency", 10), 2, "span"),
        (("--span", 75, "--frequency", "10,20"), 2, "Separate numbers by spaces, not by commas."),
        (("--span", "4,5", "--frequency", 10), 2, "A decimal comma is a point here: 4.5."),
        (("--span", 75, "--frequency", 0), 3, "positive rates"),
        (("--span", 75, "--frequency", 10, "nan"), 3, "positive rates"),
        (("--span", 75, "--frequency", 100), 3, "identified at 10 to 40"),
        (("--span", 75, "--frequency", 100, "--extrapolate"), 3, "V/s"),
        (("--span", 75, "--frequency", 10, 100, "--extrapolate"), 3, "the scan at 100 Hz: "),
        (
            ("--span", 75, "--frequency", 100, 10, 200, "--extrapolate"),
            3,
            "too: the scan at 200 Hz",
        ),
        (("--span", 75, "--frequency", 100, 10, 200), 3, "the scan rates are 100, 200 Hz, the"),
        (("--span", 75, "--frequency", 100, "--extrapolate"), 3, "the device's with `--limits`"),
        (("--span", 60, "--frequency", 50), 3, "identified at 10 to 40"),
        (("--span", 120, "--frequency", 10), 3, "a scan of 120 GHz centred on"),
        (("--span", 120, "--frequency", 10), 3, "the recordings, 0.75 to 5.25 V, span 76.4"),
        (("--span", 75, "--frequency", 10, "--bias", 5.2), 3, "needs more than"),
        (("--span", 75, "--frequency", 10, "--bias", 50), 3, "does not lie within the limits"),
        (("--span", 75, "--frequency", 10, "--corner", 0.6), 3, "corner"),
        (("--span", 75, "--frequency", 10, "--rise", 1.5), 3, "rise"),
        (("--span", 75, "--frequency", 10, "--samples", 3), 3, "samples"),
        (("--span", 75, "--frequency", 10, "--limits", "nowhere.toml"), 3, "nowhere.toml"),
        (("--span", 75, "--frequency", 10, "--inverse", "best"), 2, "inverse"),
    ],
)
def test_what_cannot_be_done_is_refused_and_nothing_is_written(
    model, tmp_path, capsys, options, code, message
):
    output = tmp_path / "new" / "out"
    assert rapi("compensate", model, *options, "-o", output) == code
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1 and "Traceback" not in error
    assert list(tmp_path.iterdir()) == []


def test_one_rate_that_is_refused_leaves_no_drive_of_the_others(model, tmp_path):
    output = tmp_path / "out"
    assert rapi("compensate", model, "--span", 75, "--frequency", 10, 60, "-o", output) == 3
    assert not output.exists()
    output.mkdir()  # what was there stays
    assert rapi("compensate", model, "--span", 75, "--frequency", 10, 60, "-o", output) == 3
    assert list(output.iterdir()) == []


def test_extrapolation_is_done_when_asked_for_and_noted(model, tmp_path):
    output = tmp_path / "out"
    options = ("--span", 60, "--frequency", 50, "--extrapolate", "--no-plots")
    assert rapi("compensate", model, *options, "-o", output) == 0
    report = json.loads((output / "certificate.json").read_text())
    assert "50 Hz" in report["notes"][0]


def test_a_swing_far_below_those_recorded_is_refused(model, tmp_path, capsys):
    options = ("--frequency", 20, "--no-plots", "-o", tmp_path / "out")
    assert rapi("compensate", model, "--span", 25, *options) == 3
    error = capsys.readouterr().err
    assert "identified at 4.5" in error and "Eq. 11" in error and "one more run near" in error
    assert rapi("compensate", model, "--span", 25, *options, "--extrapolate") == 0
    report = json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert "Eq. 11" in report["notes"][0]


def test_the_certificate_carries_what_to_expect_of_the_device(tmp_path):
    recording, _ = paper_recording(samples=400)
    claim = {"rms": 0.05, "low": 0.02, "high": 0.13, "noise": 0.03, "unit": "GHz"}
    folder = write(tmp_path / "model", paper_device(), recording, claim=claim)
    options = ("--span", 70, "--frequency", 20, "--no-plots", "-o", tmp_path / "out")
    assert rapi("compensate", folder, *options) == 0
    report = json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert report["claim"] == claim
    expected = {"rms": 0.04, "low": 0.0, "high": np.sqrt(0.13**2 - 0.03**2)}
    for name, value in expected.items():
        assert report["expected"][name] == pytest.approx(value)


@pytest.mark.parametrize(("span", "noted"), [(50, True), (75, False)])
def test_a_swing_that_the_claim_is_not_of_is_noted(tmp_path, capsys, span, noted):
    """Where the swing is not so far below that the drive is refused."""
    recording, _ = paper_recording(samples=400)
    claim = {"rms": 0.05, "low": 0.02, "high": 0.13, "noise": 0.03, "unit": "GHz"}
    claim["swings"] = [4.5, 4.5]
    folder = write(tmp_path / "model", paper_device(), recording, claim=claim)
    out = tmp_path / "new drives"
    options = ("--frequency", 20, "--samples", 1024, "-o", out)
    assert rapi("compensate", folder, "--span", span, *options) == 0
    report = json.loads((out / "certificate.json").read_text())
    told = " ".join(capsys.readouterr().out.split())
    assert "at most 126 MHz rms off a straight line in the middle 80 % of each branch" in told
    assert (
        "with swings of 4.5 V that were left out. Of a drive that swings by 3." in told
    ) is noted
    assert report["expected"]["swings"] == [4.5, 4.5]
    assert [one > 3.0 for one in report["expected"]["swings_beside"]] == [True] * noted
    page = Page((out / "drives.html").read_text()).text
    assert f"rapi fit NEW-SCANS --check '{out}'" in page and "THIS-FOLDER" not in page + told
    assert ("prediction holds for swings of 4.5 V" in told) is noted
    assert report["expected"] is not None and bool(report["notes"]) is noted
    assert report["drives"][0]["notes"] == []  # so that the scan is checked


@pytest.mark.parametrize("trusted", [True, False])
def test_nothing_is_expected_of_a_drive_beyond_what_was_identified(tmp_path, trusted):
    """Nor of a model that is not to be trusted; the certificate says how it goes there."""
    recording, _ = paper_recording(samples=400)
    claim = {"rms": 0.05, "low": 0.02, "high": 0.13, "noise": 0.03, "unit": "GHz"}
    folder = write(tmp_path / "m", paper_device(), recording, claim=claim, trusted=trusted)
    options = ("--frequency", 20, "--no-plots", "-o", tmp_path / "out")
    flag = "--extrapolate" if trusted else "--untrusted"
    assert rapi("compensate", folder, "--span", 25, *options, flag) == 0
    report = json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert report["expected"] is None
    assert "identified at 4.5" in report["notes"][-1]


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """A model with an etalon, as a diagnosis writes one: without a claim."""
    recording, _ = paper_recording(samples=400)
    ecdl = ECDL(paper_device().operator, (Etalon.at(amplitude=0.12, spacing=9.0),))
    folder = write(tmp_path_factory.mktemp("diagnosed") / "diagnosis", ecdl, recording)
    (folder / "diagnosis.json").write_text("{}")
    return folder


SMALL = ("--span", 70, "--frequency", 20, "--samples", 1024, "--no-plots")


def test_an_effect_left_out_is_not_compensated_and_is_noted(diagnosed, tmp_path, capsys):
    """What only the reading has must not be imprinted on the light."""
    output = tmp_path / "out"
    assert rapi("compensate", diagnosed, *SMALL, "--without", "etalon", "-o", output) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "the effect etalon was left out of the model that was inverted (`--without`)" in told
    assert "up to 8" in told and "MHz rms off a straight line" in told
    assert "write them again with `--without etalon`" not in told
    report = json.loads((output / "certificate.json").read_text())
    assert report["left_out"] == ["etalon"] and report["expected"] is None
    assert report["provenance"]["options"]["without"] == ["etalon"]
    (entry,) = report["drives"]
    assert max(entry["nonlinearity"].values()) < 1e-4  # GHz; of the light
    assert 0.07 < min(entry["nonlinearity_of_reading"].values()) < 0.1  # GHz; 0.12 / sqrt 2
    whole, _ = read_model(diagnosed / "model.rapi")
    drive = repeated(read_drive(output / entry["file"]), 2)
    light = linearity(Run(drive, np.asarray(predict(whole.without("etalon"), drive))))
    assert max(light.rms_ghz) < 1e-3  # GHz; the drive's samples


@pytest.mark.parametrize("unit", ["GHz", "um"])
def test_a_note_says_that_an_etalon_may_be_in_the_reading_alone(unit):
    (note,) = reading_notes([Creep.at(gain=0.01), Etalon.at(amplitude=0.1)], unit)
    assert note.endswith("write them again with `--without etalon`.")
    assert ("no light back into the laser" in note) is (unit == "GHz")


def test_a_model_with_an_etalon_is_compensated_with_a_note(diagnosed, tmp_path, capsys):
    assert rapi("compensate", diagnosed, *SMALL, "-o", tmp_path / "out") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert told.count("write them again with `--without etalon`") == 1
    assert "sends no light back into the laser" in told
    report = json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert report["left_out"] == [] and "nonlinearity_of_reading" not in report["drives"][0]


def test_an_effect_that_the_model_does_not_have_is_refused_with_those_it_has(
    diagnosed, model, tmp_path, capsys
):
    options = (*SMALL, "-o", tmp_path / "out")
    assert rapi("compensate", diagnosed, *options, "--without", "delay") == 3
    assert "has no effect 'delay' that could be left out" in (error := capsys.readouterr().err)
    assert "these: etalon" in error and error.count("\n") == 1
    assert rapi("compensate", model, *options, "--without", "etalon") == 3
    assert "of effects it has none" in capsys.readouterr().err
    paper = ("--inverse", "paper", "--recording", tmp_path, "--without", "etalon")
    assert rapi("compensate", diagnosed, *options, *paper) == 3
    assert "still have etalon" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.fault(name="a model that is not monotone", promise="refused with the place")
def test_a_model_that_is_not_monotone_is_refused_with_the_place(tmp_path, capsys):
    recording, _ = paper_recording(samples=400)
    operator = RAPI(alpha=0.3, zeta=0.0, lam=1.2, eta=1.0, a=0.5, b=0.0, d=(30.0, -4.0), plays=5)
    folder = write(tmp_path / "model", ECDL(operator), recording)
    arguments = ("--span", 40, "--frequency", 20, "-o", tmp_path / "out")
    assert rapi("compensate", folder, *arguments) == 3
    assert "does not rise with it from" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.fault(name="a drive that is too steep", promise="refused with a corner that passes")
def test_a_drive_that_is_too_steep_is_refused_with_a_corner_that_passes(tmp_path, capsys):
    """A low-pass is undone by a step at each corner: 978 V/s at 2 % of a period, 833 at 3 %."""
    recording, _ = paper_recording(samples=400)
    slower = dataclasses.replace(Identified.of(recording), slew_max=950.0 / 3.0)  # V/s
    lagging = ECDL(paper_device().operator, (AmplifierLowpass.at(tau=2e-4),))
    folder = write(tmp_path / "model", lagging, recording, identified=slower.to_dict())
    options = ("--span", 60, "--frequency", 40, "--no-plots", "-o", tmp_path / "out")
    assert rapi("compensate", folder, *options) == 3
    error = capsys.readouterr().err
    assert "slew_v_per_s" in error and not (tmp_path / "out").exists()
    assert "`--corner 0.03` would pass" in error
    assert rapi("compensate", folder, *options, "--corner", 0.03) == 0


def test_a_rate_that_was_not_recorded_is_refused_before_its_slope(model, tmp_path, capsys):
    options = ("--span", 70, "--frequency", 200, "--no-plots", "-o", tmp_path / "out")
    assert rapi("compensate", model, *options) == 3
    error = capsys.readouterr().err
    assert "the scan rate is 200 Hz, the model was identified at 10 to 40 Hz" in error
    assert "slew" not in error


@pytest.mark.fault(name="a model not to be trusted", promise="exit 4, no file")
def test_a_model_not_to_be_trusted_is_refused_unless_asked_for(tmp_path, capsys):
    recording, _ = paper_recording(samples=400)
    about = {"trusted": False, "reasons": ["run does not belong: run 'run02'.", "poor fit"]}
    folder = write(tmp_path / "model", paper_device(), recording, **about)
    options = ("--span", 70, "--frequency", 20, "--no-plots", "-o", tmp_path / "out")
    assert rapi("compensate", folder, *options) == 4
    error = capsys.readouterr().err
    assert "'run02' (and 1 more)" in error and "--untrusted" in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()
    assert rapi("compensate", folder, *options, "--untrusted") == 0
    report = json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert "not to be trusted" in report["notes"][0]


def test_the_papers_inverse_from_the_model_alone(model, tmp_path):
    """Without a recording it is identified on the model's own response."""
    output = tmp_path / "out"
    options = ("--span", 75, "--frequency", 10, 40, "--inverse", "paper", "--no-plots")
    assert rapi("compensate", model, *options, "-o", output) == 0
    report = json.loads((output / "certificate.json").read_text())
    assert [entry["inverse"] for entry in report["drives"]] == ["paper", "paper"]
    assert max(report["inverse_fit"]["rmse"]) < 0.02
    for rate in (10, 40):
        drive = read_drive(output / f"drive_{rate}Hz.csv")
        answer = np.asarray(predict(paper_device(), drive))
        middle = slice(int(0.05 * drive.size), int(0.45 * drive.size))
        line = np.polyfit(drive.time[middle], answer[middle], 1)
        assert (answer[middle] - np.polyval(line, drive.time[middle])).std() < 0.4  # 0.43 before
    assert (output / "inverse.rapi").exists()
