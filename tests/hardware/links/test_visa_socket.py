"""The same driver over a real socket and real VISA input and output, and peers that misbehave."""

import socket
import sys
import time

import numpy as np
import pytest

from hardware import AFG31000, DriveLimits, InstrumentError, LinkError, Scpi, VisaLink
from hardware.simulated import (
    Closing,
    Cut,
    Endless,
    Faulty,
    Instead,
    Silent,
    SimulatedAFG31052,
    Slow,
    TcpServer,
    Unplugged,
)

pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")

LIMITS = DriveLimits(0.0, 7.5, 4000.0, 0.5, 100.0)
TIMEOUT_S = 0.3
SLACK_S = 0.3  # a busy computer


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
    with TcpServer(instrument) as server, AFG31000(connect(server)) as afg:
        channel = afg.channel(2, limits=LIMITS)
        loaded = channel.load(wave, 10.0)
        assert (channel.read_back() == loaded.codes).all()
        channel.start()
        assert instrument.output(2) is not None
        assert instrument.output(1) is None
    assert instrument.output(2) is None
    assert instrument.seen[2].relay_v <= 0.0041


def test_nothing_stalls_for_a_delayed_acknowledgement():
    with TcpServer(SimulatedAFG31052()) as server:
        session = connect(server)
        seconds = []
        for points in (2, 500, 1500, 3000, 8000):
            began = time.perf_counter()
            session.command("DATA:DATA EMEM1", np.zeros(points, ">u2").tobytes())
            seconds.append(time.perf_counter() - began)
        session.close()
    assert sorted(seconds)[2] < 0.02


FAULTS = {
    "silent": Silent(),
    "too slow": Slow(0.5),
    "dripping": Slow(0.05, pieces=1),
    "closing": Closing(),
    "closing half-way": Closing(3),
    "half": Cut(5),
    "endless": Endless(),
    "endless and slow": Endless(b"x", 0.02),
    "lying header": Instead(b"#6999999\x00\x00"),
    "short block": Instead(b"#12\x00\x00\n"),
}


@pytest.mark.fault(
    name="a real socket that is silent, slow, dripping, closing, endless or lying",
    promise="one error within the deadline; the next query is answered right",
)
@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_a_real_peer(fault):
    peer = Faulty(SimulatedAFG31052(), FAULTS[fault], when=b"DATA:DATA?", times=1)
    with TcpServer(peer) as server:
        session = connect(server)
        session.identify("TEKTRONIX.*")
        began = time.monotonic()
        with pytest.raises(InstrumentError):
            session.block("DATA:DATA? EMEM1", limit=262_144, size=2000)
        assert time.monotonic() - began <= TIMEOUT_S + SLACK_S
        assert session.number("SOUR1:FREQ?") == 1e6  # connected again, and never the late answer
        assert len(session.block("DATA:DATA? EMEM1", limit=262_144, size=2000)) == 2000
        session.close()


@pytest.mark.fault(
    name="a real peer that is gone in the midst of an upload", promise="one error in time"
)
@pytest.mark.parametrize("deaf", [False, True])
def test_a_peer_that_is_gone_in_the_midst_of_an_upload(deaf):
    peer = Unplugged(SimulatedAFG31052(), 60_000, deaf=deaf)
    with TcpServer(peer) as server:
        session = connect(server)
        began = time.monotonic()
        with pytest.raises(InstrumentError):
            for _ in range(100):  # what fits into the buffers of the system is taken all the same
                session.command("DATA:DATA EMEM1", bytes(262_144))
                began = time.monotonic()
        assert time.monotonic() - began <= TIMEOUT_S + SLACK_S
        session.close()


@pytest.mark.fault(name="a real peer that stops reading", promise="one error in time")
def test_a_peer_that_stops_reading_does_not_hold_a_write():
    listener = socket.create_server(("127.0.0.1", 0))
    link = VisaLink(f"TCPIP::127.0.0.1::{listener.getsockname()[1]}::SOCKET", backend="@py")
    session = Scpi(link, timeout_s=TIMEOUT_S)
    began = time.monotonic()
    with pytest.raises(InstrumentError, match="no answer within"):
        session.command("DATA:DATA EMEM1", bytes(999_999))
    with pytest.raises(LinkError, match="no answer within"):  # more than all buffers hold
        link.send(bytes(64 << 20), link.now() + TIMEOUT_S)
    assert time.monotonic() - began <= 2 * (TIMEOUT_S + SLACK_S)
    session.close()
    listener.close()


@pytest.mark.fault(name="nothing listens at the address", promise="one error in time")
def test_nothing_listens():
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    listener.close()
    with pytest.raises(InstrumentError, match="cannot be opened"):
        VisaLink(f"TCPIP::127.0.0.1::{port}::SOCKET", backend="@py", open_s=TIMEOUT_S)


def test_no_such_resource():
    with pytest.raises(InstrumentError, match="cannot be opened"):
        VisaLink("\x1b[2Jnonsense", backend="@py")


def test_without_pyvisa(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvisa", None)
    with pytest.raises(InstrumentError, match=r"rapi-jax\[lab\]"):
        VisaLink("TCPIP::127.0.0.1::5025::SOCKET")
