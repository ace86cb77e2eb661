"""The whole loop through real VISA on simulated instruments: straighter scans, as in Table 1."""

import contextlib

import numpy as np
import pytest
from benches import Served

from fitting import identify
from hardware import TcpServer, open_bench
from rapi_jax import Identified, compensate, linear_scan, linearity, triangle

pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")

pytestmark = pytest.mark.process  # servers, sockets; 1 min
RATES = (20.0, 40.0)
# The paper's rms nonlinearity in MHz at these rates, without and with compensation.
WITHOUT = {"up": (400.0, 400.0), "down": (3240.0, 3030.0)}
WITH = {"up": (75.8, 33.8), "down": (243.0, 154.0)}


def rms_mhz(recording):
    """By branch, one value a rate."""
    found = [linearity(run) for run in recording.runs]
    return {side: [1e3 * getattr(one, side).rms_ghz for one in found] for side in WITH}


def test_measure_identify_compensate_upload_measure(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, TcpServer)
        with open_bench(served.bench) as bench:
            training = bench.measure(triangle(RATES, amplitude=4.5, bias=3.0, samples=2000))
            model = identify(training)  # raises where it is not to be trusted
            seen = Identified.of(training)
            drives = [
                compensate(model.ecdl, target, identified=seen, limits=bench.limits, bias=3.0).drive
                for target in linear_scan(RATES, span=75.0)
            ]
            check = bench.measure(drives)
        assert served.parked()
    before, after = rms_mhz(training), rms_mhz(check)
    for side in WITH:
        np.testing.assert_allclose(before[side], WITHOUT[side], rtol=0.02)
        for k, rate in enumerate(RATES):
            paper = WITHOUT[side][k] / WITH[side][k]
            assert before[side][k] / after[side][k] > paper, (side, rate)
            assert after[side][k] < 1.0, (side, rate)  # a reading is good to 0.2 MHz
    assert check.provenance["bench"] == "laboratory"
    assert [run.span for run in check.runs] == pytest.approx([75.0, 75.0], rel=2e-3)
