"""The same commands, unchanged, on lasers that their current tunes, behind real wires."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.cli import app
from fitting.commands.bench import app as bench_app
from fitting.commands.run import run
from hardware.simulated import SimulatedBench
from rapi_jax import linearity, triangle
from rapi_jax.io import read_recording, write_drive

pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")

LIMITS = "low_v = 0.0\nhigh_v = 5.0\nslew_v_per_s = 25000.0\nmax_frequency_hz = 1000.0\n"


def rapi(*arguments):
    return run(app, [str(a) for a in arguments])


@pytest.fixture
def served(tmp_path, monkeypatch):
    """`rapi bench serve FILE --laser NAME`; what is to be done while it serves, in its wait."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def serve(laser, meanwhile):
        path = tmp_path / "bench.toml"

        class Event:
            def wait(self):
                meanwhile(path)

        with monkeypatch.context() as patch:
            patch.setattr(bench_app, "threading", SimpleNamespace(Event=Event))
            assert rapi("bench", "serve", path, "--laser", laser) == 0

    return serve


def written(folder, drives):
    """Files of drives."""
    for number, drive in enumerate(drives):
        write_drive(drive, folder / f"{number}.csv")
    return [folder / f"{number}.csv" for number in range(len(drives))]


def rms(recording):
    found = [linearity(run) for run in recording.runs]
    return np.array([[one.up.rms_ghz, one.down.rms_ghz] for one in found])


def test_ctrl_c_ends_a_laboratory_and_says_so(served, capsys):
    def interrupt(path):
        raise KeyboardInterrupt

    served("ecdl", interrupt)  # exit code 0
    assert capsys.readouterr().out.endswith("the laboratory has ended\n")


def test_served_and_measured(tmp_path, served, capsys):
    (drive,) = triangle([1000.0], amplitude=4.0, bias=2.5, samples=500)
    (fast,) = triangle([1500.0], amplitude=1.0, bias=2.5, samples=500)
    (file, faster) = written(tmp_path, [drive, fast])

    def meanwhile(path):
        capsys.readouterr()
        assert rapi("bench", "check", path, "--json") == 0
        told = json.loads(capsys.readouterr().out)
        assert "laser" not in told and "25000 V/s" in told["limits"]
        assert rapi("measure", path, file, "-o", tmp_path / "recording") == 0
        assert rapi("measure", path, file, faster, "-o", tmp_path / "none") == 3

    served("dfb", meanwhile)
    assert not (tmp_path / "none").exists()
    (measured,) = read_recording(tmp_path / "recording").runs
    off = measured.response + SimulatedBench.dfb().truth(measured.drive)
    assert np.nanstd(off) < 2e-4 * measured.span


def test_the_unmodelled_device_is_the_piezo_laser(tmp_path, capsys):
    path = tmp_path / "bench.toml"
    assert rapi("bench", "serve", path, "--laser", "vcsel", "--device", "unmodelled") == 2
    assert "external-cavity laser" in capsys.readouterr().err
    assert not path.exists()


PLANS = {
    "dfb": ((100.0, 200.0, 400.0), 45.0),
    "vcsel": ((250.0, 500.0, 750.0, 1000.0), 450.0),
}


@pytest.mark.parametrize(  # 3 to 5 min each
    "laser",
    [
        pytest.param("dfb", marks=(pytest.mark.slow, pytest.mark.process)),
        pytest.param("vcsel", marks=pytest.mark.calibration),
    ],
)
def test_measured_fitted_diagnosed_compensated_measured(tmp_path, served, laser):
    """Trusted with a gap that the claim includes and the diagnosis sees; straighter by the drives.

    How straight: on either branch of every scan within what `compensate` promised.
    """
    rates, span = PLANS[laser]
    drives = [
        drive
        for swing in (4.0, 3.0)
        for drive in triangle(rates, amplitude=swing, bias=2.5, samples=500)
    ]
    files = written(tmp_path, drives)
    (tmp_path / "limits.toml").write_text(LIMITS)
    names = ("recording", "fit", "diagnosis", "drives", "check")
    recording, fitted, diagnosis, made, check = (tmp_path / name for name in names)

    def meanwhile(path):
        assert rapi("measure", path, *files, "-o", recording, "--periods", 2) == 0
        assert rapi("fit", recording, "-o", fitted) == 0
        assert rapi("diagnose", recording, "--model", fitted, "-o", diagnosis) == 0
        limits = ("--limits", tmp_path / "limits.toml", "--bias", 2.5)
        scans = ("--span", span, "--frequency", *rates)
        assert rapi("compensate", fitted, *scans, *limits, "-o", made) == 0
        played = [made / f"drive_{rate:g}Hz.csv" for rate in rates]
        assert rapi("measure", path, *played, "-o", check) == 0

    served(laser, meanwhile)
    told = json.loads((fitted / "model.json").read_text())
    assert told["verdict"]["trusted"] and told["verdict"]["with_gap"]
    verdict = json.loads((diagnosis / "diagnosis.json").read_text())["verdict"]
    assert "none" not in verdict["set"]
    before, after = rms(read_recording(recording))[: len(rates)], rms(read_recording(check))
    assert np.all(after < before)
    assert np.all(after.max(axis=1) < 0.5 * before.max(axis=1))
    assert after.max() < told["claim"]["high"]
