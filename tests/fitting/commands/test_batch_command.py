"""`rapi batch` and `rapi fit` of several recordings: folders, exit codes, options; real fits."""

import inspect
import json
import sys
import types
from pathlib import Path

import pytest
from command_output import assert_one_line
from rich.console import Console

from fitting.batch._record import JobRecord
from fitting.batch.jobs._job import Job
from fitting.cli import app
from fitting.commands import diagnose, fit
from fitting.commands import range as ranging
from fitting.commands.batch._progress import BatchProgress
from fitting.commands.compensate import _drives
from fitting.commands.run import run
from fitting.commands.shared._tasks import complete_options, parse_options, run_task
from rapi_jax import DataError
from rapi_jax.examples import paper_recording
from rapi_jax.io import write_recording

QUICK = ("--each", "none", "--starts", "2", "--no-plots")


@pytest.fixture
def rapi(capfd):
    """`rapi` in this process: exit code, standard output, standard error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        capfd.readouterr()
        code = run(app, [*map(str, arguments)])
        said = capfd.readouterr()
        return code, said.out, said.err

    return call


def test_where_there_is_no_bar_a_batch_says_what_it_does_now_and_then(capfd, monkeypatch):
    clock = iter([0.0, 0.0, 5.0, 12.0, 12.0, 30.0, 31.0])
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    done = JobRecord.__new__(JobRecord)
    object.__setattr__(done, "exit_code", 0)
    bar = types.SimpleNamespace(
        disable=True, console=Console(stderr=True, highlight=False), add_task=lambda *a, **k: 0,
        update=lambda *a, **k: None, start_task=lambda *a: None,
    )  # fmt: skip
    progress = BatchProgress(bar)
    progress.more(4)
    progress.ended(done, True)
    progress.ended(done, False)  # after 5 s
    progress.ended(done, False)  # after 12 s
    progress.kept()
    said = capfd.readouterr().err.splitlines()
    assert said == ["4 jobs to do", "2 of 4 done", "1 result of an earlier run was kept"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two recordings and a damaged one."""
    root = tmp_path_factory.mktemp("recordings")
    for seed, name in enumerate(("monday", "tuesday")):
        write_recording(paper_recording(samples=200, seed=seed)[0], root / name)
    (root / "spoiled").mkdir()
    (root / "spoiled/manifest.toml").write_text((root / "monday/manifest.toml").read_text())
    return root


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix != ".json"}


@pytest.mark.slow
def test_a_batch_writes_what_the_single_command_writes_and_goes_on(rapi, folder, tmp_path):
    output = tmp_path / "out"
    code, out, err = rapi("batch", folder, "-o", output, "--json", *QUICK)
    content = json.loads(out)
    assert code == 5 and content["schema"] == "rapi.batch/1"
    assert [row["name"] for row in content["jobs"]] == ["monday", "spoiled", "tuesday"]
    assert [row["exit_code"] for row in content["jobs"]] == [0, 3, 0]
    assert_one_line(err, "failed", "spoiled", "no such file")
    assert content["jobs"][0]["provenance"] == {}

    assert rapi("fit", folder / "monday", "-o", tmp_path / "one", *QUICK)[0] == 0
    assert bytes_of(tmp_path / "one") == bytes_of(output / "monday")
    several = rapi("fit", folder / "monday", folder / "tuesday", "-o", tmp_path / "two", *QUICK)
    assert several[0] == 0 and "monday" in several[1] and "tuesday" in several[1]
    assert bytes_of(tmp_path / "two/tuesday") == bytes_of(output / "tuesday")

    before = [JobRecord.read(output / name) for name in ("monday", "spoiled", "tuesday")]
    code, out, _ = rapi("batch", folder, "-o", output, "--json", *QUICK)
    assert code == 5 and json.loads(out)["jobs"] == [record.to_dict() for record in before]
    write_recording(paper_recording(samples=200, seed=2)[0], folder / "spoiled")
    code, out, err = rapi("batch", folder, "-o", output, *QUICK)
    assert code == 0 and "3 done" in out
    assert err.startswith("1 job to do\n") and "2 results of an earlier run were kept" in err
    assert JobRecord.read(output / "monday") == before[0]

    code, out, _ = rapi(
        "batch", output, "-o", tmp_path / "drives", "--do", "compensate", "--json", "--no-plots",
        "--span", 60, "--frequency", 10, 20,
    )  # fmt: skip
    assert code == 0 and len(json.loads(out)["jobs"]) == 3
    assert (tmp_path / "drives/monday/drive_20Hz.csv").is_file()


