"""Commands as processes of their own, and interrupts at any time."""

import json
import os
import signal
import time

import pytest
from bad_input import FAST, data, put
from command_output import assert_model, assert_one_line, process, without_progress

NAN = float("nan")


@pytest.mark.fault(
    name="an interrupt in each command", promise="exit 130, one line, nothing half-written"
)
@pytest.mark.parametrize(
    "command", ["fit", pytest.param("demo", marks=pytest.mark.slow), "predict"]
)
def test_interrupt(command, rapi, monkeypatch, fitted, tmp_path):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("fitting.identification._identify.identify", interrupt)
    monkeypatch.setattr("rapi_jax.io.read_model", interrupt)
    inputs = {"fit": [fitted / "recording"], "demo": [], "predict": [fitted, fitted / "recording"]}
    code, out, err = rapi(command, *inputs[command], "-o", tmp_path / "o")
    assert code == 130
    assert_one_line(err, "interrupted")
    assert command != "fit" or not (tmp_path / "o").exists()


@pytest.mark.process
def test_as_a_process(fitted, tmp_path):
    """Exit codes and streams as a shell sees them."""
    data(put(0, 1, 3, NAN))(tmp_path / "bad")
    begun = {
        0: process(
            "predict", fitted, fitted / "recording", "-o", tmp_path / "o", "--json", "--no-plots"
        ),
        2: process("fit", fitted, "-o", tmp_path / "n", "--strats", "2"),
        3: process("fit", tmp_path / "bad", "-o", tmp_path / "p"),
        4: process(
            "fit",
            fitted / "recording",
            "-o",
            tmp_path / "q",
            "--json",
            *FAST[:2],
            "--starts",
            "1",
            "--no-plots",
        ),
    }
    said = {code: one.communicate(timeout=240) for code, one in begun.items()}
    assert [one.returncode for one in begun.values()] == list(begun)
    assert json.loads(said[0][0])["schema"] == "rapi.prediction/1" and said[0][1] == ""
    assert said[2][0] == said[3][0] == ""
    assert_one_line(said[2][1], "--starts")
    assert_one_line(without_progress(said[3][1]), "run00.csv", "sample 3")
    assert_model(tmp_path / "q", said[4][0])
    assert without_progress(said[4][1]) == ""


@pytest.mark.fault(
    name="SIGINT to a real process while JAX loads, traces, compiles or runs",
    promise="exit 130, one line",
)
@pytest.mark.process
@pytest.mark.skipif(os.name == "nt", reason="no such signal")
@pytest.mark.parametrize("delay", [0.1, 1.3, 1.9, 2.8])
def test_a_real_interrupt(fitted, tmp_path, delay):
    """While JAX is loading, tracing, compiling or running."""
    options = ("--starts", "100", "--each", "lam,eta")
    one = process("fit", fitted / "recording", "-o", tmp_path / "o", *options)
    deadline = time.monotonic() + 120
    while not (tmp_path / "o").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(delay)
    one.send_signal(signal.SIGINT)
    _, err = one.communicate(timeout=240)
    assert one.returncode == 130 and not (tmp_path / "o").exists(), err
    assert_one_line(without_progress(err), "interrupted")
