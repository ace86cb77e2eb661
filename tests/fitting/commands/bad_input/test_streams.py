"""Streams and paths as a shell may give them: one line, and an exit code of the contract."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from bad_input import FAST
from command_output import assert_one_line

from fitting.commands.run import explain_error, one_line


@pytest.mark.fault(
    name="a reader that goes away, a full device, an ASCII terminal, a platform that is not there",
    promise="one line and the right exit code",
)
@pytest.mark.process
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device")
def test_streams_of_a_real_process(fitted, tmp_path):
    """A reader that goes away, a full device, a terminal of ASCII, a platform that is not there."""
    command = [sys.executable, "-m", "fitting.cli", "predict", fitted, fitted / "recording"]
    read, write = os.pipe()
    os.close(read)
    full = os.open("/dev/full", os.O_WRONLY)
    cases = {
        "pipe": (["--no-plots"], {"stdout": write}, {}),
        "full": (["--no-plots"], {"stdout": full}, {}),
        "both full": (["--json", "--no-plots"], {"stdout": full, "stderr": full}, {}),
        "ASCII": (["--no-plots"], {}, {"PYTHONIOENCODING": "ascii"}),
        "platform": (["--no-plots"], {}, {"JAX_PLATFORMS": "nonsense"}),
    }
    begun = {
        name: subprocess.Popen(
            [*map(str, command), "-o", str(tmp_path / name), *options],
            env={**os.environ, **environment},
            **({"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams),
        )
        for name, (options, streams, environment) in cases.items()
    }
    said = {name: one.communicate(timeout=240) for name, one in begun.items()}
    codes = {name: one.returncode for name, one in begun.items()}
    assert codes == {"pipe": 0, "full": 3, "both full": 3, "ASCII": 0, "platform": 2}, said
    assert said["pipe"][1] == b""
    assert_one_line(said["full"][1].decode(), "standard output", "No space left")
    assert said["ASCII"][1] == b"" and said["ASCII"][0].isascii()
    assert_one_line(said["platform"][1].decode(), "JAX_PLATFORMS=nonsense", "such as cpu")


LONG = "a" * 300
PATHS = {
    "recording": lambda bad, fitted: ("fit", bad, "-o", "o", *FAST),
    "output": lambda bad, fitted: ("fit", fitted / "recording", "-o", bad, *FAST),
    "model": lambda bad, fitted: ("predict", bad, fitted / "recording", "-o", "o"),
    "plugin": lambda bad, fitted: ("fit", fitted / "recording", "-o", "o", "--plugin", bad),
    "limits": lambda bad, fitted: (
        "compensate", fitted, "--span", "60", "--frequency", "10", "-o", "o", "--limits", bad,
    ),
    "records": lambda bad, fitted: ("range", bad, "-o", "o"),
    "checked": lambda bad, fitted: ("check", bad),
    "batch": lambda bad, fitted: ("batch", bad, "-o", "o"),
    "batch output": lambda bad, fitted: ("batch", fitted / "recording", "-o", bad),
    "bench": lambda bad, fitted: ("bench", "check", bad),
    "imported": lambda bad, fitted: ("import", bad, "-o", "o", "--drive-unit", "V"),
}  # fmt: skip


@pytest.mark.fault(name="a path that no system takes", promise="exit 3, one line")
@pytest.mark.parametrize("name", PATHS)
def test_a_path_that_no_system_takes_is_one_line(name, rapi, fitted, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for bad in (LONG, "a/" * 3000, "a\0b"):
        code, out, err = rapi(*PATHS[name](bad, fitted))
        assert code in (2, 3) and out == "", (bad[:5], err)
        assert_one_line(err)
        assert len(err) < 1000 and not (tmp_path / "o").exists()


@pytest.mark.fault(name="a disk that fails while reading", promise="exit 3, one line")
@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="no such file")
def test_a_disk_that_fails_while_reading_is_one_line(rapi, fitted, tmp_path):
    for command in (("fit", "/proc/self/mem"), ("predict", "/proc/self/mem", fitted / "recording")):
        code, _, err = rapi(*command, "-o", tmp_path / "o")
        assert code == 3
        assert_one_line(err, "/proc/self/mem", "Input/output error")


def test_texts_of_errors_are_capped():
    assert len(one_line("x" * 10**7)) == 1500
    assert explain_error(OSError(5, "Input/output error", "a" * 10**4))[2].count("a") < 250
    code, kind, _ = explain_error(RuntimeError("Unable to initialize backend 'x'"))
    assert (code, kind) == (2, "usage")


def test_the_model_is_not_blamed_for_a_platform(fitted, monkeypatch):
    from rapi_jax.io import read_model

    def fail():
        raise RuntimeError("Unable to initialize backend 'nonsense'")

    monkeypatch.setattr("jax.devices", fail)
    with pytest.raises(RuntimeError, match="Unable to initialize"):
        read_model(fitted / "model.rapi")
