"""A batch: what is done is done once, what fails is listed, what ended its process is tried again.

The jobs compute next to nothing; see `tests/support/batch_jobs.py`.
"""

import dataclasses
import json
import subprocess
import sys
import time
from pathlib import Path

import pytest
from batch_jobs import copy, jobs_in
from filelock import FileLock

from fitting.batch._record import JobRecord
from fitting.batch._run import run_batch
from fitting.batch._thresholds import BatchThresholds
from fitting.batch.executors._cluster import local_cluster
from fitting.batch.jobs._job import BatchError
from rapi_jax.io import OutputError

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def output(tmp_path):
    (tmp_path / "out").mkdir()
    return tmp_path / "out"


def recorded(folder: Path, **texts: str) -> None:
    for name, text in texts.items():
        (folder / name).write_text(text)


def tries(folder: Path, name: str) -> int:
    """How often a job was begun."""
    log = folder / f"{name}.log"
    return log.read_text().count("\n") if log.exists() else 0


def run(folder: Path, output: Path, names: str, **options) -> list[JobRecord]:
    return run_batch([jobs_in(folder, names)], output, copy, **options)


def test_each_job_is_recorded_last_with_its_files(tmp_path, output):
    recorded(tmp_path, a="one", b="bad", c="untrusted")
    records = run(tmp_path, output, "abc")
    assert [(r.name, r.status, r.exit_code) for r in records] == [
        ("a", "done", 0), ("b", "failed", 3), ("c", "done", 4),
    ]  # fmt: skip
    assert [JobRecord.read(output / name) for name in "abc"] == records
    content = json.loads((output / "a/job.json").read_text())
    assert content["schema"] == "rapi.job/1" and content["provenance"] == {"text": "one"}
    assert list(content["files"]) == ["result.txt"] and records[1].message == "bad data: it says so"


def test_what_is_finished_is_not_done_again(tmp_path, output):
    recorded(tmp_path, a="one", b="bad", c="untrusted")
    first = run(tmp_path, output, "abc")
    seen = []
    second = run(tmp_path, output, "cba", report=lambda record, earlier: seen.append(earlier))
    assert second == first[::-1] and seen == [True] * 3
    assert [tries(tmp_path, name) for name in "abc"] == [1, 1, 1]


def test_another_recording_and_a_damaged_result_are_done_again(tmp_path, output):
    recorded(tmp_path, a="one", b="two", c="three")
    run(tmp_path, output, "abc")
    recorded(tmp_path, a="ONE")
    (output / "b/result.txt").write_text("flipped")
    (output / "c/job.json").write_text("{")
    assert all(record.is_whole(output / record.name) for record in run(tmp_path, output, "abc"))
    assert [tries(tmp_path, name) for name in "abc"] == [2, 2, 2]
    assert (output / "a/result.txt").read_text() == "ONE"


def test_a_failed_job_is_final_unless_asked_for(tmp_path, output):
    recorded(tmp_path, a="one", b="bad", c="untrusted")
    run(tmp_path, output, "abc")
    again = [dataclasses.replace(job, redo=True) for job in jobs_in(tmp_path, "abc")]
    run_batch([again], output, copy)
    assert [tries(tmp_path, name) for name in "abc"] == [1, 2, 1]


def test_two_batches_on_one_output_exclude_each_other(tmp_path, output):
    recorded(tmp_path, a="one")
    (output / ".batch").mkdir()
    with FileLock(output / ".batch/batch.lock"), pytest.raises(BatchError, match="another batch"):
        run(tmp_path, output, "a")
    assert tries(tmp_path, "a") == 0
    assert run(tmp_path, output, "a")[0].status == "done"


def test_an_interrupt_leaves_a_table_and_no_note(tmp_path, output):
    recorded(tmp_path, a="one", b="two")
    tables = []

    def interrupted(job, folder):
        if job.name == "b":
            raise KeyboardInterrupt
        return copy(job, folder)

    with pytest.raises(KeyboardInterrupt):
        run_batch(
            [jobs_in(tmp_path, "ab")], output, interrupted,
            tabulate=lambda records, _: tables.append([r.name for r in records]),
        )  # fmt: skip
    assert tables[-1] == ["a"] and not list((output / ".batch").glob("*.json"))
    assert [r.tries for r in run(tmp_path, output, "ab")] == [1, 1]


