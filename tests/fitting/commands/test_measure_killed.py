"""`rapi measure` that is killed outright while it plays: what the output does then."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from benches import Served

from hardware import HislipServer
from rapi_jax import triangle
from rapi_jax.io import write_drive

pytestmark = pytest.mark.process

pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")
ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.fault(
    name="SIGKILL to `rapi measure` while it plays, with a watchdog and without",
    promise="the output stops by itself; without one it plays on",
)
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("watchdog_s", [None, 2.0])
def test_with_a_watchdog_the_output_stops_by_itself(tmp_path, monkeypatch, watchdog_s):
    """Without one it plays on. SIGKILL comes while the drive settles, of which no end is near.

    That takes 100 s without one and 5 s with: a busy machine is late with the signal by seconds.
    """
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (drive,) = triangle([100.0], amplitude=1.0, bias=3.0, samples=1000)
    write_drive(drive, tmp_path / "drive.csv")
    head = "" if watchdog_s is None else f"watchdog_s = {watchdog_s}\n"
    periods = 10_000 if watchdog_s is None else 500
    change = {"settling = 2": f"settling = {periods}", "load_ohm = inf": f"{head}load_ohm = inf"}
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, HislipServer, change=change)
        command = ["measure", str(served.bench), str(tmp_path / "drive.csv")]
        started = subprocess.Popen(
            [sys.executable, "-m", "fitting.cli", *command, "-o", str(tmp_path / "part")],
            cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        generator, until = served.lab.generator, time.monotonic() + 120.0

        def plays():
            """At full size: on the way there one level is set after the other."""
            wave = generator.output(1)
            return wave is not None and np.ptp(wave.volts) > 0.99

        try:
            while not plays():
                assert started.poll() is None and time.monotonic() < until
                time.sleep(0.01)
            os.kill(started.pid, signal.SIGKILL)
            assert started.wait() == -signal.SIGKILL
        finally:
            started.kill()
            started.wait()
        end_s = generator.pulse_s(1, time.monotonic())[1]
        if watchdog_s is None:
            assert end_s == np.inf and plays()
            return
        assert end_s - time.monotonic() < periods / 100.0 + 0.05 + watchdog_s
        while time.monotonic() < end_s:
            time.sleep(0.05)
        rest = generator.output(1)
        assert np.ptp(rest.volts) == 0.0 and rest.volts[0] == pytest.approx(2.5, abs=0.01)
