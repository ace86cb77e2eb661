"""A `rapi.toml` beside the data: what it sets, what wins over it, what it may not do."""

import hashlib
import re
from pathlib import Path
from typing import Any

import pytest
from cyclopts import CycloptsError

from fitting.cli import app
from fitting.commands.batch._jobs import job_source
from fitting.commands.shared._options_file import DATA, describe_options_file, find_options_file
from fitting.commands.shared.files._provenance import provenance
from rapi_jax import DataError


@pytest.fixture
def recording(tmp_path) -> Path:
    """A folder that stands for a recording; nothing reads it here."""
    made = tmp_path / "session" / "monday"
    made.mkdir(parents=True)
    return made


def bind(text: str, *arguments: object) -> dict[str, Any]:
    """The arguments with which a command would be called, beside a file of this text."""
    place = next(Path(str(a)) for a in arguments if isinstance(a, Path))
    (place.parent / "rapi.toml").write_text(text, encoding="utf-8")
    _, bound, _ = app.parse_args(
        [str(a) for a in arguments], exit_on_error=False, print_error=False
    )
    return bound.arguments


def test_the_table_of_the_command_is_read_and_said(recording, capfd):
    text = '[fit]\nstarts = 12\nplots = false\nloss = "huber"\n[check]\nnan = "mask"\n'
    found = bind(text, "fit", recording, "-o", "out")
    assert (found["starts"], found["plots"], found["loss"]) == (12, False, "huber")
    assert "nan" not in found
    said = " ".join(capfd.readouterr().err.split())
    assert "rapi.toml: starts = 12, plots = False, loss = huber." in said
    assert bind(text, "check", recording)["nan"] == "mask"


def test_the_command_line_wins(recording, capfd):
    text = "[fit]\nstarts = 12\n"
    assert bind(text, "fit", recording, "-o", "out", "--starts", 3)["starts"] == 3
    assert "changes nothing" in " ".join(capfd.readouterr().err.split())


def test_lists_dates_and_names_with_hyphens(recording):
    text = "[compensate]\nspan = 60\nfrequency = [10, 20.5]\n"
    found = bind(text, "compensate", recording, "-o", "out")
    assert found["span"] == 60.0 and found["frequency"] == [10.0, 20.5]
    text = "[import]\nmax-samples = 5000\nrecorded_at = 2026-11-20T10:00:00\n"
    found = bind(text, "import", recording, "-o", "out")
    assert found["max_samples"] == 5000 and found["recorded_at"] == "2026-11-20T10:00:00"


def test_paths_are_from_where_the_file_is(recording):
    found = bind('[diagnose]\nlimits = "limits.toml"\n', "diagnose", recording, "-o", "out")
    assert found["limits"] == recording.parent / "limits.toml"


def test_the_folder_itself_comes_before_the_one_around_it(recording):
    (recording / "rapi.toml").write_text("[fit]\nstarts = 2\n")
    assert bind("[fit]\nstarts = 3\n", "fit", recording, "-o", "out")["starts"] == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[fit]\nstart = 3\n", r"\[fit\] has no option `start`. Did you mean `starts`\?"),
        ("[fitt]\nstarts = 3\n", r"'fitt' is no table of a command. Did you mean \[fit\]\?"),
        ("starts = 3\n", "'starts' is no table of a command"),
        ("fit = 3\n", "'fit' is no table of a command"),
        ("[fit]\nstarts = 1000\n", "starts"),
        ('[fit]\nloss = "hubre"\n', "huber"),
        ('[fit]\nrecording = "x"\n', "`recording` is the data"),
        ('[fit]\nplugin = "x.py"\n', "command line only: its code is run"),
        ('[fit]\noutput = "/"\n', "command line only"),
        ("[fit]\n[fit.starts]\na = 1\n", "starts"),
    ],
)
def test_what_is_wrong_is_refused_in_words(recording, text, said):
    with pytest.raises(CycloptsError) as caught:
        bind(text, "fit", recording, "-o", "out")
    message = " ".join(str(caught.value).split())
    assert re.search(said, message) and "rapi.toml" in message


@pytest.mark.parametrize("key", ["untrusted", "extrapolate", "json", "plugin"])
def test_a_file_beside_a_model_drops_no_check(recording, key):
    with pytest.raises(CycloptsError, match="command line only"):
        bind(f"[compensate]\n{key} = true\n", "compensate", recording, "-o", "out")


