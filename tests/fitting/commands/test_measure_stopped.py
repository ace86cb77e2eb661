"""`rapi measure` that ends before its time: finished runs written, output parked and off."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from benches import Served, Watched

from fitting.cli import app
from fitting.commands.run import run
from hardware import HislipServer, TcpServer
from hardware.simulated import Closing, Slow, Unplugged
from rapi_jax import triangle
from rapi_jax.io import read_recording, write_drive

pytestmark = pytest.mark.process

pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

ROOT = Path(__file__).resolve().parents[3]
LONG = {"settling = 2": "settling = 200"}  # 2 s of the first drive, 100 s of the second


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Notes on what is in use, of this test alone."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def drives(tmp_path):
    """Files of two drives, the first quick."""
    found = []
    for rate in (100.0, 2.0):
        (drive,) = triangle([rate], amplitude=1.0, bias=3.0, samples=1000)
        found.append(tmp_path / f"{rate:g}.csv")
        write_drive(drive, found[-1])
    return found


def command(served, drives, output):
    return ["measure", *(str(x) for x in (served.bench, *drives)), "-o", str(output)]


@contextlib.contextmanager
def heard():
    """What is started here hears the end of its terminal, even if the tests run under `nohup`."""
    before = signal.getsignal(signal.SIGHUP)
    if before is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGHUP, before)


@contextlib.contextmanager
def process(served, drives, output):
    """`rapi measure` as a process of its own, which does not outlive the test."""
    with heard():
        started = subprocess.Popen(
            [sys.executable, "-m", "fitting.cli", *command(served, drives, output)],
            cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )  # fmt: skip
    try:
        yield started
    finally:
        started.kill()
        started.communicate()


def wait(mark, started, most_s=120.0):
    """Until `mark()`; fails where the process ends before, or it never comes."""
    until = time.monotonic() + most_s
    while not mark():
        assert started.poll() is None, started.communicate()
        assert time.monotonic() < until
        time.sleep(0.01)


def plays(served):
    """Whether the second drive is at the output, at its full levels."""
    wave = served.lab.generator.output(1)
    second = served.lab.generator.seen[1].times_on == 2
    return second and wave is not None and wave.high_v - wave.low_v > 0.9


def told_to_end(served, drives, output, name, mark):
    """Exit code, standard output and error of `rapi measure` that gets a signal at `mark()`."""
    with process(served, drives, output) as started:
        wait(mark, started)
        started.send_signal(getattr(signal, name))
        told, error = started.communicate(timeout=60)
        return started.returncode, told, error


def first_is_kept(output):
    recording = read_recording(output)
    assert [one.drive.rate for one in recording.runs] == pytest.approx([100.0])
    assert recording.provenance["incomplete"] == "yes"


NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
CODES = {"SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}


@pytest.mark.fault(
    name="SIGINT, SIGTERM, SIGHUP to `rapi measure` while its second drive settles",
    promise="exit 130, 143, 129; parked and off; the first run written, called incomplete",
)
@posix
@pytest.mark.parametrize("name", NAMES)
def test_while_the_second_drive_settles(tmp_path, drives, name):
    output = tmp_path / "part"
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer, change=LONG)
        code, told, error = told_to_end(served, drives, output, name, lambda: plays(served))
        assert code == CODES[name], error
        assert served.parked()
    assert "1 finished run(s) written" in told and "Traceback" not in error
    first_is_kept(output)


@pytest.mark.fault(
    name="the same signals while its second record is read",
    promise="exit code of the signal; parked and off; the first run written",
)
@posix
@pytest.mark.parametrize(("name", "server"), [("SIGINT", HislipServer), ("SIGTERM", TcpServer)])
def test_while_the_second_record_is_read(tmp_path, drives, name, server):
    """The process waits for a block of the oscilloscope that does not come, the output on."""
    watched = []

    def watch(one):
        watched.append(Watched(one, b":WAV:DATA?", 3))
        return watched[0]

    output = tmp_path / "part"
    with contextlib.ExitStack() as stack:
        served = Served(
            stack, tmp_path, server, wraps={"digitizer": watch},
            digitizer={"fault": Slow(90.0), "when": b":WAV:DATA?", "after": 2},
        )  # fmt: skip
        asked = watched[0].event.is_set
        code, _, error = told_to_end(
            served, drives, output, name, lambda: asked() and plays(served)
        )
        assert code == CODES[name], error
        assert served.parked()
    first_is_kept(output)


@pytest.mark.fault(
    name="the same signals while its second drive is loaded",
    promise="exit code of the signal; parked and off; the first run written",
)
@posix
@pytest.mark.parametrize("name", NAMES[:2])
def test_while_the_second_drive_is_loaded(tmp_path, drives, name):
    """The output is off, but a run is finished."""
    watched = []

    def watch(one):
        watched.append(Watched(one, b"DATA:DATA EMEM1", 2))
        return watched[0]

    output = tmp_path / "part"
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer, change=LONG, wraps={"generator": watch})
        code, _, error = told_to_end(served, drives, output, name, watched[0].event.is_set)
        assert code == CODES[name], error
        assert served.parked()
    first_is_kept(output)


@pytest.mark.fault(
    name="the oscilloscope hangs up in the second record",
    promise="exit 6, parked and off, the first run written",
)
@pytest.mark.parametrize("server", [HislipServer, TcpServer])
def test_the_oscilloscope_hangs_up_in_the_second_record(tmp_path, drives, capsys, server):
    fault = {"fault": Closing(1000), "when": b":WAV:DATA?", "after": 2}
    output = tmp_path / "part"
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, server, digitizer=fault)
        assert run(app, command(served, drives, output)) == 6
        assert served.parked()
    told, error = capsys.readouterr()
    assert error.startswith("instrument: ") and error.count("\n") == 1
    assert "1 finished run(s) written" in told
    first_is_kept(output)


@pytest.mark.fault(
    name="the generator is gone in the second upload", promise="exit 6, the first run written"
)
@pytest.mark.parametrize("server", [HislipServer, TcpServer])
def test_the_generator_is_gone_in_the_second_upload(tmp_path, drives, capsys, server):
    taken = 262_144 + 150_000  # bytes: the first upload, and part of the second
    gone = {"generator": lambda one: Unplugged(one, taken)}
    output = tmp_path / "part"
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, server, wraps=gone)
        assert run(app, command(served, drives, output)) == 6
        assert served.parked() and served.lab.generator.seen[1].times_on == 1
    assert capsys.readouterr().err.startswith("instrument: ")
    first_is_kept(output)


def test_a_recording_that_cannot_be_written_does_not_hide_the_failure(
    tmp_path, drives, capsys, monkeypatch
):
    """A file that appears in its place meanwhile; one that is there before is refused at once."""
    checked = "fitting.commands.shared.files._measured_output.check_recording_output"
    monkeypatch.setattr(checked, lambda path: None)
    fault = {"fault": Closing(), "when": b":WAV:DATA?", "after": 2}
    output = tmp_path / "taken"
    output.write_text("something else")
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer, digitizer=fault)
        assert run(app, command(served, drives, output)) == 6
    told, error = capsys.readouterr()
    assert error.startswith("instrument: ") and "could not be written" in told
    assert output.read_text() == "something else"


@pytest.mark.fault(name="an output folder that cannot be written to", promise="found before output")
def test_a_folder_that_cannot_be_written_to_is_found_before_output(tmp_path, drives, capsys):
    (tmp_path / "file").write_text("")
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer)
        assert run(app, command(served, drives, tmp_path / "file" / "recording")) == 3
        assert not served.lab.generator.seen[1].times_on
    assert "is not a folder" in capsys.readouterr().err
