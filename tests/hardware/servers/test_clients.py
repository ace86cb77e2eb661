"""Several clients of one server: none delays, ends or garbles another, whatever it sends."""

import socket
import time

import pytest
from noisy_clients import slowest_beside_noise

from hardware import (
    HislipServer,
    InstrumentError,
    LaserLimits,
    Scpi,
    TcpServer,
    VisaLink,
    read_bridge_token,
)
from hardware.laser._bridge import Bridge
from hardware.laser._link import VisaLaserLink
from hardware.servers._hislip_wire import SIZE, Header, Kind, message
from hardware.servers._thresholds import THRESHOLDS
from hardware.simulated import SimulatedAFG31052, SimulatedLink, SimulatedTLB6700
from rapi_jax import DataError

LIMITS = LaserLimits((765.0, 781.0), (0.0, 100.0), (30.0, 140.0), (15.0, 30.0), (20.0, 40.0))
SECRET = "0123456789abcdef"
FREQUENCY = b"SOUR1:FREQ?\n"


@pytest.fixture(autouse=True, scope="module")
def _loaded_once():
    """Importing pyvisa takes longer than any deadline here, and is no part of it."""
    pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")
    import pyvisa

    pyvisa.ResourceManager("@py")


def connect(server):
    return Scpi(VisaLink(server.resource, backend="@py"), timeout_s=2.0)


def dial(server):
    return socket.create_connection((server.host, server.port), timeout=5.0)


@pytest.mark.fault(name="a client that is silent or does not read", promise="delays nobody")
@pytest.mark.parametrize("server", [TcpServer, HislipServer])
def test_a_client_that_is_silent_or_does_not_read_delays_nobody(server):
    instrument = SimulatedAFG31052()
    with server(instrument) as behind:
        strangers = [dial(behind) for _ in range(3)]
        strangers[1].sendall(b"SOUR1:FR")  # half a message, which must not reach another's
        strangers[2].sendall(message(Kind.INITIALIZE, 0, 0x01000000, b"hislip0"))
        began = time.monotonic()
        session = connect(behind)
        session.command("SOUR1:FREQ 20")
        assert session.number("SOUR1:FREQ?") == 20.0
        assert time.monotonic() - began < 2.0
        session.close()
        for one in strangers:
            one.close()


@pytest.mark.fault(name="half a message of one client", promise="does not mix with another's")
def test_half_a_message_of_one_client_does_not_mix_with_another():
    with TcpServer(SimulatedAFG31052()) as server:
        first, second = dial(server), dial(server)
        first.sendall(b"SOUR1:FREQ 33;SOUR1:FR")
        time.sleep(0.1)
        second.sendall(FREQUENCY)
        assert float(second.recv(100)) != 33.0  # the first has not ended its message
        first.sendall(b"EQ?\n")
        assert float(first.recv(100)) == 33.0
        first.close()
        second.close()


@pytest.mark.fault(
    name="eight clients that send noise", promise="the real one served in time, memory bounded"
)
@pytest.mark.parametrize("server", [TcpServer, HislipServer])
def test_a_real_client_is_served_beside_eight_that_send_noise(server):
    """`tests/benchmarks/server_noise.py` sends a million messages to each server."""
    with server(SimulatedAFG31052()) as behind:
        session = connect(behind)
        slowest = slowest_beside_noise(
            lambda: session.text("*IDN?", r"TEKTRONIX,AFG31052.*"),
            (behind.host, behind.port),
            clients=8,
            messages=200,
            sessions=server is HislipServer,
        )
        assert slowest < 2.0
        session.close()


@pytest.mark.fault(name="more clients than a server takes", promise="closed at once")
def test_beyond_the_most_clients_a_connection_is_closed_at_once():
    with TcpServer(SimulatedAFG31052()) as server:
        first = dial(server)
        crowd = [dial(server) for _ in range(THRESHOLDS.most_clients)]
        crowd[-1].settimeout(2.0)
        assert crowd[-1].recv(10) == b""
        first.sendall(b"*IDN?\n")
        assert b"AFG31052" in first.recv(200)
        for one in (first, *crowd):
            one.close()


