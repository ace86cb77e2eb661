"""What a killed update lists and no manifest names is removed, and nothing else."""

import json
import os

import numpy as np
import pytest

from rapi_jax.io import read_fringe_records, write_atomic, write_fringe_records, write_recording
from rapi_jax.io._leftovers import temporary_name
from rapi_jax.io._unfinished import SUFFIX, update_list
from rapi_jax.ranging import FringeRecord, FringeRecords

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs process numbers")
FRESH = "run01-0123abcd.csv"


@pytest.fixture
def folder(tmp_path, recording):
    """A recording of the files run00.csv and run01.csv."""
    write_recording(recording, tmp_path / "r")
    return tmp_path / "r"


def leave(folder, process, content):
    """A list of a process; its path."""
    name = temporary_name(SUFFIX).replace(f"-{os.getpid()}-", f"-{process}-")
    (folder / name).write_text(content if isinstance(content, str) else json.dumps(content))
    return folder / name


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_new_files_that_nobody_names_are_removed_with_the_list(folder, ended):
    before = names(folder)
    (folder / FRESH).write_text("half")
    leave(folder, ended, update_list(folder, fresh=[FRESH], before=["run00.csv", "run01.csv"]))
    write_atomic(folder / "out", "")
    assert names(folder) == before | {"out"}


def test_old_files_that_the_new_manifest_does_not_name_are_removed(folder, ended):
    old = folder / "old.csv"
    old.write_text("old")
    leave(folder, ended, update_list(folder, fresh=[], before=["old.csv"]))
    write_atomic(folder / "out", "")
    assert not old.exists()


def test_an_old_file_that_was_written_anew_since_stays(folder, ended):
    old = folder / "old.csv"
    old.write_text("old")
    path = leave(folder, ended, update_list(folder, fresh=[], before=["old.csv"]))
    old.write_text("mine")
    write_atomic(folder / "out", "")
    assert old.read_text() == "mine" and not path.exists()


def test_what_a_living_writer_lists_stays(folder):
    (folder / FRESH).write_text("half")
    path = leave(folder, os.getpid(), {FRESH: None})
    write_atomic(folder / "out", "")
    assert (folder / FRESH).exists() and path.exists()


def test_without_a_manifest_all_stays_until_there_is_one(folder, ended):
    (folder / FRESH).write_text("half")
    path = leave(folder, ended, {FRESH: None})
    manifest = (folder / "manifest.toml").read_text()
    (folder / "manifest.toml").unlink()
    write_atomic(folder / "out", "")
    assert (folder / FRESH).exists() and path.exists()
    (folder / "manifest.toml").write_text(manifest)
    write_atomic(folder / "out", "")
    assert not (folder / FRESH).exists() and not path.exists()


@pytest.mark.fault(
    name="a list of a killed update that is damaged or hostile",
    promise="removed itself, and nothing of the user's",
)
@pytest.mark.parametrize(
    "content",
    [
        "",
        '{"run0',
        "[" * 5000,
        "[]",
        "7",
        {"../mine.csv": None, "../mine-0123abcd.csv": None},
        {"mine.csv": None, "mine.csv\0": None, "link-0123abcd.csv": None},
        {"mine.csv": [4, 0], "run00.csv": None},
        {"mine.csv": {}, "a" * 300: None, "run00.csv": [1, 2]},
    ],
    ids=range(9),
)
def test_a_damaged_or_hostile_list_removes_nothing_of_the_user(folder, ended, content):
    for path in (folder / "mine.csv", folder / "../mine.csv", folder / "../mine-0123abcd.csv"):
        path.write_text("mine")
    (folder / "link-0123abcd.csv").symlink_to("../mine.csv")
    before = names(folder) | names(folder.parent)
    leave(folder, ended, content)
    write_atomic(folder / "manifest.txt", "")
    assert names(folder) | names(folder.parent) == before | {"manifest.txt"}


def test_a_killed_update_of_fringe_records_is_finished_by_the_next(tmp_path, ended):
    columns = np.arange(300, dtype=np.int16)
    record = FringeRecord(columns, columns, name="r0")
    write_fringe_records(FringeRecords((record,), 30e6, 10.0, 7.34), tmp_path)
    (tmp_path / "r0-0123abcd.npy").write_bytes(b"half")
    leave(tmp_path, ended, {"r0-0123abcd.npy": None, "r0.npy": None})
    write_fringe_records(FringeRecords((record,), 30e6, 10.0, 7.34), tmp_path)
    assert len(names(tmp_path)) == 2
    assert len(read_fringe_records(tmp_path).records) == 1
