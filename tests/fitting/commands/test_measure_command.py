"""`rapi measure` and `rapi bench` on the simulated laboratory behind real wires."""

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest
from benches import Served, bench_file

from fitting.cli import app
from fitting.commands.measure import _describe_next, _expand, _is_listed, _readout_lines
from fitting.commands.run import run
from hardware import HislipServer, TcpServer
from hardware.simulated import Silent, SimulatedBench
from rapi_jax import DataError, triangle
from rapi_jax.io import read_drive, read_recording, write_drive

pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")


def rapi(*arguments):
    return run(app, [str(a) for a in arguments])


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Notes on what is in use, of this test alone."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_the_next_command_is_a_check_where_a_certificate_names_the_drives(tmp_path):
    (folder := tmp_path / "my drives").mkdir()
    sent = [folder / "drive_10Hz.csv", folder / "drive_20Hz.csv"]
    fit = "Next: `rapi fit scan -o result`"
    assert _describe_next(sent, Path("scan")) == fit
    (folder / "certificate.json").write_text("{}")
    assert _describe_next(sent, Path("scan")) == f"Next: `rapi fit scan --check '{folder}'`"
    assert _describe_next([], Path("scan")) == fit  # not all are listed
    assert _describe_next([*sent, tmp_path / "other.csv"], Path("scan")) == fit


@pytest.fixture
def drives(tmp_path):
    """Files of a drive at each of two rates, and of one beyond the limits."""
    found = {}
    for name, drive in {
        "40": triangle([40.0], amplitude=3.0, bias=3.0, samples=2000)[0],
        "80": triangle([80.0], amplitude=2.0, bias=3.0, samples=2000)[0],
        "wide": triangle([40.0], amplitude=9.0, bias=4.0, samples=2000)[0],
    }.items():
        found[name] = tmp_path / f"{name}.csv"
        write_drive(drive, found[name])
    return found


@pytest.mark.parametrize(
    "server", [HislipServer, pytest.param(TcpServer, marks=pytest.mark.process)]
)
def test_measured(tmp_path, drives, server, capsys):
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, server)
        output = tmp_path / "recording"
        assert rapi("measure", served.bench, drives["40"], drives["80"], "-o", output) == 0
        assert served.parked()
        said = " ".join(capsys.readouterr().out.split())
        assert (
            said.count("no certificate.json or drives.json beside") == 1
            and "80.csv lists them: the bench's limits" in said
        )
        assert rapi("bench", "check", served.bench, "--json") == 0
        told = json.loads(capsys.readouterr().out)
        assert told["laser_head"] == "TLB-6712" and "2000 V/s" in told["limits"]
    recording = read_recording(output)
    assert [run.drive.rate for run in recording.runs] == pytest.approx([40.0, 80.0])
    assert recording.provenance["bench"] == "laboratory"
    bench = SimulatedBench.like_paper()
    for measured in recording.runs:
        off = measured.response - bench.truth(measured.drive)
        assert np.nanstd(off) < 1.5e-3  # GHz: another generator's grid of levels


def test_of_a_drive_that_a_list_names_nothing_is_left_unchecked(tmp_path, drives):
    ends = ("--low", 1.5, "--high", 4.5)
    assert rapi("drive", "--rate", 40, *ends, "-o", tmp_path / "listed") == 0
    assert _is_listed(tmp_path / "listed" / "drive_40Hz.csv") and not _is_listed(drives["40"])


@pytest.mark.fault(
    name="a drive beyond the bench's limits, under `rapi measure`", promise="exit 3, nothing played"
)
def test_nothing_is_played_beyond_the_limits(tmp_path, drives, capsys):
    high = tmp_path / "high.csv"
    write_drive(triangle([40.0], amplitude=1.0, bias=9.0, samples=2000)[0], high)
    several = (drives["40"], drives["wide"], high)
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer)
        assert rapi("measure", served.bench, *several, "-o", tmp_path / "r") == 3
        assert not served.lab.generator.seen[1].times_on
    error = capsys.readouterr().err
    first, _, others = error.partition(" Refused, too: ")
    assert "wide.csv: " in first and "high.csv" in others and error.count("\n") == 1
    assert not (tmp_path / "r").exists()


@pytest.mark.fault(
    name="an instrument that is silent in the second run", promise="exit 6, the first run written"
)
@pytest.mark.process  # as long as the time limits of its connection
def test_an_instrument_that_fails_is_exit_code_6(tmp_path, drives, capsys):
    """In the second run; the first is written."""
    fault = {"fault": Silent(), "when": b":WAV:DATA?", "after": 2}
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer, digitizer=fault)
        output = tmp_path / "part"
        code = rapi("measure", served.bench, drives["40"], drives["80"], "-o", output)
        assert code == 6
        assert served.parked()
    error = capsys.readouterr().err
    assert error.startswith("instrument: ") and error.count("\n") == 1
    recording = read_recording(output)
    assert len(recording.runs) == 1 and recording.provenance["incomplete"] == "yes"


