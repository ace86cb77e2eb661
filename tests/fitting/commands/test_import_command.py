"""`rapi import`: from an oscilloscope's file to a fit."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from command_output import assert_one_line
from scope_files import MAKERS, SCOPE, T, U, Y, put, rows, scanned, scope

from rapi_jax import DataError
from rapi_jax.examples import paper_device
from rapi_jax.io import read_recording


def test_from_a_scope_file_to_a_model_close_to_the_true_one(rapi, tmp_path):
    path, data = scope(tmp_path), tmp_path / "r"
    code, out, err = rapi("import", path, "-o", data, *SCOPE)
    assert (code, err) == (0, "")
    for word in ("scope.csv: text, separated by commas", "40 Hz", "nothing speaks against a fit"):
        assert word in out
    done, step = out.splitlines()[-2:]
    assert done == f"written to {data}, with preview.png"
    assert step == f"Next: `rapi fit {data} -o result`"
    assert (data / "preview.png").read_bytes().startswith(b"\x89PNG")
    assert rapi("check", data)[0] == 0
    options = ("--starts", 2, "--no-plots", "--plays", 8)
    code, _, _ = rapi("fit", data, "-o", tmp_path / "fit", *options)
    assert code == 0
    model = json.loads((tmp_path / "fit" / "model.json").read_text())
    assert model["rmse"] < 1.5 * 0.02  # GHz: the noise
    _check_predictions(rapi, tmp_path, paper_device)


def _check_predictions(rapi, folder: Path, device) -> None:
    """A rate that was not recorded is predicted to a thousandth of the span."""
    from rapi_jax import Recording, predict, triangle
    from rapi_jax.io import write_recording

    (drive,) = triangle(30.0, amplitude=4.5, bias=3.0, samples=800, periods=2)
    truth = np.asarray(predict(device(), drive))
    write_recording(Recording.of([drive], [truth]), folder / "new")
    code, _, _ = rapi("predict", folder / "fit", folder / "new", "-o", folder / "p", "--no-plots")
    table = np.loadtxt(folder / "p" / "run00.csv", delimiter=",", skiprows=1)
    assert code == 0
    assert float(np.sqrt(np.mean((table[:, 3] - truth) ** 2))) < 1e-3 * np.ptp(truth)


def test_dry_run_writes_nothing_and_json_says_all(rapi, tmp_path):
    path = scope(tmp_path)
    code, out, _ = rapi("import", path, "-o", tmp_path / "r", *SCOPE, "--dry-run")
    assert code == 0 and "nothing was written (--dry-run); this would be" in out
    assert "earlier import" not in out
    assert list(tmp_path.iterdir()) == [path]
    code, out, err = rapi("import", path, "-o", tmp_path / "r.nc", *SCOPE, "--json")
    table = json.loads(out, parse_constant=pytest.fail)
    assert (code, err, table["schema"]) == (0, "", "rapi.import/1")
    assert [Path(one).name for one in table["written"]] == ["r.nc", "r.preview.png"]
    assert table["replaced"] is False
    assert table["next_step"] == f"Next: `rapi fit {tmp_path / 'r.nc'} -o result`"
    assert [one["excitation_hz"] for one in table["check"]["runs"]] == [10.0, 20.0, 40.0]
    assert read_recording(tmp_path / "r.nc").sha256() == table["check"]["data_sha256"]


def test_without_an_output_nothing_is_written_and_patterns_are_expanded(rapi, tmp_path):
    path = scope(tmp_path)
    code, out, _ = rapi("import", tmp_path / "sc*.csv", *SCOPE)
    assert code == 0 and "nothing was written: add `-o my-recording`" in out
    assert list(tmp_path.iterdir()) == [path]


def test_a_drive_from_the_command_line(rapi, tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=8000.0)
    path = put(tmp_path / "a.txt", "reading\n" + rows(y))
    line = (
        "--response", "reading", "--response-unit", "GHz", "--sample-rate", 8000, "--drive-unit",
        "V", "--drive-amplitude", 4.5, "--drive-offset", 3.0, "--drive-rate", 10,
    )  # fmt: skip
    code, out, _ = rapi("import", path, "-o", tmp_path / "r", *line, "--no-picture")
    assert code == 0 and "no drive was recorded; assumed is a triangle at 10 Hz" in out
    run = read_recording(tmp_path / "r").runs[0]
    np.testing.assert_allclose(run.drive.value, u, atol=1e-6)


# Mistakes that are none: what other programs refuse is read, and said.


@pytest.mark.parametrize("maker", ["PicoScope, decimal commas"])
def test_semicolons_and_decimal_commas_are_read(rapi, tmp_path, maker):
    path = scope(tmp_path, maker=maker)
    line = ("--drive", "Kanal A", "--response", "Kanal B", "--response-scale", "0.001",
            "--response-unit", "GHz")  # fmt: skip
    code, out, _ = rapi("import", path, "-o", tmp_path / "r", *line)
    assert code == 0 and "separated by semicolons, decimal commas" in out


def test_one_period_only_is_imported_and_said(rapi, tmp_path):
    t, u, y = scanned((10.0, 1, 4.5), sample_hz=8000.0)
    code, out, _ = rapi("import", scope(tmp_path, t, u, y), "-o", tmp_path / "r", *SCOPE)
    text = " ".join(out.split())
    assert code == 0 and "one period only: its rate is read off the record's length" in text
    assert "Record three periods or more" in text


def test_a_folder_without_a_manifest_is_led_to_the_import(rapi, tmp_path):
    scope(tmp_path)
    code, out, err = rapi("check", tmp_path)
    assert (code, out) == (3, "")
    assert_one_line(err, "no manifest.toml in this folder", "holds scope.csv", "rapi import")


def test_missing_readings_are_kept_as_gaps_where_asked(rapi, tmp_path):
    y = Y.copy()
    y[500:503] = np.nan
    code, _, _ = rapi("import", scope(tmp_path, y=y), "-o", tmp_path / "r", *SCOPE, "--nan", "mask")
    assert code == 0
    code, out, _ = rapi("check", tmp_path / "r")
    assert code == 0 and "masked" in out
    file = next(path for path in (tmp_path / "r").glob("run*.csv") if "nan" in path.read_text())
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:9], f"{lines[9].rpartition(',')[0]},nan", *lines[10:], ""]))
    code, _, err = rapi("check", tmp_path / "r")  # one more than the import left out
    assert code == 3
    assert_one_line(err, "4 value(s)", "the manifest says that 3 are missing", "--nan mask")
    assert rapi("check", tmp_path / "r", "--nan", "mask")[0] == 0


def test_check_tells_machines_the_next_step_too(rapi, tmp_path):
    rapi("import", scope(tmp_path), "-o", tmp_path / "r", *SCOPE, "--no-picture")
    code, out, _ = rapi("check", tmp_path / "r", "--json")
    assert code == 0 and json.loads(out)["next_step"] == f"Next: `rapi fit {tmp_path}/r -o result`"


def test_a_second_import_replaces_the_first(rapi, tmp_path):
    path = scope(tmp_path)
    where = ("import", path, "-o", tmp_path / "r", *SCOPE)
    assert "earlier import" not in rapi(*where)[1]
    assert "in place of the earlier import that is there" in rapi(*where, "--dry-run")[1]
    code, out, _ = rapi(*where, "--decimate", 2)
    assert code == 0 and "the earlier import that was there is replaced" in out
    sizes = [run.drive.size for run in read_recording(tmp_path / "r").runs]
    assert sum(sizes) < 0.52 * T.size and len(list((tmp_path / "r").glob("*.csv"))) == 3


def test_a_file_alone_is_asked_about_and_the_example_imports_it(rapi, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scope(tmp_path)
    code, out, err = rapi("import", "scope.csv")
    assert (code, out) == (3, "")
    assert_one_line(err, "question: scope.csv: which columns are", "time is column 'TIME'")
    (line,) = re.findall("`rapi (import scope.csv [^`]*)`", err)
    assert line == "import scope.csv --drive CH1 --response CH2 -o my-recording"
    code, out, _ = rapi(*line.split())
    assert code == 0 and "assumed: the response is a voltage in V" in out
    code, out, _ = rapi("import", "scope.csv", "--json")
    assert (code, json.loads(out)["kind"]) == (3, "question")


def test_the_last_line_leads_from_a_start_at_rest_to_a_fit(rapi, tmp_path, monkeypatch):
    """Each line is run as it stands, also that of `rapi check`."""
    monkeypatch.chdir(tmp_path)
    late = Y.copy()
    late[:800] -= 5.0 * np.exp(-np.arange(800) / 160.0)
    scope(tmp_path, y=late)

    def following(*line):
        _, out, _ = rapi(*line)
        return shlex.split(re.findall("`rapi (.*)`", out.splitlines()[-1])[0])

    first = following("import", "scope.csv", *SCOPE)
    assert "--skip-periods" in first and first[-2:] == ["-o", "my-recording"]
    assert following("import", "scope.csv", *SCOPE, "-o", "my-recording") == first
    again = following("check", "my-recording")
    assert sorted(again) == sorted(first)
    assert following(*again) == ["fit", "my-recording", "-o", "result"]
    assert following("check", "my-recording") == ["fit", "my-recording", "-o", "result"]


def test_a_fit_tells_what_is_known_before_it_begins(rapi, tmp_path, monkeypatch):
    def begin(*args, **options):
        raise DataError("the fit began")

    monkeypatch.setattr("fitting.commands.fit.identify_into", begin)
    late = Y.copy()
    late[:800] -= 5.0 * np.exp(-np.arange(800) / 160.0)
    for name, y in (("late", late), ("sound", Y)):
        rapi("import", scope(tmp_path, y=y), *SCOPE, "-o", tmp_path / name, "--no-picture")
    code, out, err = rapi("fit", tmp_path / "late", "-o", tmp_path / "f")
    known, begun = err.splitlines()
    assert (code, out) == (3, "") and "the fit began" in begun
    assert known.startswith("known before the fit: unsettled start: run 'run00'")
    _, _, err = rapi("fit", tmp_path / "sound", tmp_path / "late", "-o", tmp_path / "f")
    (known,) = (line for line in err.splitlines() if "known before" in line)
    assert known.startswith("known before the fit: late: unsettled start")


def test_a_noisy_drive_is_said_with_the_option_that_cleans_it(rapi, tmp_path):
    """A drive of ten bits over 10 V; the preview names the option, and with it finds no fault."""
    step = 10.0 / 2**10
    noisy = U + 2e-3 * np.random.default_rng(0).standard_normal(U.size)
    path = scope(tmp_path, u=np.round(noisy / step) * step)
    code, out, _ = rapi("import", path, "-o", tmp_path / "r", *SCOPE)
    assert code == 0
    assert "noisy drive" in out and "`--drive-as fitted`" in " ".join(out.split())
    assert rapi("check", tmp_path / "r")[0] == 4
    line = ("-o", tmp_path / "c", *SCOPE, "--drive-as", "fitted", "--skip-periods", 1)
    code, out, _ = rapi("import", path, *line)
    assert code == 0 and "noisy drive" not in out and "1 period(s) are left out" in out
    assert rapi("check", tmp_path / "c")[0] == 0


def test_the_clock_of_a_labview_file_is_found(rapi, tmp_path):
    head = "LabVIEW Measurement\nSeparator\tTab\n***End_of_Header***\n\nChannels\t2\n"
    head += "X_Dimension\tTime\tTime\n***End_of_Header***\nX_Value\tDrive\tResponse\n"
    lines = (f"{t:.6f}\t{u:.6f}\t{y:.6f}\n" for t, u, y in zip(T, U, Y, strict=True))
    path = put(tmp_path / "a.lvm", head + "".join(lines))
    units = ("--drive-unit", "V", "--response-unit", "GHz")
    code, _, err = rapi("import", path, *units, "-o", tmp_path / "r")
    assert code == 0, err
    runs = read_recording(tmp_path / "r").runs
    assert len(runs) == 3 and runs[0].drive.step_s == pytest.approx(1.0 / 8000.0, rel=1e-3)


USAGE = {
    "half a drive": (("--drive-rate", 10), "Give both --drive-amplitude and --drive-rate"),
    "column and made drive": (
        ("--drive", "CH1", "--drive-rate", 10, "--drive-amplitude", 1),
        "give either a column of the drive",
    ),
    "an offset alone": (("--drive-offset", 1), "Give its --drive-amplitude and --drive-rate, too"),
    "several files": (("b.csv", "--drive-file", "c.csv"), "one FILE only"),
    "a drive made and cleaned": (
        ("--drive-rate", 10, "--drive-amplitude", 1, "--drive-as", "fitted"),
        "Give one of the two",
    ),
    "two beginnings": (("--skip-periods", 1, "--skip-seconds", 1), "Give one of them"),
    "a rate of no sense": (("--sample-rate", 0), "--sample-rate"),
    "one dash before a word": (("-out", "r2"), "Write `-o FOLDER`, or `--output FOLDER`"),
}  # fmt: skip


@pytest.mark.parametrize("name", USAGE)
def test_usage(rapi, tmp_path, name):
    arguments, words = USAGE[name]
    code, out, err = rapi("import", "a.csv", "-o", tmp_path / "r", *arguments)
    assert (code, out) == (2, "")
    assert_one_line(err, "usage:", words)


def fringes(folder: Path) -> Path:
    """Two periods at 40 Hz: drive, and the fringes of 8 GHz at a delay of 24.5 ns."""
    t = np.arange(10_000) / 200e3
    along = 2 * np.mod(40.0 * t, 1.0)
    folded = np.where(along < 1, along, 2 - along)
    light = np.cos(2 * np.pi * 24.5 * 8.0 * (folded + 0.1 * folded**2) + 0.7)
    text = MAKERS["Tektronix"][0](t, 1.0 + 4.0 * folded, light)
    return put(folder / "fringes.csv", text)


def test_fringes_become_optical_frequency(rapi, tmp_path):
    read = ("--drive", "CH1", "--fringes", "CH2")
    path, data = fringes(tmp_path), tmp_path / "r"
    code, out, err = rapi("import", path, "-o", data, *read, "--interferometer", "40.816 MHz")
    assert (code, err) == (0, "")
    for word in ("optical frequency from fringes: 8.8 GHz", "a zero of its own"):
        assert word in out
    recording = read_recording(data)
    assert (recording.response_unit, recording.response_origin) == ("GHz", "run")
    assert recording.runs[0].span == pytest.approx(8.8, rel=1e-3)
    code, _, err = rapi("import", path, *read)
    assert code == 3 and '"40.8 MHz" (free spectral range)' in err
    for extra in (("--response", "CH2"), ("--response-scale", "4.5"), ("--response-unit", "um")):
        code, _, err = rapi("import", path, *read, "--interferometer", "1 m", *extra)
        assert code == 2 and "the response is the optical frequency" in err
    code, _, err = rapi("import", path, "--drive", "CH1", "--response", "CH2", "--cavity", "CH3")
    assert code == 2 and "used only with fringes" in err


def test_several_rates_after_one_option_are_told_apart_from_files(rapi, tmp_path):
    path = scope(tmp_path)
    code, out, err = rapi("import", path, *SCOPE, "--rate", 10, 20, 40)
    assert (code, out) == (2, "") and "--rate 10 --rate 20 --rate 40" in err
    several = ("--rate", 10, "--rate", 20, "--rate", 40)
    assert rapi("import", path, *SCOPE, *several)[0] == 0
