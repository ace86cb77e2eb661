"""`rapi bench range` on the simulated laboratory behind real wires."""

import contextlib
import json

import numpy as np
import pytest
from benches import Served, bench_file

from fitting.cli import app
from fitting.commands.run import run
from hardware import HislipServer, TcpServer
from hardware.simulated import Closing, MeasurementArm, Target
from rapi_jax import triangle
from rapi_jax.io import read_fringe_records, write_drive

pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")

SLOW = {"sample_hz = 10e6": "sample_hz = 1e6"}
ARM = MeasurementArm(Target(0.7))


def rapi(*arguments):
    return run(app, [str(a) for a in arguments])


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Notes on what is in use, of this test alone."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def drive(tmp_path):
    path = tmp_path / "drive.csv"
    write_drive(triangle(80.0, amplitude=2.0, bias=3.0, samples=2000)[0], path)
    return path


@pytest.mark.parametrize("server", [HislipServer, TcpServer])
def test_records_are_taken(tmp_path, drive, server, capsys):
    output = tmp_path / "records"
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, server, change=SLOW, arm=ARM)
        code = rapi(
            "bench", "range", served.bench, drive, "-o", output,
            "--periods", 2, "--records", 2, "--json",
        )  # fmt: skip
        assert code == 0
        assert served.parked()
    told = json.loads(capsys.readouterr().out)
    settings = json.loads((output / "settings.json").read_text())
    assert settings["generator"]["OUTP1:POL"] == "NORM" and settings["laser"]["tracking"] == "0"
    assert settings["digitizer"]["CHAN3:INV"] == "0"
    records = read_fringe_records(output)
    assert told["count"] == len(records.records) == 2
    assert told["samples"] == records.records[0].size
    assert records.excitation_hz == pytest.approx(80.0)
    assert records.cavity_spacing_hz == 1.5e9
    for record in records:
        assert record.rising_at_start is True
        assert np.ptp(record.measurement.astype(int)) > 20_000  # of 65 536 codes over 1.4 V
        assert record.cavity is not None


@pytest.mark.fault(
    name="an instrument fails among fringe records", promise="the records that were taken are kept"
)
def test_a_failure_keeps_the_records_that_were_taken(tmp_path, drive, capsys):
    output = tmp_path / "part"
    fault = {"fault": Closing(1000), "when": b":WAV:DATA?", "after": 3}
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer, change=SLOW, arm=ARM, digitizer=fault)
        assert rapi("bench", "range", served.bench, drive, "-o", output, "--records", 3) == 6
        assert served.parked()
    told, error = capsys.readouterr()
    assert error.startswith("instrument: ")
    assert "1 record(s) written" in told
    records = read_fringe_records(output)
    assert len(records.records) == 1
    assert "Interrupted" in records.notes[0]


@pytest.mark.fault(name="a drive that cannot be played", promise="refused before a byte")
def test_what_cannot_be_played_is_refused_before_a_byte(tmp_path, drive, capsys):
    wide = tmp_path / "wide.csv"
    write_drive(triangle(40.0, amplitude=9.0, bias=4.0, samples=2000)[0], wide)
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer, change=SLOW, arm=ARM)
        assert rapi("bench", "range", served.bench, wide, "-o", tmp_path / "r") == 3
        (tmp_path / "file").write_text("mine")
        assert rapi("bench", "range", served.bench, drive, "-o", tmp_path / "file") == 3
        (records := tmp_path / "records").mkdir()
        (records / "manifest.toml").write_text('schema = "rapi.fringes/1"\n')
        (records / "settings.json").write_text('{"mine": 1}')
        assert rapi("bench", "range", served.bench, drive, "-o", records) == 3
        assert not served.lab.generator.seen[1].times_on
    error = capsys.readouterr().err
    assert "wide.csv: " in error and "settings.json is there and holds no settings" in error
    assert (records / "settings.json").read_text() == '{"mine": 1}'
    assert not (tmp_path / "r").exists()
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.fault(
    name="a drive of another result than its certificate", promise="exit 3, one line, not played"
)
def test_a_drive_of_another_result_is_refused(tmp_path, drive, capsys):
    """The certificate beside it was written with another file of that name."""
    content = {"schema": "rapi.certificate/1", "files": {drive.name: "0" * 64}}
    (tmp_path / "certificate.json").write_text(json.dumps(content))
    bench = bench_file(tmp_path, measurement=True)
    assert rapi("bench", "range", bench, drive, "-o", tmp_path / "r", "--dry-run") == 3
    assert rapi("measure", bench, drive, "-o", tmp_path / "r", "--dry-run") == 3
    errors = capsys.readouterr().err.splitlines()
    assert errors[0] == errors[1]
    assert "is not the file that certificate.json" in errors[0]


def test_a_bench_without_a_measurement_arm(tmp_path, drive, capsys):
    assert rapi("bench", "range", bench_file(tmp_path), drive, "-o", tmp_path / "r") == 3
    assert "`digitizer.measurement` is missing" in capsys.readouterr().err


def test_a_dry_run_connects_to_nothing(tmp_path, drive):
    bench = bench_file(tmp_path, measurement=True, change=SLOW)
    output = tmp_path / "bytes"
    assert rapi("bench", "range", bench, drive, "-o", output, "--dry-run", "--records", 2) == 0
    sent = (output / "digitizer.bytes").read_bytes()
    assert sent.count(b":SING") == 2
    assert sent.count(b":WAV:SOUR CHAN3") == 2
    assert (output / "generator.bytes").read_bytes().rstrip().endswith(b"OUTP1:STAT?")


def test_usage(capsys):
    assert rapi("bench", "range", "a.toml", "b.csv", "-o", "r", "--records", 0) == 2
    assert rapi("bench", "serve", "a.toml", "--target", "-1") == 2
