"""Public drivers of the instruments, each spoken to by its own names: what of them works.

A process of its own a driver, since each brings its packages: `python public_drivers.py NAME HOST
PORT` writes one JSON object, by operation: what came back, and the instrument's error queue behind
it. Nothing of this project is imported.
"""

import contextlib
import io
import json
import math
import sys
from collections.abc import Callable, Iterator
from typing import Any

Operations = Iterator[tuple[str, Callable[[], Any]]]
NO_ERROR = "0"


def tm_devices(host: str, port: int) -> Operations:
    """The maker's own package; its driver of the AFG31052."""
    from tm_devices import DeviceManager
    from tm_devices.helpers import PYVISA_PY_BACKEND

    manager = DeviceManager(verbose=False)
    manager.visa_library = PYVISA_PY_BACKEND
    afg = manager.add_afg(host, connection_type="SOCKET", port=port)
    afg.write("*CLS")  # the driver expects that nobody has left anything in the event register
    function = afg.source_device_constants.functions
    yield "error queue", lambda: afg.query("SYST:ERR?")
    yield "identity", lambda: (type(afg).__name__, afg.model, afg.total_channels)
    yield (
        "generate_function SIN",
        lambda: afg.generate_function(
            1e3, function.SIN, 1.0, 0.25, "SOURCE1", termination="HIGHZ", polarity="INVERTED"
        ),
    )
    yield (
        "generate_function RAMP",
        lambda: afg.generate_function(50.0, function.RAMP, 2.0, 1.0, "SOURCE2", symmetry=50.0),
    )
    yield (
        "generate_function PULSE",
        lambda: afg.generate_function(50.0, function.PULSE, 2.0, 1.0, "SOURCE2", duty_cycle=30.0),
    )
    yield (
        "setup_burst",
        lambda: afg.setup_burst(1e3, function.SIN, 1.0, 0.0, 7, "SOURCE1", termination="HIGHZ"),
    )
    yield "generate_burst", afg.generate_burst
    yield "read back", lambda: afg.query("SOUR1:BURS:NCYC?")
    yield "close", manager.close


def qmi(host: str, port: int) -> Operations:
    """QMI's driver of the AFG31000 series."""
    from qmi.core.context import QMI_Context
    from qmi.instruments.tektronix.afg31000 import (
        BurstMode,
        Tektronix_AFG31000,
        TriggerEdge,
        Waveform,
    )

    context = QMI_Context("conformance")
    context.start()
    afg = Tektronix_AFG31000(context, "afg", f"tcp:{host}:{port}")
    afg.open()
    yield "error queue", lambda: afg._scpi_transport.ask("SYST:ERR?")
    yield "reset", afg.reset
    yield "get_idn", lambda: (afg.get_idn().vendor, afg.get_idn().model)
    for name, value in (
        ("waveform", Waveform.RAMP),
        ("continuous_frequency", 40.0),
        ("output_load_impedance", math.inf),
        ("amplitude", (0.0, 2.0)),
        ("output_inverted", True),
        ("burst_mode", BurstMode.TRIGGERED),
        ("burst_count", 7),
        ("burst_enabled", True),
        ("output_enabled", True),
        ("pulse_duty_cycle", 30.0),
        ("pulse_delay", 0.001),
    ):
        values = value if isinstance(value, tuple) else (value,)
        yield f"set_{name}", lambda n=name, v=values: getattr(afg, f"set_{n}")(1, *v)
        yield f"get_{name}", lambda n=name: getattr(afg, f"get_{n}")(1)
    yield "set_burst_count inf", lambda: afg.set_burst_count(1, math.inf)
    yield "get_burst_count inf", lambda: afg.get_burst_count(1)
    yield "get_sweep_enabled", lambda: afg.get_sweep_enabled(1)
    for name, value in (
        ("external_trigger_enabled", True),
        ("trigger_edge", TriggerEdge.FALLING),
        ("external_reference_enabled", True),
    ):
        yield f"set_{name}", lambda n=name, v=value: getattr(afg, f"set_{n}")(v)
        yield f"get_{name}", lambda n=name: getattr(afg, f"get_{n}")()
    yield "set_display_brightness", lambda: afg.set_display_brightness(0.5)
    yield "close", afg.close
    context.stop()


