"""An instrument is locked against other programs, and released however a program ends."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("filelock", reason="filelock is not installed (extra `lab`)")

from hardware import InstrumentError  # noqa: E402
from hardware.bench._lock import lock_instruments  # noqa: E402

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


def test_two_programs_do_not_share_an_instrument(other):
    with (
        pytest.raises(InstrumentError, match="Another program") as caught,
        lock_instruments(["USB::1"]),
    ):
        pass
    assert caught.value.resource == "USB::1"
    with lock_instruments(["USB::2"]):
        pass


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
    with pytest.raises(InstrumentError, match=r"rapi-jax\[lab\]"), lock_instruments(["GPIB::1"]):
        raise AssertionError("it must not be opened")
