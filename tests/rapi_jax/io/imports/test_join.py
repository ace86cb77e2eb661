"""Recordings that were imported apart become one."""

import dataclasses

import numpy as np
import pytest
from scope_files import scanned

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, import_recording, read_recording, write_import

OPTIONS = ImportOptions(drive="u", response="y", drive_unit="V", response_unit="GHz")


@pytest.fixture
def folders(tmp_path):
    """Of one file for each rate, of other columns and another sampling rate."""
    made = []
    for rate, sample_hz, names in ((10.0, 4000.0, ("u", "y")), (40.0, 16000.0, ("u2", "y2"))):
        _, u, y = scanned((rate, 3, 4.5), sample_hz=sample_hz)
        path = tmp_path / f"{rate:g}.csv"
        np.savetxt(path, np.c_[u, y], delimiter=",", header=",".join(names), comments="")
        options = dataclasses.replace(
            OPTIONS, drive=names[0], response=names[1], sample_rate=sample_hz
        )
        folder = tmp_path / f"{rate:g}"
        write_import(import_recording(path, options), folder)
        made.append(folder)
    return made


def test_folders_are_joined_in_their_order(folders, tmp_path):
    joined = import_recording(folders)
    runs = joined.recording.runs
    parts = [read_recording(folder) for folder in folders]
    assert [run.name for run in runs] == ["run00", "run01"]
    assert [run.drive.rate for run in runs] == [10.0, 40.0]
    for run, part in zip(runs, parts, strict=True):
        np.testing.assert_array_equal(run.response, part.runs[0].response)
    assert runs[0].drive.start_s == 0.0
    assert runs[1].drive.start_s == pytest.approx(runs[0].drive.time[-1])
    assert "share one zero of the response" in joined.notes[-1]
    write_import(joined, tmp_path / "both")
    assert read_recording(tmp_path / "both").sha256() == joined.recording.sha256()


def test_zeros_of_their_own(folders):
    options = ImportOptions(response_origin="run")
    joined = import_recording(folders, options)
    assert joined.recording.response_origin == "run"
    assert "a zero of their own each" in joined.notes[-1]


def test_what_cannot_be_joined_says_why(folders, tmp_path):
    with pytest.raises(DataError, match=r"10 is a recording, .*40\.csv is none\. Import"):
        import_recording([folders[0], tmp_path / "40.csv"])
    with pytest.raises(DataError, match="`drive_unit` is said of a table"):
        import_recording(folders, ImportOptions(drive_unit="V"))
    manifest = folders[1] / "manifest.toml"
    manifest.write_text(manifest.read_text().replace('"GHz"', '"um"'))
    with pytest.raises(DataError, match="differ in `response_unit` .GHz in .*, um in "):
        import_recording(folders)


def test_a_slow_laser_is_imported_and_joined_where_its_units_are_confirmed(tmp_path):
    """5 MHz/V; what one import confirms, those that are joined need not be asked again."""
    made = []
    for rate in (10.0, 40.0):
        _, u, y = scanned((rate, 3, 4.5), sample_hz=4000.0)
        y = 5e-3 * (u - u.min()) + 1e-6 * y
        path = tmp_path / f"{rate:g}.csv"
        np.savetxt(path, np.c_[u, y], delimiter=",", header="u,y", comments="")
        options = dataclasses.replace(OPTIONS, sample_rate=4000.0)
        with pytest.raises(DataError, match="`rapi import --units-checked`"):
            import_recording(path, options)
        sure = dataclasses.replace(options, units_checked=True)
        write_import(import_recording(path, sure), tmp_path / f"{rate:g}")
        made.append(tmp_path / f"{rate:g}")
    assert import_recording(made).recording.provenance["units_checked"] == "true"
