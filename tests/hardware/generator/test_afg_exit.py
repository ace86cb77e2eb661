"""A process that ends, or is asked to, parks its output first."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hardware import AFG31000, DriveLimits, Scpi
from hardware.simulated import SimulatedAFG31052, SimulatedLink

ROOT = Path(__file__).resolve().parents[3]
LIMITS = DriveLimits(0.0, 7.5, 4000.0, 0.5, 100.0)

SCRIPT = """
import atexit, os, signal
import numpy as np
from hardware import AFG31000, DriveLimits, Scpi
from hardware.simulated import SimulatedAFG31052, SimulatedLink

instrument = SimulatedAFG31052()
def tell():
    seen = instrument.seen[1]
    print(instrument.output(1), seen.times_on, seen.relay_v <= 0.0041)
atexit.register(tell)  # done last
limits = DriveLimits(0.0, 7.5, 4000.0, 0.5, 100.0)
channel = AFG31000(Scpi(SimulatedLink(instrument))).channel(1, limits=limits)
channel.load(np.array([3.0, 3.1]), 10.0)
channel.start()
assert instrument.output(1) is not None
if {kill}:
    os.kill(os.getpid(), signal.SIGTERM)
"""


@pytest.mark.fault(
    name="the process ends, or is told to end, with the output on", promise="ramped to park and off"
)
@pytest.mark.parametrize(("kill", "code"), [(False, 0), (True, 143)])
def test_a_process_that_ends_parks_its_output(kill, code):
    script = SCRIPT.format(kill=kill)
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == code, done.stderr
    assert done.stdout.split() == ["None", "1", "True"]


def test_the_signal_is_given_back_when_the_output_is_off():
    before = signal.getsignal(signal.SIGTERM)
    with AFG31000(Scpi(SimulatedLink(SimulatedAFG31052()))) as afg:
        channel = afg.channel(1, limits=LIMITS)
        channel.load(np.array([0.5, 0.6]), 10.0)
        channel.start()
        assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
    assert signal.getsignal(signal.SIGTERM) is before
