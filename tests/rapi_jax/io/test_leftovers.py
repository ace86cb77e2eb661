"""What killed writers left is removed by the next writer, what a living one writes is not."""

import os
import time

import pytest
from scope_files import scanned, tektronix

from rapi_jax.io import (
    ImportOptions,
    atomic_path,
    import_recording,
    write_atomic,
    write_import,
    write_recording,
)
from rapi_jax.io._leftovers import OLD_S, remove_leftovers, temporary_name

posix = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs process numbers")


def _of_process(number, suffix=""):
    own = temporary_name(suffix)
    return own.replace(f"-{os.getpid()}-", f"-{number}-")


@pytest.mark.fault(name="what a killed writer left", promise="removed by the next write")
@posix
@pytest.mark.parametrize("suffix", ["", ".json", ".csv"])
def test_the_next_write_removes_what_a_killed_writer_left(tmp_path, ended, suffix):
    (tmp_path / _of_process(ended, suffix)).write_text("half")
    write_atomic(tmp_path / "out", "new")
    assert os.listdir(tmp_path) == ["out"]


@posix
def test_a_new_recording_removes_the_folder_that_a_killed_writer_left(tmp_path, recording, ended):
    left = tmp_path / _of_process(ended)
    left.mkdir()
    (left / "run00.csv").write_text("half")
    write_recording(recording, tmp_path / "new")
    assert os.listdir(tmp_path) == ["new"]


def test_what_a_living_process_writes_stays(tmp_path):
    with atomic_path(tmp_path / "one") as path:
        path.write_text("half")
        os.utime(path, (0, 0))  # even where it looks old
        write_atomic(tmp_path / "other", "")
        assert path.read_text() == "half"
    assert sorted(os.listdir(tmp_path)) == ["one", "other"]


@posix
def test_what_a_process_of_another_user_writes_stays(tmp_path, monkeypatch):
    def refuse(process, signal):
        raise PermissionError

    path = tmp_path / _of_process(1)
    path.write_text("half")
    monkeypatch.setattr(os, "kill", refuse)
    remove_leftovers(tmp_path)
    assert path.exists()


@pytest.mark.parametrize("name", [".tmp-0123456789abcdef.x", ".tmp-01234567-12-0123456789abcdef"])
def test_what_another_host_left_is_removed_once_it_is_old(tmp_path, name):
    path = tmp_path / name
    path.write_text("half")
    remove_leftovers(tmp_path)
    assert path.exists()
    old = time.time() - OLD_S - 60.0
    os.utime(path, (old, old))
    remove_leftovers(tmp_path)
    assert not path.exists()


@pytest.mark.parametrize("name", [".tmp-mine", ".tmp-0123456789abcdef.a.b", "tmp-0123456789abcdef"])
def test_files_of_others_stay(tmp_path, name):
    path = tmp_path / name
    path.write_text("mine")
    os.utime(path, (0, 0))
    write_atomic(tmp_path / "out", "")
    assert path.read_text() == "mine"


def test_what_a_leftover_points_to_stays(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "file").write_text("mine")
    link = tmp_path / ".tmp-0123456789abcdef"
    link.symlink_to("folder")
    os.utime(link, (0, 0), follow_symlinks=False)
    remove_leftovers(tmp_path)
    assert not link.is_symlink()
    assert (tmp_path / "folder" / "file").read_text() == "mine"


def test_a_folder_that_cannot_be_listed_is_no_error(tmp_path):
    remove_leftovers(tmp_path / "missing")
    assert not (tmp_path / "missing").exists()


@pytest.mark.fault(name="an import killed while it writes its picture", promise="imported again")
@posix
def test_an_import_is_written_again_where_a_killed_one_left_a_temporary_file(tmp_path, ended):
    (tmp_path / "a.csv").write_text(tektronix(*scanned((10.0, 3, 4.5), sample_hz=4e3)))
    columns = ImportOptions(drive="CH1", response="CH2", drive_unit="V", response_unit="GHz")
    made = import_recording(tmp_path / "a.csv", columns)
    write_import(made, tmp_path / "out", picture=b"PNG")
    (tmp_path / "out" / _of_process(ended, ".png")).write_bytes(b"half")
    write_import(made, tmp_path / "out", picture=b"PNG")
    names = sorted(os.listdir(tmp_path / "out"))
    assert len(names) == 3 and names[:2] == ["manifest.toml", "preview.png"]
