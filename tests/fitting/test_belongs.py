"""What a list beside a file says of it, with files made by hand."""

import hashlib
import json

import pytest

from fitting._result_files import UNFINISHED, check_belongs
from fitting.claim_check._certificate import read_certificate
from rapi_jax import DataError, triangle
from rapi_jax.io import write_drive

CLAIM = {
    "rms": 0.02, "low": 0.018, "high": 0.022, "noise": 0.02, "curvature": 5.0, "unit": "GHz",
    "rates_hz": [10.0, 40.0], "swings": [4.5, 4.5], "hours": 1.0, "runs": 4,
}  # fmt: skip


@pytest.fixture
def result(tmp_path):
    """A folder with a model, its list and the hash that is in it."""
    (tmp_path / "model.rapi").write_bytes(b"one")
    put_list(tmp_path, "model.json", {"model.rapi": hashlib.sha256(b"one").hexdigest()})
    return tmp_path


def put_list(folder, name, files, schema="rapi.model/1", **more):
    (folder / name).write_text(json.dumps({"schema": schema, "files": files} | more))


def test_a_file_belongs_to_the_list_that_has_its_hash(result):
    check_belongs(result / "model.rapi")
    check_belongs(result / "model.json")


def test_a_file_of_another_result_does_not(result):
    (result / "model.rapi").write_bytes(b"other")
    with pytest.raises(DataError, match="is not the file that model.json beside it"):
        check_belongs(result / "model.rapi")


def test_a_file_of_an_earlier_result_does_not(result):
    put_list(result, "model.json", {"model.rapi": None})
    with pytest.raises(DataError, match="is of an earlier result than model.json"):
        check_belongs(result / "model.rapi")


def test_a_file_of_a_result_that_was_not_finished_does_not(result):
    put_list(result, "model.json", {"model.rapi": None}, UNFINISHED)
    with pytest.raises(DataError, match="is of a result that was not finished"):
        check_belongs(result / "model.rapi")


@pytest.fixture
def drives(tmp_path):
    """Two drives, and a certificate that lists the first."""
    (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=100)
    for hertz in (10, 20):
        write_drive(drive, tmp_path / f"drive_{hertz}Hz.csv")
    made = (tmp_path / "drive_10Hz.csv").read_bytes()
    put_list(
        tmp_path, "certificate.json", {"drive_10Hz.csv": hashlib.sha256(made).hexdigest()},
        "rapi.compensation/1", unit="GHz", drive_unit="V", claim=CLAIM,
        drives=[{"file": "drive_10Hz.csv", "notes": []}],
    )  # fmt: skip
    return tmp_path


def test_a_drive_that_the_certificate_does_not_list_is_refused(drives):
    check_belongs(drives / "drive_10Hz.csv")
    with pytest.raises(DataError, match="certificate.json beside it does not list"):
        check_belongs(drives / "drive_20Hz.csv")


def test_a_certificate_is_read_with_its_own_drives_alone(drives):
    (one,), claim, units = read_certificate(drives / "certificate.json")
    assert (one.drive.excitation_hz, claim.rms) == (pytest.approx(10.0), 0.02)
    assert (units["response_unit"], units["drive_unit"]) == ("GHz", "V")
    (drive,) = triangle(10.0, amplitude=4.1, bias=3.0, samples=100)
    write_drive(drive, drives / "drive_10Hz.csv")
    with pytest.raises(DataError, match="is not the file that certificate.json"):
        read_certificate(drives / "certificate.json")


@pytest.mark.fault(name="a drive's name in a certificate that is too long", promise="refused")
def test_a_certificate_that_names_a_file_too_long_is_refused(drives):
    text = (drives / "certificate.json").read_text()
    (drives / "certificate.json").write_text(text.replace('"drive_10Hz.csv",', f'"{"a" * 300}",'))
    with pytest.raises(DataError, match="cannot be followed|no such file|cannot be opened"):
        read_certificate(drives / "certificate.json")
