"""Parts of two results in one folder are refused by name when they are read."""

import json
import shutil

import pytest

from fitting import fit
from fitting._result_files import check_belongs
from fitting.cli import app
from fitting.commands._model import load_model
from fitting.commands.run import run
from fitting.report import write_fit
from rapi_jax import DataError, Identified
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


def test_a_model_of_another_fit_is_refused(results, tmp_path):
    (one, _), (other, _) = results
    shutil.copytree(one, mixed := tmp_path / "mixed")
    shutil.copy(other / "model.rapi", mixed)
    with pytest.raises(DataError, match=r"model\.rapi is not the file that model\.json"):
        load_model(mixed)


@pytest.mark.parametrize("failing", ["model.rapi", "loops.png", "starts.png", "model.json"])
def test_what_ends_while_writing_leaves_no_list_of_the_old_result(
    results, tmp_path, failing, monkeypatch
):
    """Wherever it ends, the folder holds one model and either its own list or none."""
    (one, _), (_, new) = results
    shutil.copytree(one, folder := tmp_path / "again")
    import fitting.report.fit._files as files

    def stop(path, *rest, **more):
        if path.name == failing:
            raise OutputError("no space left")
        return kept[stop_of](path, *rest, **more)

    kept = {"model": files.write_model, "other": files.write_atomic}
    stop_of = "model" if failing == "model.rapi" else "other"
    monkeypatch.setattr(files, "write_model" if stop_of == "model" else "write_atomic", stop)
    with pytest.raises(OutputError):
        write_fit(new, folder, plots=True)
    monkeypatch.undo()
    assert not (folder / "model.json").exists()
    load_model(folder)


def test_a_drive_that_its_certificate_was_not_made_with_is_refused(tmp_path):
    recording, _ = paper_recording(samples=400)
    (model := tmp_path / "model").mkdir()
    write_model(
        model / "model.rapi", paper_device(), response_unit="GHz", drive_unit="V", trusted=True,
        identified=Identified.of(recording).to_dict(), data_sha256="",
    )  # fmt: skip
    common = ("--frequency", "20", "--no-plots", "--samples", "512")
    for span, name in (("60", "first"), ("70", "second")):
        out = str(tmp_path / name)
        assert run(app, ["compensate", str(model), "--span", span, "-o", out, *common]) == 0
    drive = tmp_path / "first" / "drive_20Hz.csv"
    check_belongs(drive)
    shutil.copy(tmp_path / "second" / "drive_20Hz.csv", drive)
    with pytest.raises(DataError, match=r"drive_20Hz\.csv is not the file that certificate\.json"):
        check_belongs(drive)


@pytest.mark.parametrize("text", ["", "not JSON", "[]", '{"files": 3}', '{"files": {}}', "{}"])
def test_a_list_that_says_nothing_of_a_file_is_no_obstacle(tmp_path, text):
    (tmp_path / "model.json").write_text(text)
    (tmp_path / "model.rapi").write_bytes(b"anything")
    check_belongs(tmp_path / "model.rapi")
