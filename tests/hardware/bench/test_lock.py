"""An instrument is locked against other programs, and released however a program ends."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("filelock", reason="filelock is not installed (extra `lab`)")

from hardware import InstrumentError  # noqa: E402
from hardware.bench._lock import lock_instruments, missing_packages, normalised_address  # noqa: E402

HOLD = """
import sys
from hardware.bench._lock import lock_instruments
with lock_instruments(["TCPIP::10.0.0.1::INSTR", "USB::1"]):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Locks of this test alone."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


@pytest.fixture
def other():
    """Another process that holds two instruments."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"JAX_PLATFORMS": "cpu"},
    )
    with process:
        assert process.stdout.readline() == b"held\n"
        yield process
        process.kill()


@pytest.mark.fault(name="another program has the instrument", promise="refused")
def test_two_programs_do_not_share_an_instrument(other):
    with (
        pytest.raises(InstrumentError, match="Another program") as caught,
        lock_instruments(["USB::1"]),
    ):
        pass
    assert caught.value.resource == "USB::1"
    with lock_instruments(["USB::2"]):
        pass


@pytest.mark.fault(name="a program that has the instrument is killed", promise="let go of")
def test_a_program_that_is_killed_releases_it(other):
    other.kill()
    other.wait()
    with lock_instruments(["USB::1", "TCPIP::10.0.0.1::INSTR"]):
        with pytest.raises(InstrumentError), lock_instruments(["USB::1"]):  # it is ours now
            pass


def test_it_is_released_at_the_end_of_the_block():
    for _ in range(2):
        with (
            lock_instruments(["USB::1"]),
            pytest.raises(InstrumentError),
            lock_instruments(["USB::1"]),
        ):
            pass


def test_a_folder_that_cannot_be_made_is_named(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with (
        pytest.raises(InstrumentError, match="a folder that you may write to"),
        lock_instruments(["USB::1"]),
    ):
        pass


@pytest.mark.parametrize("package", ["filelock", "platformdirs"])
def test_without_the_extra_it_is_named(monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    message = r"^GPIB::1: A package that .*rapi-jax\[lab\]"
    with pytest.raises(InstrumentError, match=message), lock_instruments(["GPIB::1"]):
        raise AssertionError("it must not be opened")


def test_packages_that_are_missing_are_listed(monkeypatch):
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda name: None if name == "platformdirs" else name
    )
    assert missing_packages() == ["platformdirs"]


@pytest.mark.parametrize(
    "spellings",
    [
        ("TCPIP::10.0.0.1", "TCPIP0::10.0.0.1::INSTR", "tcpip0::10.0.0.1::inst0::instr"),
        ("TCPIP::lab-afg::5025::SOCKET", "TCPIP0::LAB-AFG::5025::socket"),
        ("TCPIP::10.0.0.1::hislip0::INSTR", "TCPIP0::10.0.0.1::hislip0,4880::INSTR"),
        ("TCPIP::localhost::hislip0,99::INSTR", "TCPIP0::127.0.0.1::hislip0,99"),
        ("USB::0x0699::0x0358::C012345::INSTR", "USB0::1689::856::C012345::0::INSTR"),
        ("GPIB::5", "GPIB0::5::INSTR"),
        ("ASRL1", "ASRL1::INSTR"),
        ("SN1012", "sn1012"),
    ],
)
def test_spellings_of_one_address(spellings):
    assert len({normalised_address(one) for one in spellings}) == 1


def test_other_addresses_are_others():
    several = (
        "TCPIP::10.0.0.1::INSTR", "TCPIP::10.0.0.2::INSTR", "TCPIP1::10.0.0.1::INSTR",
        "TCPIP::10.0.0.1::inst1::INSTR", "TCPIP::10.0.0.1::5025::SOCKET",
        "TCPIP::10.0.0.1::5026::SOCKET", "TCPIP::10.0.0.1::hislip0,99::INSTR",
        "TCPIP::10.0.0.1::hislip0::INSTR", "USB::1", "USB::2", "GPIB::5", "GPIB::6", "ASRL1",
        "ASRL2", "", "::", "TCPIP", "SN1012",
    )  # fmt: skip
    assert len({normalised_address(one) for one in several}) == len(several)


def test_another_spelling_is_locked_too(other):
    for spelling in ("TCPIP0::10.0.0.1::INSTR", "tcpip::10.0.0.1"):
        with pytest.raises(InstrumentError, match="Another program") as caught:
            with lock_instruments([spelling]):
                pass
        assert caught.value.resource == spelling


def test_two_spellings_in_one_program_are_one_lock():
    spellings = ["TCPIP::10.0.0.9::INSTR", "TCPIP0::10.0.0.9"]
    assert len({normalised_address(one) for one in spellings}) == 1
    held = False
    with lock_instruments(spellings):  # as two locks the second would wait for the first
        held = True
    assert held
