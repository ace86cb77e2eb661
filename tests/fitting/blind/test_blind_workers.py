"""Diagnoses in processes of their own: what they are told, where they fail, how they stop."""

import json
import os
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fitting.blind.prediction._workers import (
    Job,
    hide_folder,
    predict_in_workers,
)
from rapi_jax import DataError, Recording, triangle
from rapi_jax.io import write_recording

ROOT = Path(__file__).resolve().parents[3]


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


@pytest.fixture
def place(tmp_path):
    """Answers, and a recording whose readings rest: a diagnosis refuses it at once."""
    (tmp_path / "answers").mkdir(mode=0o700)
    (tmp_path / "answers" / "manifest.toml").write_text("schema = 'rapi.recording/1'\n")
    drives = triangle([10.0, 20.0, 40.0], amplitude=4.0, bias=3.0, samples=1200, periods=4)
    resting = Recording.of(drives, [np.zeros(d.size) for d in drives])
    (tmp_path / "recordings").mkdir()
    for k in range(3):
        write_recording(resting, tmp_path / "recordings" / f"world-{k}")
    return tmp_path


def jobs(place, *names):
    output = str(place / "predictions")
    return [Job(str(place / "recordings" / name), None, output, "tree", False) for name in names]


@pytest.mark.process
def test_what_a_diagnosis_refuses_is_a_prediction_and_what_hides_is_restored(place):
    """Two processes, three recordings; none of them needed anything that was refused."""
    names = ["world-0", "world-1", "world-2"]
    before = {
        name: os.environ.get(name) for name in ("NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    }
    seen = []
    for name in predict_in_workers(
        jobs(place, *names), place / "answers", 2, compiled=place / "compiled"
    ):
        seen.append(name)
        assert mode(place / "answers") == 0o000
    assert sorted(seen) == names and mode(place / "answers") == 0o700
    for name in names:
        said = json.loads((place / "predictions" / f"{name}.json").read_text())
        assert said["error"].startswith("DataError: ") and said["refused"] == []
        assert (said["name"], said["withheld"], said["tree_sha256"]) == (name, None, "tree")
    assert {name: os.environ.get(name) for name in before} == before


@pytest.mark.process
def test_a_recording_among_the_answers_is_out_of_reach(place):
    """The blindfold is on before a recording is read; the work stops with one line."""
    job = Job(str(place / "answers"), None, str(place / "predictions"), "tree", False)
    with pytest.raises(DataError, match="blindfold|refused"):
        list(predict_in_workers([job], place / "answers", 1, compiled=place / "compiled"))
    assert mode(place / "answers") == 0o700
    assert not (place / "predictions").exists()


@pytest.mark.process
def test_the_folder_opens_again_after_an_error(place):
    with pytest.raises(KeyError), hide_folder(place / "answers"):
        assert mode(place / "answers") == 0o000
        raise KeyError
    assert mode(place / "answers") == 0o700


@pytest.mark.process
@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_stops_command_and_processes(nulls):
    """A real command and a real interrupt while its process diagnoses."""
    command = subprocess.Popen(
        [sys.executable, "-m", "fitting.cli", "blind", "predict", str(nulls.root), "--workers=1"],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip
    until = time.monotonic() + 60
    while mode(nulls.answers) != 0 and command.poll() is None and time.monotonic() < until:
        time.sleep(0.05)
    assert mode(nulls.answers) == 0, "the diagnosis did not begin"
    time.sleep(3.0)  # into the loading or the work of the process
    os.killpg(command.pid, signal.SIGINT)  # as a terminal does: to all of them
    out, err = command.communicate(timeout=60)  # until the last that shares the pipes has ended
    assert (command.returncode, out) == (130, ""), err
    assert err.count("\n") == 1 and "interrupted" in err and "Traceback" not in err
    assert mode(nulls.answers) == 0o700
    there = [path.name for path in nulls.predictions.rglob("*")]
    assert not [name for name in there if name.startswith(".tmp-") or name.endswith(".json")]
