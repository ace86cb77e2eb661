"""The same drivers over HiSLIP, through real VISA input and output, and peers that misbehave."""

import gc
import logging
import socket
import struct
import time
import warnings

import numpy as np
import pytest

from hardware import AFG31000, DriveLimits, HislipServer, InstrumentError, Scpi, VisaLink
from hardware.servers._hislip_wire import SIZE, Header, Kind, Malformed, message
from hardware.simulated import (
    Closing,
    Cut,
    Endless,
    Faulty,
    Instead,
    Silent,
    SimulatedAFG31052,
    Slow,
    Unplugged,
)

pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")

LIMITS = DriveLimits(0.0, 7.5, 4000.0, 0.5, 100.0)
TIMEOUT_S = 0.3
SLACK_S = 0.4  # a busy computer


@pytest.fixture(autouse=True, scope="module")
def _loaded_once():
    """Importing pyvisa takes longer than any deadline here, and is no part of it."""
    import pyvisa

    pyvisa.ResourceManager("@py")


def connect(server):
    return Scpi(VisaLink(server.resource, backend="@py"), timeout_s=TIMEOUT_S)


def test_a_whole_session():
    instrument = SimulatedAFG31052()
    wave = 1.0 + 0.2 * np.sin(2 * np.pi * np.arange(131072) / 131072)
    with HislipServer(instrument) as server, AFG31000(connect(server)) as afg:
        channel = afg.channel(2, limits=LIMITS)
        loaded = channel.load(wave, 10.0)
        assert (channel.read_back() == loaded.codes).all()
        channel.start()
        assert instrument.output(2) is not None
    assert instrument.output(2) is None
    assert instrument.seen[2].relay_v <= 0.0041


def test_sessions_of_two_clients_are_both_served():
    """A stranger that connects does not end another's session."""
    instrument = SimulatedAFG31052()
    with HislipServer(instrument) as server:
        first = connect(server)
        first.command("SOUR1:FREQ 20")
        second = connect(server)
        assert second.number("SOUR1:FREQ?") == 20.0
        assert "AFG31052" in first.text("*IDN?")
        first.close()
        second.close()


@pytest.mark.fault(
    name="a HiSLIP peer that is silent, slow, closing, endless or lying",
    promise="one error within the deadline",
)
@pytest.mark.parametrize(
    "fault",
    [
        Silent(),
        Closing(0),
        Closing(3),
        Cut(0),
        Cut(4),
        Endless(),
        Endless(b"7", 0.001),
        Endless(b"7\n", 0.001),
        Instead(b"\n"),
        Instead(b"\x00\xff" * 40 + b"\n"),
        Instead(b"8" * 5000 + b"\n"),
        Slow(10.0),
        Slow(0.05, 1),
    ],
    ids=repr,
)
def test_peers_that_misbehave(fault):
    instrument = Faulty(SimulatedAFG31052(), fault, when=b"*IDN?")
    with HislipServer(instrument) as server:
        session = connect(server)
        began = time.monotonic()
        with pytest.raises(InstrumentError):
            session.text("*IDN?", r"TEKTRONIX.*")
        assert time.monotonic() - began < 2 * TIMEOUT_S + SLACK_S
        session.close()


@pytest.mark.fault(name="a late answer over HiSLIP", promise="never taken for the next one")
def test_a_late_answer_is_not_taken_for_the_next():
    """Also where nothing connects again between the two."""
    instrument = Faulty(SimulatedAFG31052(), Slow(0.5), when=b"*IDN?", times=1)
    with HislipServer(instrument) as server:
        link = VisaLink(server.resource, backend="@py")
        link.send(b"*IDN?\n", link.now() + 1.0)
        time.sleep(0.7)
        link.send(b"SOUR1:FREQ?\n", link.now() + 1.0)
        answer = link.receive(100, link.now() + 1.0)
        assert float(answer.data) > 0 and answer.end
        link.close()


def test_a_clear_lets_go_of_what_was_asked():
    instrument = Faulty(SimulatedAFG31052(), Slow(5.0), when=b"*IDN?", times=1)
    with HislipServer(instrument) as server:
        session = connect(server)
        with pytest.raises(InstrumentError, match="no answer"):
            session.text("*IDN?")
        began = time.monotonic()
        assert session.text("*IDN?").startswith("TEKTRONIX")  # on a new connection, cleared
        assert time.monotonic() - began < TIMEOUT_S + SLACK_S
        session.close()