def qcodes(host: str, port: int) -> Operations:
    """QCoDeS' contributed driver of the AFG3000 series: nearly the same commands."""
    from qcodes.instrument import VisaInstrument
    from qcodes_contrib_drivers.drivers.Tektronix.AFG3000 import AFG3000

    # It asks for the noise of four channels when it connects, and waits 20 s for each of the two
    # that are not there.
    connect = VisaInstrument.__init__
    VisaInstrument.__init__ = lambda self, *a, timeout, **k: connect(self, *a, timeout=2, **k)
    afg = AFG3000("afg", f"TCPIP0::{host}::{port}::SOCKET", visalib="@py")
    afg.write("*CLS")
    yield "error queue", lambda: afg.ask("SYST:ERR?")
    yield "get_idn", lambda: afg.get_idn()["model"]
    for name, value in (
        ("impedance_output1", 10000),
        ("polarity_output1", "INV"),
        ("function_shape1", "RAMP"),
        ("function_ramp_symmetry1", 50),
        ("freq_mode1", "CW"),
        ("freq_cw1", 40),
        ("freq_concurrent1", False),
        ("phase1", 90),
        ("am_depth1", 50),
        ("am_internal_freq1", 1000),
        ("am_internal_function1", "SIN"),
        ("am_state1", True),
        ("fm_deviation1", 500),
        ("fm_state1", False),
        ("pm_deviation1", 90),
        ("fsk_freq1", 5000),
        ("fsk_internal_rate1", 50),
        ("fsk_state1", False),
        ("pwm_duty_deviation1", 5),
        ("burst_mode1", "TRIG"),
        ("burst_ncycles1", 7),
        ("burst_tdelay1", 0.5),
        ("burst_state1", True),
        ("freq_start1", 100),
        ("freq_stop1", 1000),
        ("center_freq1", 550),
        ("freq_span1", 900),
        ("sweep_time1", 2),
        ("pulse_duty_cycle1", 30),
        ("pulse_width1", 0.01),
        ("pulse_period1", 0.05),
        ("voltage_limit_high1", 2),
        ("voltage_limit_low1", -2),
        ("voltage_low1", -1),
        ("voltage_high1", 1),
        ("voltage_offset1", 0.25),
        ("voltage_amplitude1", 1),
        ("voltage_concurrent1", False),
        ("state_output1", True),
        ("trigger_mode", "TRIG"),
        ("ref_osc_source", "INT"),
    ):
        yield f"set {name}", lambda n=name, v=value: afg.parameters[n].set(v)
        yield f"get {name}", lambda n=name: afg.parameters[n].get()
    yield "close", afg.close


def pymeasure(host: str, port: int) -> Operations:
    """Pymeasure's driver of the AFG3152C: nearly the same commands."""
    from pymeasure.adapters import VISAAdapter
    from pymeasure.instruments.tektronix import AFG3152C

    adapter = VISAAdapter(
        f"TCPIP0::{host}::{port}::SOCKET", visa_library="@py", read_termination="\n",
        write_termination="\n", timeout=3000,
    )  # fmt: skip
    afg = AFG3152C(adapter)
    yield "error queue", lambda: afg.ask("SYST:ERR?")
    yield "id", lambda: afg.id
    yield "reset", afg.reset
    for name, value in (
        ("shape", "ramp"),
        ("unit", "VPP"),
        ("frequency", 40.0),
        ("amp_vpp", 1.5),
        ("offset", 0.25),
        ("impedance", 10000),
        ("duty", 30.0),
        ("unit", "VRMS"),
        ("amp_vrms", 0.5),
    ):
        yield f"set {name} {value}", lambda n=name, v=value: setattr(afg.ch1, n, v)
        yield f"get {name} {value}", lambda n=name: getattr(afg.ch1, n)
    yield "waveform", lambda: afg.ch1.waveform("SIN", 1e3, "VPP", 1.0, 0.5)
    yield "enable", afg.ch1.enable
    yield "close", adapter.close


def pymeasure_scope(host: str, port: int) -> Operations:
    """Pymeasure's driver of the DSOX1102G: nearly the same commands."""
    from pymeasure.adapters import VISAAdapter
    from pymeasure.instruments.keysight import KeysightDSOX1102G

    adapter = VISAAdapter(
        f"TCPIP0::{host}::{port}::SOCKET", visa_library="@py", read_termination="\n",
        write_termination="\n",
    )  # fmt: skip
    scope = KeysightDSOX1102G(adapter)
    yield "error queue", lambda: scope.ask("SYST:ERR?")
    yield "id", lambda: scope.id
    for name, value in (
        ("timebase_mode", "main"),
        ("timebase_range", 0.05),
        ("timebase_offset", 0.01),
        ("timebase_scale", 0.002),
        ("acquisition_type", "normal"),
        ("acquisition_mode", "realtime"),
        ("waveform_points_mode", "normal"),
        ("waveform_source", "channel1"),
        ("waveform_format", "word"),
    ):
        yield f"set {name}", lambda n=name, v=value: setattr(scope, n, v)
        yield f"get {name}", lambda n=name: getattr(scope, n)
    for name, value in (
        ("bwlimit", False),
        ("coupling", "dc"),
        ("display", True),
        ("invert", False),
        ("offset", 0.5),
        ("probe_attenuation", 1),
        ("range", 1.6),
        ("scale", 0.2),
        ("label", "FRINGES"),
    ):
        yield f"set ch1.{name}", lambda n=name, v=value: setattr(scope.ch1, n, v)
        yield f"get ch1.{name}", lambda n=name: getattr(scope.ch1, n)
    yield "timebase", lambda: scope.timebase
    yield "ch1.current_configuration", lambda: scope.ch1.current_configuration
    for name in ("run", "stop", "single"):
        yield name, getattr(scope, name)
    yield "digitize", lambda: scope.digitize("channel1")
    yield "download_data", lambda: _summary(scope.download_data("channel1", 1000))
    yield "close", adapter.close


def _summary(downloaded: tuple[Any, Any]) -> dict[str, Any]:
    volts, preamble = downloaded
    return {"points": len(volts), "spread": float(volts.max() - volts.min()), **preamble}


def main(name: str, host: str, port: str) -> int:
    """Try them all."""
    came: dict[str, dict[str, str]] = {}
    with contextlib.redirect_stdout(io.StringIO()):
        operations = globals()[name](host, int(port))
        _, queue = next(operations)
        for operation, act in operations:
            try:
                value, error = act(), ""
            except Exception as failure:
                value, error = None, f"{type(failure).__name__}: {failure}"[:300]
            came[operation] = {"value": repr(value), "error": error, "queue": ""}
            if operation != "close":
                with contextlib.suppress(Exception):
                    came[operation]["queue"] = str(queue()).strip()
    print(json.dumps(came))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
