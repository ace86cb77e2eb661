"""What a command would write over that is not its own: refused before work, by name."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from bad_input import FAST, data, entry, head
from command_output import assert_one_line

from fitting._result_files import check_drive_unit
from rapi_jax import DataError, Identified, Recording
from rapi_jax.examples import paper_device, paper_recording
from rapi_jax.io import read_recording, write_model, write_recording

SPAN = ("--span", "60", "--frequency", "10", "--samples", "512", "--no-plots")


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


COMMANDS = {
    "fit": lambda fitted: ("fit", fitted / "recording", *FAST),
    "predict": lambda fitted: ("predict", fitted, fitted / "recording", "--no-plots"),
    "compensate": lambda fitted: ("compensate", fitted, *SPAN),
    "diagnose": lambda fitted: ("diagnose", fitted / "recording", "--model", fitted, "--no-scan"),
    "batch": lambda fitted: ("batch", fitted / "recording", *FAST),
}
MINE = {
    "fit": ("model.json", "model.rapi"),
    "predict": ("run00.csv", "prediction.json"),
    "compensate": ("drive_10Hz.csv", "certificate.json"),
    "diagnose": ("diagnosis.json", "report.html"),
    "batch": ("results.csv", "report.html"),
}


@pytest.mark.fault(
    name="a file of the user where a result would be written",
    promise="exit 3, one line, the file as it was",
)
@pytest.mark.parametrize("command, file", [(c, f) for c, names in MINE.items() for f in names])
def test_a_file_of_the_user_is_not_written_over(command, file, rapi, fitted, tmp_path):
    (tmp_path / file).write_text('{"mine": 1}')
    code, out, err = rapi(*COMMANDS[command](fitted), "-o", tmp_path)
    assert (code, out) == (3, "") and contents(tmp_path) == {file: b'{"mine": 1}'}
    assert_one_line(err, file, "Choose another folder with `-o`")


@pytest.mark.fault(
    name="a recording as output folder", promise="exit 3, one line, the recording as it was"
)
@pytest.mark.parametrize("command", ["fit", "predict", "compensate", "diagnose"])
def test_a_result_is_not_written_into_a_recording(command, rapi, fitted, tmp_path):
    shutil.copytree(fitted / "recording", place := tmp_path / "recording")
    before = contents(place)
    code, out, err = rapi(*COMMANDS[command](fitted), "-o", place)
    assert (code, out) == (3, "") and contents(place) == before
    assert_one_line(err, str(place), "is a recording")


def test_an_own_result_is_replaced_but_not_what_was_changed_since(rapi, fitted, tmp_path):
    command = (*COMMANDS["predict"](fitted), "-o", tmp_path)
    assert rapi(*command)[0] == rapi(*command)[0] == 0
    (tmp_path / "notes.txt").write_text("mine")
    assert rapi(*command)[0] == 0 and (tmp_path / "notes.txt").read_text() == "mine"
    (tmp_path / "run01.csv").write_text("mine")
    code, _, err = rapi(*command)
    assert code == 3 and (tmp_path / "run01.csv").read_text() == "mine"
    assert_one_line(err, "run01.csv was changed after prediction.json")


@pytest.mark.fault(name="two rates that round to one file name", promise="exit 3, one line")
@pytest.mark.parametrize("rates", [("10", "10"), ("10", "10.0000001")])
def test_two_rates_of_one_file_name_are_refused(rates, rapi, fitted, tmp_path):
    code, _, err = rapi("compensate", fitted, *SPAN[:3], *rates, "-o", tmp_path / "o")
    assert code == 3 and not (tmp_path / "o").exists()
    assert_one_line(err, "drive_10Hz", "each rate once")


def test_a_result_says_where_it_comes_from(rapi, fitted, tmp_path):
    """Command, options, inputs with their hashes, and all versions."""
    for command, table in (("predict", "prediction.json"), ("compensate", "certificate.json")):
        place = tmp_path / command
        assert rapi(*COMMANDS[command](fitted), "-o", place)[0] == 0
        about = json.loads((place / table).read_text())["provenance"]
        assert about["command"] == f"rapi {command}" and about["options"]["plots"] is False
        assert {"python", "rapi-jax", "jax", "jaxlib", "numpy", "scipy"} <= about["versions"].keys()
        assert about["inputs"][0]["path"] == str(fitted)
        assert all(len(one["sha256"]) == 64 for one in about["inputs"])
    about = json.loads((fitted / "model.json").read_text())["provenance"]
    assert about["command"] == "rapi fit" and about["options"]["starts"] == 2


def test_units_are_checked_in_every_command(rapi, fitted, tmp_path):
    """Of a model beside a recording, and of limits beside a drive."""
    data(head(response_unit="um"))(other := tmp_path / "other")
    paper = ("--inverse", "paper", "--recording", other)
    for command in (
        ("predict", fitted, other),
        ("diagnose", other, "--model", fitted),
        ("fit", other, "--check", fitted),
        ("compensate", fitted, *SPAN, *paper),
    ):
        code, out, err = rapi(*command, "-o", tmp_path / "o")
        assert (code, out) == (3, "") and not (tmp_path / "o").exists(), command
        assert_one_line(err, "response_unit is", "um")
    limits = tmp_path / "limits.toml"
    limits.write_text("low_um = 0.0\nhigh_um = 7.0\nslew_um_per_s = 1e5\n")
    for command in (("compensate", fitted, *SPAN), ("diagnose", fitted / "recording")):
        code, _, err = rapi(*command, "--limits", limits, "-o", tmp_path / "o")
        assert code == 3
        assert_one_line(err, "limits.toml", "limits are in um, and the drive is in V")


def test_a_drive_in_um_is_for_no_generator(rapi, tmp_path):
    """It has no file of levels in V, and `rapi measure` refuses it."""
    seen = Identified.of(dataclasses.replace(paper_recording(samples=200)[0], drive_unit="um"))
    write_model(
        tmp_path / "model.rapi", paper_device(), response_unit="GHz", drive_unit="um", trusted=True,
        identified=seen.to_dict(), data_sha256="",
    )  # fmt: skip
    code, _, err = rapi("compensate", tmp_path / "model.rapi", *SPAN, "-o", tmp_path / "o")
    assert code == 0, err
    assert {p.suffix for p in (tmp_path / "o").iterdir()} == {".csv", ".nc", ".json"}
    notes = json.loads((tmp_path / "o" / "certificate.json").read_text())["notes"]
    assert any("no generator file: the drive is in um" in note for note in notes)
    with pytest.raises(DataError, match="is a drive in um"):
        check_drive_unit(tmp_path / "o" / "drive_10Hz.csv")


def test_names_of_folders_and_one_bad_recording_of_several(rapi, tmp_path):
    """`mon/a` and `tue/a` are two folders; what fails alone does not take the others with it."""
    for day in ("mon", "tue", "wed"):
        data(entry(start_s=0.0))(tmp_path / day / "a")
    rest = read_recording(tmp_path / "tue" / "a")
    short = [run.drive.time.size // 20 for run in rest.runs]
    cut = tuple(_cut(run, size) for run, size in zip(rest.runs, short, strict=True))
    shutil.rmtree(tmp_path / "tue" / "a")
    write_recording(Recording(cut), tmp_path / "tue" / "a")
    places = [tmp_path / day / "a" for day in ("mon", "tue", "wed")]
    code, out, err = rapi("fit", *places, "-o", tmp_path / "o", *FAST, "--json")
    assert code == 3
    told = "".join(line for line in err.splitlines(True) if not line.startswith("fitting a_"))
    assert_one_line(told, "a_2: ")
    assert [m["schema"] for m in json.loads(out)] == ["rapi.model/1"] * 2
    assert (tmp_path / "o" / "a_1" / "model.json").exists()
    assert (tmp_path / "o" / "a_3" / "model.json").exists()


def _cut(run, size: int):
    from rapi_jax import Drive, Run

    time, value = run.drive.time[:size], np.asarray(run.drive.value[:size])
    return Run(Drive(time, value, run.drive.rate, "triangle"), run.response[:size], run.name)
