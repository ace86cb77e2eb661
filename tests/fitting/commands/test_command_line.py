"""The command line as people type it: first steps, sentences, examples, progress, JSON errors."""

import contextlib
import dataclasses
import importlib
import inspect
import json

import numpy as np
import pytest

from fitting.cli import app, main
from fitting.commands.fit import _takes_another_time, fit
from fitting.commands.run import run
from fitting.commands.shared import _progress
from fitting.commands.shared._about import describe_recording, estimate_seconds
from fitting.commands.shared._listing import COMMANDS
from rapi_jax import DataError, Recording, predict, triangle
from rapi_jax.examples import paper_device
from rapi_jax.io import write_recording


def ran(arguments: list[str]) -> int:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert isinstance(ended.value.code, int)
    return ended.value.code


def test_without_arguments_it_says_where_to_begin(capsys):
    assert ran([]) == 0
    out = capsys.readouterr().out
    lines = [line.split() for line in out.splitlines() if line.startswith("  rapi ")]
    assert [words[1] for words in lines] == [
        "demo", "drive", "import", "check", "fit", "compensate", "diagnose",
    ]  # fmt: skip


def test_each_command_has_a_sentence_and_examples_that_it_takes(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    with monkeypatch.context() as fresh:  # the sentence, also after a help that showed all
        fresh.setattr(app["fit"], "help", COMMANDS["fit"].sentence)
        assert ran(["--help"]) == 0
    shown = " ".join(capsys.readouterr().out.replace("│", " ").split())
    for name, one in COMMANDS.items():
        assert f"{name} {one.sentence}" in shown
        for line in one.examples:
            words = line.split()
            assert words[:2] == ["rapi", name]
            app.parse_args([w.strip("'") for w in words[1:]], exit_on_error=False)
        module, _, attribute = one.target.partition(":")
        assert hasattr(importlib.import_module(module), attribute)


def test_help_of_a_command_tells_all_and_ends_with_examples(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    assert ran(["fit", "--help"]) == 0
    out = capsys.readouterr().out
    assert "Exit code 0: trusted; 4: not to be trusted" in out
    assert out.rstrip().endswith(COMMANDS["fit"].examples[-1])
    assert all(len(line.split()) > 3 for line in out.splitlines()[2:5] if line)  # filled


def test_a_help_tells_of_the_options_file_where_a_command_reads_it(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    for words, read in (
        (["fit"], True),
        ([], True),
        (["bench", "serve"], False),
        (["blind"], False),
    ):
        assert ran([*words, "--help"]) == 0
        assert ("rapi.toml" in capsys.readouterr().out) == read


def test_help_shows_defaults_as_they_are_typed(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(app["population"], "help", COMMANDS["population"].sentence)  # kept after it
    assert ran(["population", "--help"]) == 0
    out = capsys.readouterr().out
    assert "[default: d_0]" in out and "[default: none]" in out


def test_a_failure_is_an_object_for_machines_and_a_line_for_people(tmp_path, capsys):
    for arguments, code, kind in (
        (["fit", str(tmp_path / "none"), "-o", "x", "--json"], 3, "bad data"),
        (["fit", "--json", "--strats"], 2, "usage"),
    ):
        assert run(app, arguments) == code
        out, err = capsys.readouterr()
        found = json.loads(out)
        assert found.pop("schema") == "rapi.error/1"
        assert (found["exit_code"], found["kind"]) == (code, kind)
        assert err == f"{kind}: {found['message']}\n"
    assert run(app, arguments[:1]) == 2 and capsys.readouterr().out == ""


def recording() -> Recording:
    drives = [
        drive
        for swing in (2.0, 4.5)
        for drive in triangle([10.0, 40.0], amplitude=swing, bias=3.0, samples=400, periods=4)
    ]
    rng = np.random.default_rng(0)
    noisy = [np.asarray(predict(paper_device(), d)) + 0.02 * rng.normal(size=400) for d in drives]
    return Recording.of(drives, noisy)


def test_what_is_about_to_be_worked_on():
    data = recording()
    text = describe_recording(data, 58.0)
    assert text == "4 runs of 4 periods at 10 to 40 Hz, two swings, noise 20 MHz rms; about 60 s"
    assert describe_recording(data, 190.0).endswith("about 3 minutes")
    other = describe_recording(data, 58.0, usual=False)
    assert other.endswith("about 60 s with the default options")
    assert describe_recording(data, 20.0, 160.0).endswith(
        "about 20 s, up to 3 minutes where no model fits"
    )
    fewer = dataclasses.replace(data, runs=data.runs[:2])
    for work in ("fit", "diagnose"):  # which of them takes longer is not known: see MEASURED
        assert estimate_seconds(fewer, work) < estimate_seconds(data, work)


@pytest.mark.parametrize(
    ("given", "another"),
    [({}, False), ({"plots": False, "drift": True}, False), ({"starts": 12}, True)]
    + [({"choose": True}, True), ({"intervals": "profile"}, True)],
)
def test_a_time_is_of_the_options_with_which_it_was_measured(
    given: dict[str, object], another: bool
):
    defaults = {name: one.default for name, one in inspect.signature(fit).parameters.items()}
    assert _takes_another_time(defaults | given) == another


def test_a_drive_that_turns_densely_is_announced_to_take_longer():
    drives = triangle([10.0, 40.0], amplitude=4.0, bias=3.0, samples=8000, periods=4)
    still = Recording.of(drives, [drive.value for drive in drives])
    rng = np.random.default_rng(0)
    noisy = [
        dataclasses.replace(drive, value=drive.value + 0.002 * rng.normal(size=drive.size))
        for drive in drives
    ]
    turning = Recording.of(noisy, [drive.value for drive in drives])
    more = estimate_seconds(turning, "fit") - estimate_seconds(still, "fit")
    assert more == pytest.approx(4e-3 * 16000, rel=1e-6)  # s, as measured
    few = [drive_of(turning, k, 1000) for k in range(2)]  # noise costs time in few samples, too
    less = Recording.of(few, [drive.value for drive in few])
    assert estimate_seconds(less, "fit") > 4e-3 * 2000 + 18.0


def drive_of(recording, k, samples):
    """The first samples of a run's drive."""
    drive = recording.drives[k]
    return dataclasses.replace(drive, time=drive.time[:samples], value=drive.value[:samples])


# Samples a period, periods, rates, swings, and what they took: processor seconds of `rapi fit`
# without and with earlier programs, and of `rapi diagnose` without.
MEASURED = {
    "one rate": (400, 3, (10.0,), (4.5,), 23.0, 16.5, 28.6),
    "three rates": (500, 3, (10.0, 20.0, 40.0), (4.5,), 29.6, 18.8, 24.4),
    "two swings": (400, 4, (10.0, 20.0, 40.0), (2.5, 4.5), 30.7, 24.9, 24.7),
    "many samples": (4000, 4, (5.0, 10.0, 20.0, 40.0), (2.5, 4.5), 35.9, 23.1, 33.8),
    "a noisy drive": (400, 4, (10.0, 20.0, 40.0), (2.5, 4.5), 60.9, 27.9, 36.1),
    "very many": (20000, 4, (5.0, 10.0, 20.0, 30.0, 40.0), (2.5, 4.5), 43.0, 33.6, 27.5),
}


@pytest.mark.parametrize("name", MEASURED)
def test_the_time_announced_is_within_a_factor_of_two_of_that_measured(name):
    samples, periods, rates, swings, cold, warm, diagnosed = MEASURED[name]
    shape = {"bias": 3.0, "samples": samples * periods, "periods": periods}
    drives = [d for swing in swings for d in triangle(list(rates), amplitude=swing, **shape)]
    data = Recording.of(drives, [drive.value for drive in drives])
    fitted = estimate_seconds(data, "fit")
    assert 0.5 < fitted / cold < 2.0 and 0.5 < fitted / warm < 2.0
    assert 0.5 < estimate_seconds(data, "diagnose") / diagnosed < 2.0


def test_progress_without_a_terminal_is_a_line_now_and_then(capsys, monkeypatch):
    def said() -> list[str]:
        now = [0.0]
        monkeypatch.setattr(_progress.time, "monotonic", lambda: now[0])
        with _progress.progress("fitting", False, about="4 runs; about 10 s") as report:
            for second in range(0, 25, 4):
                now[0] = float(second)
                report(f"step {second}")
        return capsys.readouterr().err.splitlines()

    monkeypatch.delenv(_progress.SWITCH)
    assert said() == [
        "fitting: 4 runs; about 10 s", "fitting: step 12 (12 s)", "fitting: step 24 (24 s)",
    ]  # fmt: skip
    monkeypatch.setenv(_progress.SWITCH, "0")
    assert said() == ["fitting: 4 runs; about 10 s"]


@pytest.mark.parametrize(("options", "known"), [([], True), (["--plays", "6"], False)])
def test_the_bar_has_the_time_left_where_it_was_measured(tmp_path, monkeypatch, options, known):
    write_recording(recording(), tmp_path / "data")
    seen = []

    @contextlib.contextmanager
    def noted(title, as_json, *, about="", expected_s=None):
        seen.append(expected_s)
        raise DataError("far enough")
        yield

    monkeypatch.setattr(_progress, "progress", noted)
    assert ran(["fit", str(tmp_path / "data"), "-o", str(tmp_path / "out"), *options]) == 3
    assert [expected is not None for expected in seen] == [known]


def test_progress_on_a_terminal_has_the_time_left(capsys, monkeypatch):
    monkeypatch.delenv(_progress.SWITCH)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    with _progress.progress("fitting", False, about="4 runs", expected_s=60.0) as report:
        report("starts")
    err = capsys.readouterr().err
    assert "fitting: 4 runs" in err and "about 60 s left" in err