def test_what_is_no_toml_is_bad_data(recording):
    with pytest.raises(DataError, match="not valid TOML"):
        bind("[fit\n", "fit", recording, "-o", "out")


def test_recordings_with_different_files_are_not_mixed(recording, tmp_path):
    other = tmp_path / "elsewhere" / "tuesday"
    other.mkdir(parents=True)
    with pytest.raises(CycloptsError, match="different option files: .* and none"):
        bind("[check]\nnan = 'mask'\n", "check", recording, other)
    twin = recording.parent / "tuesday"
    twin.mkdir()
    assert find_options_file([recording, twin]) == recording.parent / "rapi.toml"


def test_every_data_argument_is_one_of_its_command():
    for command, names in DATA.items():
        known = {one.field_info.name for one in app[command].assemble_argument_collection()}
        assert set(names) <= known, command


def test_the_file_is_in_the_provenance(recording):
    file = recording.parent / "rapi.toml"
    options = {"recording": recording, "recordings": (), "starts": 12}
    data = ("recording", "recordings")
    assert describe_options_file("rapi fit", options) is None
    file.write_text("[fit]\nstarts = 12\n")
    (recording / "manifest.toml").write_text('schema = "rapi.recording/1"\n')
    found = provenance("rapi fit", options, data)
    assert found["options"]["starts"] == 12
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    assert found["options_file"] == {"path": str(file), "sha256": digest}
    assert describe_options_file("rapi diagnose", options) is None
    assert describe_options_file("rapi batch --do fit", {"job": recording}) is None


def test_a_batch_takes_the_table_of_its_task(recording, tmp_path, capfd):
    (recording / "manifest.toml").write_text('schema = "rapi.recording/1"\n')
    file = recording.parent / "rapi.toml"
    file.write_text("[fit]\nplays = 8\nstarts = 3\nplots = false\n[batch]\nworkers = 1\n")
    named = (str(recording.parent), "--plays", "12")
    ((job,),) = job_source(named, None, tmp_path / "out", retry=False, watched=False)()
    assert [job.options[key] for key in ("plays", "starts", "plots")] == [12, 3, False]
    said = " ".join(capfd.readouterr().err.split())
    assert "rapi.toml: starts = 3, plots = False." in said
    ((job,),) = job_source(named[:1], "diagnose", tmp_path / "out", retry=False, watched=False)()
    assert "plays" not in job.options
    file.write_text("[fit]\nplayz = 8\n")
    with pytest.raises(CycloptsError, match=r"\[fit\] has no option `playz`.*mean `plays`"):
        job_source(named, None, tmp_path / "out", retry=False, watched=False)


@pytest.mark.parametrize("jobs", [(".",), ("*",), ("*/run?.nc",), ("monday", "--plays", "12")])
def test_options_of_a_batch(recording, jobs, capfd):
    folder = recording.parent
    (folder / "rapi.toml").write_text('[batch]\ndo = "diagnose"\nworkers = 2\nparquet = true\n')
    call = ["batch", str(folder / jobs[0]), "-o", "out", *jobs[1:]]
    _, bound, _ = app.parse_args(call, exit_on_error=False, print_error=False)
    found = bound.arguments
    assert (found["do"], found["workers"], found["parquet"]) == ("diagnose", 2, True)
    assert found["jobs"] == (call[1], *jobs[1:])
    call += ["--workers", "0"]
    _, bound, _ = app.parse_args(call, exit_on_error=False, print_error=False)
    assert bound.arguments["workers"] == 0


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("plays = 12", r"\[batch\] has no option `plays`. .* follow JOBS"),
        ('scheduler = "tcp://10.0.0.1:8786"', "command line only: it sends the jobs"),
        ("worker = 2", "Did you mean `workers`"),
        ('jobs = "x"', "`jobs` is the data"),
        ("workers = 5000", "workers"),
    ],
)
def test_what_a_batch_does_not_take_from_the_file(recording, key, said):
    (recording.parent / "rapi.toml").write_text(f"[batch]\n{key}\n")
    with pytest.raises(CycloptsError) as caught:
        bind(f"[batch]\n{key}\n", "batch", recording, "-o", "out")
    assert re.search(said, " ".join(str(caught.value).split()))