@pytest.mark.fault(name="an open interlock", promise="exit 6")
def test_an_open_interlock_is_exit_code_6(tmp_path, drives, capsys):
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer)
        served.lab.laser.interlock = False
        assert rapi("measure", served.bench, drives["40"], "-o", tmp_path / "r") == 6
        assert not served.lab.generator.seen[1].times_on
    assert "Close the interlock" in capsys.readouterr().err


@pytest.mark.fault(name="a laser that is off", promise="exit 6")
def test_a_laser_that_is_off(tmp_path, drives, capsys):
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer)
        served.lab.laser.output = False
        assert rapi("measure", served.bench, drives["40"], "-o", tmp_path / "r") == 6
    assert "The laser is off" in capsys.readouterr().err


def test_a_dry_run_connects_to_nothing_and_says_what_it_would_play(tmp_path, drives, capsys):
    bench = bench_file(tmp_path)
    output = tmp_path / "bytes"
    assert rapi("measure", bench, drives["40"], "-o", output, "--dry-run") == 0
    scan, total, *_ = capsys.readouterr().out.splitlines()
    volt = read_drive(drives["40"], waveform="triangle").value
    assert scan.startswith(f"40 Hz: {volt.min():.4g} to {volt.max():.4g} V, at most ")
    assert total.startswith("1 scan(s), of which 3 period(s) each are recorded: 0.075 s")
    sent = (output / "generator.bytes").read_bytes()
    assert sent.startswith(b"*IDN?\n") and b"DATA:DATA EMEM1,#6262144" in sent
    assert sent.rstrip().endswith(b"OUTP1:STAT?")
    assert {path.name for path in output.iterdir()} == {
        "generator.bytes", "digitizer.bytes", "laser.bytes",
    }  # fmt: skip


def test_a_folder_stands_for_the_drives_in_its_list(tmp_path):
    for name in ("drive_10Hz.csv", "drive_2.5Hz.csv", "stray.csv"):
        (tmp_path / name).touch()
    (tmp_path / "drives.json").write_text(
        json.dumps(
            {
                "schema": "rapi.drives/1",
                "files": {"drive_10Hz.csv": "0", "drive_10Hz.afg": "0", "drive_2.5Hz.csv": "0"},
            }
        )
    )
    single = tmp_path / "stray.csv"
    found = _expand([tmp_path, single])
    assert [path.name for path in found] == ["drive_2.5Hz.csv", "drive_10Hz.csv", "stray.csv"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(DataError, match=r"empty: a folder without drives .* Name the CSV files"):
        _expand([tmp_path / "empty"])


def test_of_a_doubtful_reading_two_lines_are_told():
    many = "; ".join(f"cavity: spurious peak at {t} s" for t in range(57))
    (line,) = _readout_lines({"run04_faults": many})
    assert line.startswith("run04: its reading was doubtful: cavity: spurious peak at 0 s; ")
    assert "and 55 more of this kind in the manifest. Record that drive again" in line
    (short,) = _readout_lines({"a_faults": "one"})
    assert "more" not in short


@pytest.mark.fault(name="a bench file that is none", promise="exit 3, one line")
@pytest.mark.parametrize(
    ("text", "says"), [("schema = 1", "`schema`"), ("[[[", "not valid TOML"), ("", "`schema`")]
)
def test_a_bench_file_that_is_none(tmp_path, drives, capsys, text, says):
    bench = tmp_path / "bench.toml"
    bench.write_text(text)
    assert rapi("bench", "check", bench) == 3
    assert rapi("measure", bench, drives["40"], "-o", tmp_path / "r") == 3
    assert says in capsys.readouterr().err


@pytest.mark.fault(
    name="a file in the folder for raw records, or for the bytes of a dry run",
    promise="exit 3, one line, nothing connected, the file as it was",
)
@pytest.mark.parametrize("name", ["notes.txt", "run07.json", "run00.cavity.npy"])
@pytest.mark.parametrize("option", ["--raw", "-o"])
def test_a_folder_that_is_not_its_own_is_refused(tmp_path, drives, capsys, option, name):
    """At an address where nothing answers, so that a connection would be exit code 6."""
    (folder := tmp_path / "mine").mkdir()
    (folder / name).write_bytes(b"mine")
    output = ("-o", tmp_path / "r", "--raw", folder)
    if option == "-o":
        output = ("-o", folder, "--dry-run")
    bench = bench_file(tmp_path, generator="TCPIP::127.0.0.1::1::SOCKET")
    assert rapi("measure", bench, drives["40"], *output) == 3
    error = capsys.readouterr().err
    assert name in error and error.count("\n") == 1
    assert [(one.name, one.read_bytes()) for one in folder.iterdir()] == [(name, b"mine")]


def test_an_empty_folder_for_raw_records_is_filled(tmp_path, drives):
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer)
        output = ("-o", tmp_path / "r", "--raw", tmp_path / "raw")
        assert rapi("measure", served.bench, drives["80"], *output) == 0
        names = ["run00.cavity.npy", "run00.interferometer.npy", "run00.json"]
        assert sorted(one.name for one in (tmp_path / "raw").iterdir()) == names
        times_on = served.lab.generator.seen[1].times_on
        assert rapi("measure", served.bench, drives["80"], *output) == 3  # they are there
        assert served.lab.generator.seen[1].times_on == times_on
