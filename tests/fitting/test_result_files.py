"""Parts of two results in one folder are refused by name when they are read."""

import json
import os
import shutil
from pathlib import Path

import pytest
from benches import bench_file

from fitting import fit
from fitting._result_files import check_belongs
from fitting.cli import app
from fitting.commands.run import failing_alone, run
from fitting.commands.shared._model import load_model
from fitting.report import write_fit
from rapi_jax import DataError, Identified, LimitError, ModelError
from rapi_jax.examples import paper_device, paper_recording
from rapi_jax.io import OutputError, write_model
from tests.support.spoiled import healthy


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Two fits of two devices, each in its folder."""
    folders = []
    for seed in (81, 82):
        columns = healthy(seed)
        result = fit(columns.device, columns.recording(), starts=2, guess=False)
        result.save(folder := tmp_path_factory.mktemp(f"fit{seed}"))
        folders.append((folder, result))
    return folders


def test_a_whole_result_is_read_and_lists_its_files(results):
    folder, _ = results[0]
    listed = json.loads((folder / "model.json").read_text())["files"]
    names = {path.name for path in folder.iterdir()} - {"model.json"}
    assert set(listed) == names and "model.rapi" in names and "loops.png" in names
    load_model(folder)


def test_files_lists_what_was_written_and_others_are_named_beside_it(results, tmp_path):
    """Pictures of an earlier fit that a new one without pictures leaves are no part of it."""
    _, result = results[0]
    result.save(tmp_path)
    result.save(tmp_path, plots=False)
    listed = json.loads((tmp_path / "model.json").read_text())
    assert "model.rapi" in listed["files"] and None not in listed["files"].values()
    assert "loops.png" in listed["earlier_files"]
    assert {p.name for p in tmp_path.iterdir()} == {
        *listed["files"], *listed["earlier_files"], "model.json"
    }  # fmt: skip
    with pytest.raises(DataError, match="is of an earlier result than model.json"):
        check_belongs(tmp_path / "loops.png")
    result.save(tmp_path)
    again = json.loads((tmp_path / "model.json").read_text())
    assert "earlier_files" not in again and "loops.png" in again["files"]


@pytest.mark.fault(name="a model of another fit beside a result", promise="exit 3, one line")
def test_a_model_of_another_fit_is_refused(results, tmp_path):
    (one, _), (other, _) = results
    shutil.copytree(one, mixed := tmp_path / "mixed")
    shutil.copy(other / "model.rapi", mixed)
    with pytest.raises(DataError, match=r"model\.rapi is not the file that model\.json"):
        load_model(mixed)


@pytest.mark.fault(name="a writer that ends anywhere in a result", promise="refused by name")
@pytest.mark.parametrize("failing", ["model.rapi", "loops.png", "starts.png", "model.json"])
@pytest.mark.parametrize("fresh", [False, True])
def test_what_ends_while_writing_is_refused_by_name(results, tmp_path, failing, fresh, monkeypatch):
    """Wherever it ends, in a new folder or over an old result."""
    (one, _), (_, new) = results
    folder = tmp_path / "again"
    folder.mkdir() if fresh else shutil.copytree(one, folder)
    import rapi_jax.io._atomic as atomic

    renamed = 0

    def stop(source, target):
        nonlocal renamed
        renamed += Path(target).name == "model.json"
        if Path(target).name == failing and (failing != "model.json" or renamed == 2):
            raise OSError(28, "No space left on device")
        return os.rename(source, target)

    monkeypatch.setattr(atomic.os, "replace", stop)
    with pytest.raises(OutputError, match="No space left"):
        write_fit(new, folder, plots=True)
    monkeypatch.undo()
    if fresh and failing == "model.rapi":
        with pytest.raises(ModelError, match="no such model"):
            load_model(folder)
        return
    with pytest.raises(
        DataError, match=r"model\.rapi is of a result that was not finished, as mod"
    ):
        load_model(folder)
    write_fit(new, folder, plots=False)
    assert load_model(folder)[1]["data_sha256"] == new.recording.sha256()


def test_where_not_even_the_beginning_is_written_the_old_result_stays(
    results, tmp_path, monkeypatch
):
    (one, old), (_, new) = results
    shutil.copytree(one, folder := tmp_path / "again")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutputError, match="No space left"):
        write_fit(new, folder, plots=True)
    monkeypatch.undo()
    assert load_model(folder)[1]["data_sha256"] == old.recording.sha256()
    for path in folder.iterdir():
        check_belongs(path)


@pytest.fixture(scope="module")
def drives(tmp_path_factory):
    """Two folders of drives, the second for a wider scan and at one rate less."""
    folder = tmp_path_factory.mktemp("drives")
    recording, _ = paper_recording(samples=400)
    (model := folder / "model").mkdir()
    write_model(
        model / "model.rapi", paper_device(), response_unit="GHz", drive_unit="V", trusted=True,
        identified=Identified.of(recording).to_dict(), data_sha256="",
    )  # fmt: skip
    common = ("--no-plots", "--samples", "512", "--frequency", "20")
    for span, name, more in (("60", "first", ("30",)), ("70", "second", ())):
        out = str(folder / name)
        assert run(app, ["compensate", str(model), "--span", span, "-o", out, *common, *more]) == 0
    return folder


@pytest.fixture
def play(tmp_path, capsys):
    """`rapi measure`, which plays nothing here: the exit code, and the line of an error."""
    bench = bench_file(tmp_path)

    def measure(drive):
        capsys.readouterr()
        out = str(tmp_path / "sent")
        code = run(app, ["measure", str(bench), str(drive), "-o", out, "--dry-run"])
        return code, capsys.readouterr().err

    return measure


@pytest.mark.fault(
    name="a drive that its certificate was not made with", promise="exit 3, one line, not played"
)
def test_a_drive_that_its_certificate_was_not_made_with_is_not_played(drives, tmp_path, play):
    shutil.copytree(drives / "first", folder := tmp_path / "mixed")
    drive = folder / "drive_20Hz.csv"
    assert play(drive)[0] == 0
    shutil.copy(drives / "second" / "drive_20Hz.csv", drive)
    code, error = play(drive)
    assert code == 3 and "drive_20Hz.csv is not the file that certificate.json" in error


@pytest.mark.fault(
    name="a drive of an earlier result beside a new certificate",
    promise="exit 3, one line, not played",
)
@pytest.mark.parametrize("null", [False, True])
def test_a_drive_of_an_earlier_result_is_not_played(drives, tmp_path, play, null):
    """Where a certificate names it as no part of its own; `null`: as earlier versions did."""
    shutil.copytree(drives / "first", folder := tmp_path / "again")
    content = json.loads((drives / "second" / "certificate.json").read_text())
    name = "drive_30Hz.csv"
    content |= {"files": content["files"] | {name: None}} if null else {"earlier_files": [name]}
    (folder / "certificate.json").write_text(json.dumps(content))
    code, error = play(folder / "drive_30Hz.csv")
    assert code == 3 and "of an earlier result than certificate.json" in error
    assert error.count("\n") == 1


AGAIN = ("--frequency", "20", "--no-plots", "--samples", "512", "-o")


def test_drives_that_are_not_made_again_are_removed_and_named(drives, tmp_path, play, capsys):
    """Those at 30 Hz are of another span; what is not of the drives stays."""
    shutil.copytree(drives / "first", folder := tmp_path / "again")
    (folder / "notes.txt").write_text("mine")
    model = str(drives / "model")
    capsys.readouterr()
    assert run(app, ["compensate", model, "--span", "70", *AGAIN, str(folder)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "drive_30Hz.afg, drive_30Hz.csv, drive_30Hz.nc" in told and "removed" in told
    listed = json.loads((folder / "certificate.json").read_text())["files"]
    assert {path.name for path in folder.iterdir()} == {*listed, "certificate.json", "notes.txt"}
    assert "drive_30Hz.csv" not in listed and None not in listed.values()
    assert play(folder / "drive_20Hz.csv")[0] == 0
    assert run(app, ["compensate", model, "--span", "70", *AGAIN, str(folder), "--json"]) == 0
    assert "removed" not in "".join(capsys.readouterr())


@pytest.mark.fault(name="an earlier drive that was changed since", promise="exit 3, kept")
def test_an_earlier_drive_that_was_changed_is_not_removed(drives, tmp_path, capsys):
    shutil.copytree(drives / "first", folder := tmp_path / "again")
    (folder / "drive_30Hz.csv").write_text("mine")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    model = str(drives / "model")
    assert run(app, ["compensate", model, "--span", "70", *AGAIN, str(folder)]) == 3
    assert "drive_30Hz.csv was changed after certificate.json" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_plain_drives_that_are_not_made_again_are_removed_and_named(tmp_path, capsys):
    command = ["drive", "--low", "1", "--high", "2", "-o", str(tmp_path), "--frequency"]
    assert run(app, [*command, "10", "20"]) == 0
    capsys.readouterr()
    assert run(app, [*command, "10"]) == 0
    assert "drive_20Hz.afg, drive_20Hz.csv" in " ".join(capsys.readouterr().out.split())
    assert {path.name for path in tmp_path.iterdir()} == {
        "drive_10Hz.afg", "drive_10Hz.csv", "drives.json",
    }  # fmt: skip


@pytest.mark.fault(
    name="a drive whose certificate was not written", promise="exit 3, one line, not played"
)
def test_a_drive_whose_certificate_was_not_reached_is_not_played(
    drives, tmp_path, play, monkeypatch
):
    real = os.replace

    def full(source, target):
        if Path(target).name == "drive_20Hz.nc":
            raise OSError(28, "No space left on device")
        real(source, target)

    for begin in ("first", None):  # over an old result, and in a new folder
        folder = tmp_path / f"after {begin}"
        if begin:
            shutil.copytree(drives / begin, folder)
        with monkeypatch.context() as patched:
            patched.setattr(os, "replace", full)
            arguments = ["--span", "70", "--frequency", "20", "--no-plots", "--samples", "512"]
            command = ["compensate", str(drives / "model"), *arguments, "-o", str(folder)]
            assert run(app, command) == 3
        code, error = play(folder / "drive_20Hz.csv")
        assert code == 3 and "of a result that was not finished" in error


@pytest.mark.parametrize("text", ["", "not JSON", "[]", '{"files": 3}', '{"files": {}}', "{}"])
def test_a_list_that_says_nothing_of_a_file_is_no_obstacle(tmp_path, text):
    (tmp_path / "model.json").write_text(text)
    (tmp_path / "model.rapi").write_bytes(b"anything")
    check_belongs(tmp_path / "model.rapi")


@pytest.mark.fault(
    name="a drive beside the certificate of others", promise="exit 3, one line, not played"
)
def test_a_drive_that_no_certificate_lists_is_not_played(drives, tmp_path, play, capsys):
    """Nor is a new certificate written beside it."""
    shutil.copytree(drives / "second", folder := tmp_path / "mixed")
    shutil.copy(drives / "first" / "drive_30Hz.csv", folder / "drive_50Hz.csv")
    code, error = play(folder / "drive_50Hz.csv")
    assert code == 3 and "certificate.json beside it does not list" in error
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    arguments = ["--span", "60", "--frequency", "20", "--no-plots", "--samples", "512"]
    assert run(app, ["compensate", str(drives / "model"), *arguments, "-o", str(folder)]) == 3
    error = capsys.readouterr().err
    assert "holds drive_50Hz.csv, which no certificate.json" in error and error.count("\n") == 1
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_what_fails_alone_is_told_by_its_own_kind(capsys):
    """A limit is a limit, not bad data."""
    failed = []
    for error in (LimitError("too steep"), DataError("no runs"), ModelError("another version")):
        with failing_alone("monday", failed, alone=False):
            raise error
    told = capsys.readouterr().err.splitlines()
    assert [line.partition(": ")[0] for line in told] == [
        "beyond the limits", "bad data", "bad data",
    ]  # fmt: skip
    assert failed == ["monday"] * 3
    with pytest.raises(LimitError), failing_alone("monday", failed, alone=True):
        raise LimitError("too steep")
