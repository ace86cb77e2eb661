"""The NI-SCOPE driver against a stand-in whose calls are those of the package `niscope`."""

import inspect
import types

import numpy as np
import pytest

from hardware import Acquisition, Input, InstrumentError, NiScope
from rapi_jax import DataError

niscope = pytest.importorskip("niscope", reason="niscope is not installed (extra `lab`)")

ASKED = Acquisition(
    {"interferometer": Input(0, -0.2, 1.2), "cavity": Input(1, 0.0, 2.0)}, 1e-5, 1e-4, 1e7
)
GAIN = 2.0**-15


class Channel:
    """One channel of a session."""

    def __init__(self, session, name):
        self.session, self.name = session, name

    def configure_vertical(self, range, coupling, offset=0.0, probe_attenuation=1.0, enabled=True):
        assert coupling is niscope.VerticalCoupling.DC and enabled
        self.session.vertical[self.name] = (range, offset)

    @property
    def vertical_range(self):
        return self.session.vertical[self.name][0]

    @property
    def vertical_offset(self):
        return self.session.vertical[self.name][1]

    def fetch_into(
        self, waveform, relative_to=None, offset=0, record_number=0, num_records=None, timeout=5.0
    ):
        session = self.session
        if not session.running:
            raise niscope.errors.DriverError(-1074118637, "Maximum time exceeded before completion")
        assert waveform.dtype == np.int16 and waveform.size == session.horz_record_length
        size, middle = session.vertical[self.name]
        hz = session.horz_sample_rate
        first = -round(session.position / 100 * waveform.size) / hz
        time = first + np.arange(waveform.size) / hz
        gain = size * GAIN
        waveform[:] = np.round((session.light(self.name, time) - middle) / gain)
        return [
            types.SimpleNamespace(
                gain=gain, offset=middle, relative_initial_x=first, x_increment=1 / hz
            )
        ]


class Session:
    """What the driver uses of `niscope.Session`."""

    made: list["Session"] = []

    def __init__(self, resource_name, id_query=False, reset_device=False, options=None):
        if resource_name != "PXI1Slot2":
            raise niscope.errors.DriverError(-1074118654, "Invalid resource name")
        self.calls, self.vertical, self.running, self.closed = [], {}, False, False
        self.channels = {name: Channel(self, name) for name in ("0", "1")}
        self.instrument_manufacturer = "National Instruments"
        self.instrument_model, self.serial_number = "NI PXIe-5105", "01A2B3C4"
        Session.made.append(self)

    @staticmethod
    def light(name, time):
        return 0.5 + 0.4 * np.cos(2 * np.pi * 1e5 * time + int(name))

    def configure_horizontal_timing(
        self, min_sample_rate, min_num_pts, ref_position, num_records, enforce_realtime
    ):
        assert num_records == 1 and enforce_realtime
        # Rates are the clock's, divided by a whole number: the next above what is asked for.
        self.horz_sample_rate = 60e6 / int(60e6 / min_sample_rate)
        self.horz_record_length = round(min_num_pts * self.horz_sample_rate / min_sample_rate)
        self.position = ref_position

    def configure_trigger_digital(self, trigger_source, slope=None, holdoff=None, delay=None):
        self.calls.append(("digital", trigger_source))

    def configure_trigger_edge(
        self, trigger_source, level, trigger_coupling, slope=None, holdoff=None, delay=None
    ):
        self.calls.append(("edge", trigger_source, level))

    def commit(self):
        self.calls.append("commit")

    def initiate(self):
        self.running = True

    def abort(self):
        self.running = False

    def close(self):
        self.closed = True


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    """The stand-in, where the vendor's runtime would be."""
    Session.made = []
    monkeypatch.setattr(niscope, "Session", Session)


@pytest.mark.parametrize("cls", [Session, Channel])
def test_the_stand_in_takes_what_the_package_takes(cls, monkeypatch):
    monkeypatch.undo()
    for name, method in inspect.getmembers(cls, inspect.isfunction):
        if name in ("light",) or (name == "__init__" and cls is Channel):
            continue
        theirs = inspect.signature(getattr(niscope.Session, name)).parameters
        ours = inspect.signature(method).parameters
        assert [p for p in theirs if p != "grpc_options"] == list(ours), name
    for name in (
        "horz_record_length", "horz_sample_rate", "vertical_range", "vertical_offset",
        "instrument_manufacturer", "instrument_model", "serial_number",
    ):  # fmt: skip
        assert name in dir(niscope.Session)


def test_a_record_is_what_was_there(tmp_path):
    with NiScope("PXI1Slot2") as scope:
        assert scope.identity == "National Instruments,NI PXIe-5105,01A2B3C4"
        scope.configure(ASKED)
        scope.arm()
        samples = scope.fetch(1.0).check(ASKED)
        told = scope.snapshot()
    (session,) = Session.made
    time = samples.start_s + np.arange(samples.codes["cavity"].size) / samples.sample_hz
    for name, connector in (("interferometer", "0"), ("cavity", "1")):
        step = samples.volts_per_code[name]
        assert np.abs(samples.volts(name) - Session.light(connector, time)).max() <= 0.51 * step
    assert time[0] <= -ASKED.before_s and time[-1] >= ASKED.after_s
    assert samples.sample_hz >= ASKED.sample_hz
    assert session.calls == [("digital", "VAL_PFI_1"), "commit"]
    assert told["trigger_source"] == "VAL_PFI_1" and float(told["1_vertical_range"]) == 2.0
    assert session.closed and not session.running


def test_an_analogue_trigger_has_a_level():
    with NiScope("PXI1Slot2", trigger="VAL_EXTERNAL", level_v=1.5) as scope:
        scope.configure(ASKED)
    assert ("edge", "VAL_EXTERNAL", 1.5) in Session.made[0].calls


@pytest.mark.fault(name="the vendor's package refuses", promise="one error that says so")
def test_what_the_vendor_refuses_is_said():
    with pytest.raises(InstrumentError, match="NI MAX"):
        NiScope("PXI9Slot9")
    with NiScope("PXI1Slot2") as scope:
        with pytest.raises(ValueError, match="configure"):
            scope.arm()
        scope.configure(ASKED)
        with pytest.raises(InstrumentError, match="trigger output"):
            scope.fetch(0.1)


def test_without_the_package_the_extra_is_named(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "niscope", None)
    with pytest.raises(InstrumentError, match=r"rapi-jax\[lab\]"):
        NiScope("PXI1Slot2")


@pytest.mark.fault(name="a record shorter than asked for", promise="refused")
def test_a_short_record_is_refused(monkeypatch):
    real = Session.configure_horizontal_timing

    def short(self, *arguments, **named):
        real(self, *arguments, **named)
        self.horz_record_length //= 2

    monkeypatch.setattr(Session, "configure_horizontal_timing", short)
    with NiScope("PXI1Slot2") as scope:
        scope.configure(ASKED)
        scope.arm()
        with pytest.raises(DataError, match="memory is too short"):
            scope.fetch(1.0).check(ASKED)
