"""Public drivers of the instruments, as their makers and others wrote them, on the simulated ones.

They know nothing of this project, so what they find unlike the real instrument is a fault here. A
driver is tried where its package can be imported, or is in a folder of its name (`tm_devices`,
`qmi`, `qcodes`, `pymeasure`) in the folder that `RAPI_PUBLIC_DRIVERS` names, each put there by
`python3 -m uv pip install --target`.
"""

import ast
import importlib.util
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hardware import TcpServer
from hardware.simulated import SimulatedBench, WiredLaboratory

pytestmark = pytest.mark.slow
SCRIPT = Path(__file__).resolve().parents[2] / "support/public_drivers.py"
MODULES = {"pymeasure_scope": "pymeasure", "qcodes": "qcodes_contrib_drivers"}
# Faults of the drivers, not of the instrument: a header that it does not have; an attribute that
# the driver's class does not have.
OWN_FAULTS = {
    "pymeasure": {"set impedance 10000", "get impedance 10000", "enable"},
}
FOUND = {
    "tm_devices": {
        "identity": "('AFG31052', 'AFG31052', 2)", "read back": "'7.0000000000E+00'",
    },
    "qmi": {
        "get_waveform": "<Waveform.RAMP: 'RAMP'>", "get_continuous_frequency": "40.0",
        "get_output_load_impedance": "inf", "get_amplitude": "(0.0, 2.0)",
        "get_output_inverted": "True", "get_burst_mode": "<BurstMode.TRIGGERED: 'TRIG'>",
        "get_burst_count": "7", "get_burst_count inf": "inf", "get_pulse_duty_cycle": "30.0",
        "get_trigger_edge": "<TriggerEdge.FALLING: 'NEG'>",
    },
    "qcodes": {
        "get impedance_output1": "10000.0", "get polarity_output1": "'INV'",
        "get am_depth1": "50.0", "get burst_ncycles1": "7.0", "get burst_tdelay1": "0.5",
        "get center_freq1": "550.0", "get freq_span1": "900.0", "get voltage_offset1": "0.25",
        "get voltage_amplitude1": "1.0", "get state_output1": "True", "get ref_osc_source": "'INT'",
    },
    "pymeasure": {
        "get shape ramp": "'ramp'", "get frequency 40.0": "40.0", "get amp_vpp 1.5": "1.5",
        "get offset 0.25": "0.25", "get duty 30.0": "30.0", "get unit VRMS": "'VRMS'",
    },
    "pymeasure_scope": {
        "get timebase_scale": "0.002", "get ch1.scale": "0.2", "get ch1.label": "'\"FRINGES\"'",
        "get waveform_format": "'word'",
    },
}  # fmt: skip


def environment(name):
    """Of the process that speaks to the instrument; skips where the driver is not installed."""
    module = MODULES.get(name, name)
    folder = os.environ.get("RAPI_PUBLIC_DRIVERS")
    if folder:
        folder = str(Path(folder) / name.removesuffix("_scope"))
        if (Path(folder) / module).is_dir():
            return os.environ | {"PYTHONPATH": folder, "PYTHONWARNINGS": "ignore"}
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"the package {module} is not installed, nor in RAPI_PUBLIC_DRIVERS")
    return os.environ | {"PYTHONWARNINGS": "ignore"}


@pytest.mark.parametrize("name", FOUND)
def test_a_public_driver_finds_what_it_expects(name, tmp_path):
    with_driver = environment(name)
    lab = WiredLaboratory(SimulatedBench.like_paper().laboratory)
    scope = name.endswith("_scope")
    if scope:
        setup = ("OUTP1:IMP INF", "SOUR1:FUNC RAMP", "SOUR1:FREQ 40", "SOUR1:VOLT:HIGH 4")
        for message in (*setup, "SOUR1:VOLT:LOW 1", "OUTP1 ON"):
            assert not list(lab.generator.feed(f"{message}\n".encode()))
    with TcpServer(lab.oscilloscope if scope else lab.generator) as server:
        port = server.resource.split("::")[2]
        done = subprocess.run(
            [sys.executable, str(SCRIPT), name, "127.0.0.1", port],
            env=with_driver, cwd=tmp_path, capture_output=True, text=True, timeout=120,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    came = json.loads(done.stdout)
    no_error = {operation: one["queue"].lstrip("+")[:2] for operation, one in came.items()}
    wrong = {
        operation: (one["error"], one["queue"])
        for operation, one in came.items()
        if one["error"] or operation != "close" and no_error[operation] != "0,"
    }
    assert set(wrong) == OWN_FAULTS.get(name, set()), wrong
    assert {key: came[key]["value"] for key in FOUND[name]} == FOUND[name]
    _check_state(name, lab, came)


def _check_state(name, lab, came):
    """What the instrument really does after it all."""
    wave = lab.generator.output(1)
    if name == "tm_devices":  # seven periods of 1 kHz, begun by `*TRG` or by the internal clock
        assert wave is not None and lab.generator._outputs[1].play.burst
        assert lab.generator.output(2).frequency_hz == 50.0
        high = lab.generator.output(2).codes > 0
        assert high.mean() == pytest.approx(0.3, abs=0.01)
    elif name == "qmi":
        assert math.isinf(lab.generator._outputs[1].set_ohm) and wave is not None
    elif name == "qcodes":
        assert wave is not None and lab.generator._outputs[1].play.inverted
    elif name == "pymeasure":
        assert lab.generator._outputs[1].level("amplitude") == pytest.approx(1.0)
    else:
        data = ast.literal_eval(came["download_data"]["value"])
        assert data["points"] == 1000 and data["spread"] > 0.3
