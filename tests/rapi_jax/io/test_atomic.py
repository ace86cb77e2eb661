"""Outputs are whole or not there: exceptions, full disks, kills and two writers at once."""

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rapi_jax.io import OutputError, atomic_path, write_atomic, write_recording

WORKER = str(Path(__file__).with_name("_worker.py"))
FORMS = ["recording", "recording.nc"]  # a folder, a file


def _work(*args: object, within: tuple[str, ...] = ()) -> str:
    command = [*within, sys.executable, WORKER, *map(str, args)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("data", [b"\x00\xff", "\u00e9\r\n", memoryview(b"abc")])
def test_writes_bytes_and_text_as_they_are(tmp_path, data):
    write_atomic(tmp_path / "out", data)
    expected = data.encode() if isinstance(data, str) else bytes(data)
    assert (tmp_path / "out").read_bytes() == expected
    assert os.listdir(tmp_path) == ["out"]


@pytest.mark.fault(
    name="an exception while a file is written", promise="the old file, and nothing else"
)
@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_an_exception_leaves_the_old_file_and_nothing_else(tmp_path, error):
    write_atomic(tmp_path / "out", "old")
    with pytest.raises(error), atomic_path(tmp_path / "out") as path:
        path.write_text("half")
        raise error
    assert (tmp_path / "out").read_text() == "old"
    assert os.listdir(tmp_path) == ["out"]


@pytest.mark.fault(
    name="an error of the system while a file is written", promise="one line with path and cure"
)
def test_an_os_error_becomes_one_line_with_path_and_cure(tmp_path):
    with pytest.raises(OutputError) as caught, atomic_path(tmp_path / "o\x1b[31m") as path:
        path.write_text("half")
        raise OSError(errno.ENOSPC, "No space left on device")
    said = str(caught.value)
    assert "\\x1b[31m" in said and "\x1b" not in said and "\n" not in said
    assert "No space left on device. Free some space" in said
    assert caught.value.errno == errno.ENOSPC
    assert os.listdir(tmp_path) == []


def test_a_missing_folder_and_a_folder_in_the_way_are_named(tmp_path):
    with pytest.raises(OutputError, match="Make the folder first"):
        write_atomic(tmp_path / "no" / "out", "")
    with pytest.raises(OutputError, match="not a regular file"):
        write_atomic(tmp_path, "")


def test_permissions_suffix_and_links_are_kept(tmp_path):
    write_atomic(tmp_path / "out.txt", "old")
    (tmp_path / "out.txt").chmod(0o640)
    (tmp_path / "link").symlink_to("out.txt")
    with atomic_path(tmp_path / "link") as path:
        assert path.suffix == ".txt"
        path.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "out.txt").read_text() == "new"
    assert (tmp_path / "out.txt").stat().st_mode & 0o777 == 0o640


@pytest.mark.fault(name="a write fails over an old recording", promise="the old recording, whole")
@pytest.mark.parametrize("form", FORMS)
def test_a_recording_is_not_half_overwritten_where_a_write_fails(
    tmp_path, recording, monkeypatch, form
):
    write_recording(recording, tmp_path / form)
    before = sorted(tmp_path.rglob("*"))

    def fail(*args):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OutputError, match="Input/output error"):
        write_recording(recording, tmp_path / form)
    with pytest.raises(OutputError, match="Input/output error"):
        write_recording(recording, tmp_path / f"new-{form}")
    assert sorted(tmp_path.rglob("*")) == before


def test_a_file_in_the_place_of_a_folder_is_refused(tmp_path, recording):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(OutputError, match="is not a folder"):
        write_recording(recording, tmp_path / "out")
    assert (tmp_path / "out").read_text() == "mine"


posix = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")


@posix
@pytest.mark.parametrize("form", FORMS)
def test_a_file_size_limit_leaves_the_old_recording(tmp_path, form):
    said = _work("full", f"rlimit:{tmp_path / form}", 1)
    assert "File too large" in said and "whole 1" in said


@posix
@pytest.mark.parametrize("form", FORMS)
def test_a_full_disk_leaves_the_old_recording(tmp_path, form):
    name_space = ("unshare", "--user", "--map-root-user", "--mount", "sh", "-c")
    mount = f"mount -t tmpfs -o size=256k none '{tmp_path}'"
    if shutil.which("unshare") is None or subprocess.run([*name_space, mount]).returncode:
        pytest.skip("no tmpfs may be mounted here; the file size limit stands in for it")
    within = (*name_space, mount + ' && exec "$@"', "sh")
    said = _work("full", tmp_path / form, 1, within=within)
    assert "No space left on device. Free some space" in said and "whole 1" in said


@posix
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.process
def test_sigkill_leaves_the_old_or_the_new_recording(tmp_path, form):
    assert "whole 30" in _work("kill", tmp_path / form, 30)


@posix
@pytest.mark.fault(
    name="SIGKILL at each call of the system in the update of a recording",
    promise="the old or the new one; the next write removes what it left, nothing else",
)
def test_what_a_killed_update_left_is_removed_by_the_next_write(tmp_path):
    assert "every" in _work("step", tmp_path / "recording", 100)


@posix
@pytest.mark.parametrize("form", FORMS)
def test_two_writers_leave_one_whole_recording(tmp_path, form):
    assert "whole 20" in _work("compete", tmp_path / form, 20)
    assert not [path for path in tmp_path.rglob(".tmp-*")]