@pytest.mark.fault(name="a HiSLIP peer that is unplugged in an upload", promise="one error in time")
@pytest.mark.parametrize("deaf", [False, True])
@pytest.mark.process
def test_unplugged_in_the_middle_of_an_upload(deaf):
    # Its first 100 000 bytes; then it is gone, until somebody connects anew.
    gone = Unplugged(SimulatedAFG31052(), 100_000, deaf=deaf, comes_back=True)
    wave = 1.0 + 0.2 * np.sin(2 * np.pi * np.arange(131072) / 131072)
    with HislipServer(gone) as server, AFG31000(connect(server)) as afg:
        channel = afg.channel(1, limits=LIMITS)
        began = time.monotonic()
        with pytest.raises(InstrumentError):
            channel.load(wave, 10.0)
        assert time.monotonic() - began < 30.0
        assert channel.loaded is None
        assert not channel.on


def test_nothing_listens(monkeypatch):
    monkeypatch.setattr(logging.getLogger("pyvisa"), "disabled", True)  # a record keeps the socket
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pyvisa-py forgets to close its socket
        with pytest.raises(InstrumentError, match="cannot be opened") as failed:
            VisaLink(f"TCPIP::127.0.0.1::hislip0,{port}::INSTR", backend="@py")
        del failed
        gc.collect()


class Client:
    """A client that may say anything."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=2.0)

    def say(self, data):
        self.socket.sendall(data)

    def hear(self):
        header = Header.of(self._exactly(SIZE))
        return header, self._exactly(header.length)

    def _exactly(self, count):
        got = b""
        while len(got) < count:
            data = self.socket.recv(count - len(got))
            if not data:
                raise ConnectionError
            got += data
        return got


@pytest.fixture
def opened():
    with HislipServer(SimulatedAFG31052()) as server:
        first = Client(server.port)
        first.say(message(Kind.INITIALIZE, 0, 0x01007878, b"hislip0"))
        answer, _ = first.hear()
        second = Client(server.port)
        second.say(message(Kind.ASYNC_INITIALIZE, 0, answer.parameter & 0xFFFF))
        assert second.hear()[0].kind == Kind.ASYNC_INITIALIZE_RESPONSE
        assert answer.parameter >> 16 == 0x0100
        yield first, second
        first.socket.close()
        second.socket.close()


def test_each_message_of_the_protocol(opened):
    first, second = opened
    second.say(message(Kind.ASYNC_MAXIMUM, payload=struct.pack("!Q", 4096)))
    header, payload = second.hear()
    assert (header.kind, payload) == (Kind.ASYNC_MAXIMUM_RESPONSE, struct.pack("!Q", 4096))
    for asked, answered in (
        (Kind.ASYNC_STATUS, Kind.ASYNC_STATUS_RESPONSE),
        (Kind.ASYNC_LOCK, Kind.ASYNC_LOCK_RESPONSE),
        (Kind.ASYNC_LOCK_INFO, Kind.ASYNC_LOCK_INFO_RESPONSE),
        (Kind.ASYNC_REMOTE_LOCAL, Kind.ASYNC_REMOTE_LOCAL_RESPONSE),
        (Kind.ASYNC_CLEAR, Kind.ASYNC_CLEAR_ACKNOWLEDGE),
        (Kind.DATA, Kind.ERROR),
    ):
        second.say(message(asked))
        assert second.hear()[0].kind == answered
    first.say(message(Kind.CLEAR_COMPLETE))
    assert first.hear()[0].kind == Kind.CLEAR_ACKNOWLEDGE
    first.say(message(Kind.ASYNC_LOCK))
    assert first.hear()[0].kind == Kind.ERROR


def test_the_end_of_a_message_needs_no_newline(opened):
    first, _ = opened
    first.say(message(Kind.DATA, 1, 40, b"*ID"))
    first.say(message(Kind.DATA_END, 1, 42, b"N?"))
    header, payload = first.hear()
    assert header.kind == Kind.DATA_END and header.parameter == 42
    assert payload.startswith(b"TEKTRONIX") and payload.endswith(b"\n")


@pytest.mark.fault(
    name="messages that are none, to a HiSLIP server", promise="sent away, others are served"
)
@pytest.mark.parametrize(
    "data",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        message(Kind.ASYNC_INITIALIZE, 0, 9999),
        message(Kind.DATA_END, 0, 1, b"*IDN?\n"),
        struct.pack("!2sBBIQ", b"HS", 0, 0, 0, 1 << 60),
    ],
)
def test_strangers_are_sent_away_and_others_served(data):
    with HislipServer(SimulatedAFG31052()) as server:
        stranger = Client(server.port)
        stranger.say(data.ljust(SIZE, b"x"))
        with pytest.raises((ConnectionError, Malformed)):
            while stranger.hear()[0].kind == Kind.FATAL_ERROR:
                pass
        stranger.socket.close()
        session = connect(server)
        assert session.text("*IDN?").startswith("TEKTRONIX")
        session.close()