def test_options_are_those_of_the_single_command(tmp_path):
    given = parse_options("fit", ["--plays", "12", "--plugin", "mine.py"], tmp_path)
    assert given == {"plays": 12, "plugin": (tmp_path / "mine.py",)}
    whole = complete_options("fit", given)
    assert whole["plays"] == 12 and whole["order"] == 3 and "output" not in whole
    assert parse_options("range", ["--expected", "0.5", "1"], tmp_path) == {"expected": (0.5, 1.0)}
    assert parse_options("diagnose", ["--model", "m"], tmp_path) == {"model": tmp_path / "m"}


@pytest.mark.parametrize("task", ["fit", "compensate", "diagnose", "range"])
def test_the_work_of_a_task_takes_all_options_of_its_command(folder, tmp_path, monkeypatch, task):
    """What a batch hands on is what the function behind the single command takes."""
    of_task = {
        "fit": (fit, "identify_into"), "compensate": (_drives, "compensate_into"),
        "diagnose": (diagnose, "diagnose_into"), "range": (ranging, "range_into"),
    }  # fmt: skip
    module, name = of_task[task]
    takes, called = inspect.signature(getattr(module, name)), []

    def stand_in(*given, **named):
        takes.bind(*given, **named)
        called.append(named)
        raise DataError("the work itself is not done here")

    monkeypatch.setattr(module, name, stand_in)
    needed = {"compensate": {"span": 60.0, "frequency": [10.0]}}.get(task, {})
    monkeypatch.setattr("rapi_jax.io.read_fringe_records", lambda path: path)
    path = folder / "monday"
    done = run_task(Job("a", "a", path, task, complete_options(task, needed)), tmp_path / "out")
    assert done.message == "bad data: the work itself is not done here" and len(called) == 1


@pytest.mark.fault(name="wrong options of `rapi batch`", promise="exit 2, one line")
@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--plays", "0"], "plays"),
        (["--no-such"], "--no-such"),
        (["--check", "x"], "check"),
        (["--workers", "1", "--scheduler", "tcp://x:1"], "--scheduler"),
        (["--plays", "4", "another"], "come first"),
        (["--do", "compensate"], "span"),
        (["--do", "predict"], "predict"),
    ],
)
def test_wrong_options_are_told_in_one_line(rapi, folder, tmp_path, arguments, word):
    code, out, err = rapi("batch", folder, "-o", tmp_path / "out", *arguments)
    assert code == 2 and not out
    assert_one_line(err, "usage", word)
    assert not (tmp_path / "out").exists()


def test_parquet_without_pyarrow_is_told_before_the_first_job(rapi, folder, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    code, _, err = rapi("batch", folder, "-o", tmp_path / "out", "--parquet")
    assert code == 3
    assert_one_line(err, "bad data", "--extra parquet")
    assert not (tmp_path / "out").exists()


def test_a_watched_folder_has_table_and_page_when_interrupted(rapi, folder, tmp_path, monkeypatch):
    """Nothing else ends the batch; nothing that is done is asked for here."""
    output = tmp_path / "out"
    (tmp_path / "in").mkdir()

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("fitting.batch.jobs._watch.arrived", stop)
    assert rapi("batch", tmp_path / "in", "-o", output, "--watch", "--parquet")[0] == 130
    assert {path.name for path in output.iterdir() if path.is_file()} == {
        "results.csv", "results.nc", "results.parquet", "report.html",
    }  # fmt: skip


def test_results_are_not_written_into_recordings(rapi, folder):
    code, _, err = rapi("batch", folder, "-o", folder)
    assert code == 3
    assert_one_line(err, "would be written into it")


def test_no_recording_is_bad_data(rapi, tmp_path):
    code, _, err = rapi("batch", tmp_path, "-o", tmp_path / "out")
    assert code == 3
    assert_one_line(err, "no recording in this folder")