def test_a_table_follows_while_nothing_arrives(tmp_path, output, monkeypatch):
    """What ended just after a writing of the table was in none until the next recording came."""
    recorded(tmp_path, a="one", b="two")
    monkeypatch.setattr("fitting.batch._run.THRESHOLDS", BatchThresholds(table_s=0.05))
    tables = []

    def write(records, _):
        time.sleep(0.05)  # a share of the time that would keep the next one back for 2.5 s
        tables.append([r.name for r in records])

    def arriving():
        yield jobs_in(tmp_path, "a")
        time.sleep(0.1)
        yield jobs_in(tmp_path, "b")
        for _ in range(2):
            time.sleep(0.1)
            yield []
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_batch(arriving(), output, copy, tabulate=write)
    whole = [table for table in tables if len(table) == 2]
    assert len(whole) == 2  # one while nothing arrived, and not again until the interrupt


def test_an_output_that_takes_no_more_stops_the_batch(tmp_path, output):
    recorded(tmp_path, a="one", b="two")
    run(tmp_path, output, "a")
    (output / "b").write_text("in the way of a folder")
    with pytest.raises(OutputError):
        run(tmp_path, output, "ab")
    assert tries(tmp_path, "b") == 0 or not (output / "b").is_dir()
    (output / "b").unlink()
    assert [r.status for r in run(tmp_path, output, "ab")] == ["done", "done"]


ENDED = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from batch_jobs import copy, jobs_in
from fitting.batch._run import run_batch
if __name__ == "__main__":
    folder = Path(sys.argv[2])
    records = run_batch([jobs_in(folder, sys.argv[3])], folder / "out", copy)
    print(*(f"{r.name}:{r.status}:{r.exit_code}:{r.tries}" for r in records))
"""


@pytest.mark.process
def test_a_job_that_ends_this_process_is_known_by_its_note(tmp_path, output):
    recorded(tmp_path, a="one", b="kill", c="three")
    script = tmp_path / "ended.py"
    script.write_text(ENDED)
    command = [sys.executable, script, ROOT / "tests/support", tmp_path, "abc"]
    first = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert first.returncode == -9 and tries(tmp_path, "b") == 1
    second = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert second.stdout.split() == ["a:done:0:1", "b:failed:1:3", "c:done:0:1"], second.stderr
    assert [tries(tmp_path, name) for name in "abc"] == [1, 3, 1]


@pytest.mark.process
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
def test_a_job_that_ends_its_worker_is_tried_three_times_and_listed(tmp_path, output):
    recorded(tmp_path, a="one", b="exit", c="bad", d="kill", e="five", f="untrusted")
    records = run(tmp_path, output, "abcdef", workers=2)
    assert [(r.status, r.exit_code) for r in records] == [
        ("done", 0), ("failed", 1), ("failed", 3), ("failed", 1), ("done", 0), ("done", 4),
    ]  # fmt: skip
    assert [tries(tmp_path, name) for name in "bd"] == [3, 3]
    assert "3 times" in records[1].message and "\n" not in records[1].message
    assert all(r.is_whole(output / r.name) for r in records)
    assert run(tmp_path, output, "abcdef") == records


def has_profile(dask_worker) -> bool:
    return "profile" in dask_worker.periodic_callbacks


@pytest.mark.process
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
def test_workers_keep_no_profile_of_themselves(output):
    """It grew by 0.7 MB a second and worker."""
    (output / ".batch").mkdir()
    with local_cluster(1, output, copy, "batch") as cluster:
        cluster.wait(0.0)  # starts the worker
        cluster._client.wait_for_workers(1, timeout=120.0)
        assert list(cluster._client.run(has_profile).values()) == [False]