@pytest.mark.fault(name="two sessions for one lock", promise="the other waits")
def test_a_lock_is_held_by_one_session_until_it_ends():
    def asks(connection, control):
        connection.sendall(message(Kind.ASYNC_LOCK, control, 50))
        return Header.of(connection.recv(SIZE)).control

    def begin(server):
        first, second = dial(server), dial(server)
        first.sendall(message(Kind.INITIALIZE, 0, 0x01000000, b"hislip0"))
        number = Header.of(first.recv(SIZE)).parameter & 0xFFFF
        second.sendall(message(Kind.ASYNC_INITIALIZE, 0, number))
        second.recv(SIZE)
        return first, second

    with HislipServer(SimulatedAFG31052()) as server:
        (one, ones), (other, others) = begin(server), begin(server)
        assert asks(ones, 1) == 1 and asks(others, 1) == 0 and asks(others, 0) == 3
        other.sendall(message(Kind.DATA_END, 0, 7, b"*IDN?"))
        other.settimeout(0.2)
        with pytest.raises(TimeoutError):
            other.recv(SIZE)
        one.close()
        ones.close()
        other.settimeout(5.0)
        assert Header.of(other.recv(SIZE)).kind == Kind.DATA_END
        other.close()
        others.close()


def bridge(**settings):
    there = SimulatedTLB6700()
    return there, Bridge(VisaLaserLink(SimulatedLink(there)), limits=LIMITS, **settings)


@pytest.mark.fault(
    name="values beyond the laser's limits and commands not listed, at a bridge",
    promise="refused, nothing passed on",
)
@pytest.mark.parametrize(
    ("command", "answer"),
    [
        ("SOURce:WAVElength 770", "OK"),
        ("sour:wave 765", "OK"),
        ("SOURce:WAVElength 790", "BRIDGE: 790 is not within the limit `wavelength_nm`"),
        ("SOURce:WAVE:START 700", "BRIDGE: 700 is not within"),
        ("SOURce:VOLTage:PIEZo 101", "BRIDGE: 101 is not within the limit `piezo_percent`"),
        ("SOURce:CURRent:DIODe 1e3", "BRIDGE: 1000 is not within the limit `current_ma`"),
        ("SOURce:CURRent:DIODe nan", "BRIDGE: the value is no number"),
        ("SOURce:CURRent:DIODe MAX", "BRIDGE: the value is no number"),
        ("SOURce:CURRent:DIODe 9_9", "BRIDGE: the value is no number"),
        ("SOURce:CURRent:DIODe? 5", "BRIDGE: a query has no value"),
        ("SYSTem:SAVE 1", "BRIDGE: the command is not on the list"),
        ("*RST", "BRIDGE: the command is not on the list"),
        ("SENSe:WAVElength", "770.00"),
    ],
)
def test_a_bridge_keeps_the_limits_and_its_list_of_commands(command, answer):
    there, served = bridge()
    before = dict(there.set)
    link = VisaLaserLink(SimulatedLink(served))
    assert link.query(command).startswith(answer[:58])
    assert answer == "OK" or there.set == before


@pytest.mark.fault(name="no token or a wrong one, at a bridge", promise="refused")
def test_a_bridge_asks_for_its_token():
    there, served = bridge(token=SECRET)
    stranger = VisaLaserLink(SimulatedLink(served))
    assert stranger.query("SOURce:VOLTage:PIEZo 77").startswith("BRIDGE: send TOKEN")
    with pytest.raises(InstrumentError, match="did not take the token"):
        VisaLaserLink(SimulatedLink(served), token="wrong" * 4).query("SOURce:VOLTage:PIEZo 77")
    assert there.set["piezo"] != 77.0
    known = VisaLaserLink(SimulatedLink(served), token=SECRET)
    assert known.query("SOURce:VOLTage:PIEZo 77") == "OK" and there.set["piezo"] == 77.0


@pytest.mark.parametrize("text", ["", "short", "two\nlines of text here", "x" * 201, "\u00fc" * 20])
def test_a_token_is_one_line_of_some_length(tmp_path, text):
    (tmp_path / "token").write_text(text)
    with pytest.raises(DataError, match="16 to 200"):
        read_bridge_token(tmp_path / "token")
    (tmp_path / "token").write_text(f"{SECRET}\n")
    assert read_bridge_token(tmp_path / "token") == SECRET


@pytest.mark.fault(name="a second client at a bridge", promise="refused while one runs")
def test_a_bridge_serves_one_client_at_a_time_and_the_next_after_it():
    _, served = bridge(token=SECRET)
    with HislipServer(served, alone=True) as server:
        first = VisaLaserLink(VisaLink(server.resource, backend="@py"), token=SECRET)
        assert first.query("SOURce:WAVElength?") == "770.00"
        with dial(server) as other:
            other.sendall(message(Kind.INITIALIZE, 0, 0x01000000, b"hislip0"))
            assert Header.of(other.recv(SIZE)).kind == Kind.FATAL_ERROR
        assert first.query("SOURce:WAVElength?") == "770.00"
        first.close()
        second = VisaLaserLink(VisaLink(server.resource, backend="@py"), token=SECRET)
        assert second.query("SOURce:WAVElength?") == "770.00"
        second.close()
