"""Which recordings paths name, in which order, under which names; what is still arriving."""

import itertools

import pytest

from fitting.batch._thresholds import THRESHOLDS
from fitting.batch.jobs._find import find_recordings, name_jobs
from fitting.batch.jobs._jobs_file import option_tokens, read_jobs_file
from fitting.batch.jobs._key import content_sha256, job_key
from fitting.batch.jobs._watch import watch
from rapi_jax import DataError

SCHEMA = {"recording": "rapi.recording/1", "fringes": "rapi.fringes/1"}


def record(folder, kind="recording", text="0,0,0"):
    folder.mkdir(parents=True)
    entry = {"recording": "run", "fringes": "record"}[kind]
    (folder / "manifest.toml").write_text(
        f'schema = "{SCHEMA[kind]}"\n[[{entry}]]\nfile = "one.csv"\n'
    )
    (folder / "one.csv").write_text(text)
    return folder


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    record(tmp_path / "day/b")
    record(tmp_path / "day/a")
    record(tmp_path / "day/fringes", "fringes")
    (tmp_path / "day/damaged").mkdir()
    (tmp_path / "day/damaged/manifest.toml").write_text("= no TOML")
    (tmp_path / "day/c.nc").write_text("not read here")
    (tmp_path / "day/notes").mkdir()
    (tmp_path / "day/notes.txt").write_text("no recording")
    return tmp_path


def test_a_folder_holds_the_recordings_of_the_task_by_name(here):
    assert find_recordings("fit", ["day"]) == ["day/a", "day/b", "day/c.nc", "day/damaged"]
    assert find_recordings("range", ["day"]) == ["day/damaged", "day/fringes"]


def test_a_recording_a_manifest_and_a_glob_are_taken_as_given(here):
    assert find_recordings("fit", ["day/b"]) == ["day/b"]
    assert find_recordings("fit", ["day/b/manifest.toml", "day/b"]) == ["day/b"]
    assert find_recordings("fit", ["d*/[ab]"]) == ["day/a", "day/b"]


def test_several_paths_keep_their_order_and_bad_ones_their_place(here):
    given = ["day/b", "day/notes", "day/a", "day/notes.txt"]
    assert find_recordings("fit", given) == given


@pytest.mark.parametrize("given", ["day/none", "none*", "day/notes"])
def test_nothing_found_is_said(here, given):
    with pytest.raises(DataError, match="no such|nothing matches|no recording"):
        find_recordings("fit", [given])


def test_names_are_unique_and_safe():
    names = name_jobs(["x/a", "y/a", "a_1", "z/b.nc", "q/.batch", "w/a"])
    assert len({*names}) == 6 and names[2:5] == ["a_1", "b", "batch"]
    assert not any(name.startswith(".") for name in names)
    assert name_jobs(["x/a"], ["a"]) == ["a_1"]


def test_a_link_gives_the_name_that_was_typed(tmp_path):
    (tmp_path / "2026-03-01_raw").mkdir()
    (tmp_path / "monday").symlink_to(tmp_path / "2026-03-01_raw")
    assert name_jobs([tmp_path / "monday"]) == ["monday"]


def test_a_key_holds_data_options_and_the_content_of_paths(here):
    base = job_key("fit", {"plays": 10}, here / "day/a")
    assert base == job_key("fit", {"plays": 10}, here / "day/b")  # equal data
    assert base != job_key("diagnose", {"plays": 10}, here / "day/a")
    assert base != job_key("fit", {"plays": 12}, here / "day/a")
    (here / "mine.py").write_text("1")
    first = job_key("fit", {"plugin": (here / "mine.py",)}, here / "day/a")
    (here / "mine.py").write_text("2")
    assert first != job_key("fit", {"plugin": (here / "mine.py",)}, here / "day/a")
    before = content_sha256(here / "day/a")
    (here / "day/a/beside.txt").write_text("named by no manifest")
    assert content_sha256(here / "day/a") == before
    (here / "day/a/one.csv").unlink()
    assert content_sha256(here / "day/a") != before


def test_an_arriving_recording_is_taken_once_it_is_complete(here, monkeypatch):
    monkeypatch.setattr("time.sleep", lambda seconds: None)
    ticks = itertools.count(0.0, THRESHOLDS.settle_s / 4.0)
    found = watch("fit", ["arriving"], lambda: next(ticks))

    def soon():
        return [path for _ in range(12) for path in next(found)]

    assert soon() == []  # not there yet
    record(here / "arriving/a")
    (here / "arriving/a/one.csv").rename(here / "late.csv")
    assert soon() == []  # a file that the manifest names is missing
    (here / "late.csv").rename(here / "arriving/a/one.csv")
    assert soon() == ["arriving/a"] and soon() == []
    (here / "arriving/a/one.csv").write_text("1,1,1,1")
    assert soon() == ["arriving/a"]  # another recording now


def test_a_list_of_jobs(here):
    (here / "jobs.toml").write_text(
        'schema = "rapi.jobs/1"\n[options]\nplays = 12\n[[job]]\nrecording = "day/a"\nname = "x"\n'
    )
    table = read_jobs_file(here / "jobs.toml")
    assert table.do is None and table.job[0].name == "x"
    assert option_tokens({"plays": 12, "no_such": True, "plots": False}) == [
        "--plays", "12", "--no-such", "--no-plots",
    ]  # fmt: skip
    assert option_tokens({"frequency": [10.0, 20.0], "plugin": ["a.py", "b.py"]}) == [
        "--frequency", "10.0", "20.0", "--plugin", "a.py", "--plugin", "b.py",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("schema = 1", "schema"),
        ('schema = "rapi.jobs/1"\njob = []', "job"),
        ('schema = "rapi.jobs/1"\n[[job]]\nrecording = "a"\nplay = 1', "play"),
        ('schema = "rapi.jobs/1"\n[[job]]\nrecording = "a"\nname = "../a"', "cannot name"),
        ('schema = "rapi.jobs/1"\n' + '[[job]]\nrecording = "a"\nname = "b"\n' * 2, "two jobs"),
        ("= no TOML", "not valid TOML"),
    ],
)
def test_a_wrong_list_of_jobs_is_refused_in_one_line(here, text, said):
    (here / "jobs.toml").write_text(text)
    with pytest.raises(DataError, match=said) as raised:
        read_jobs_file(here / "jobs.toml")
    assert "\n" not in str(raised.value)
