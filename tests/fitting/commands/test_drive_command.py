"""`rapi drive`: the first drives for a laser, within limits or not at all."""

import json

import numpy as np
import pytest
from benches import bench_file
from command_output import assert_one_line

from rapi_jax.io import read_afg, read_drive

LIMITS = "low_v = 0.0\nhigh_v = 70.0\nslew_v_per_s = 5000.0\nmax_frequency_hz = 50.0\n"
LEVELS = ("--low", 10, "--high", 60)


def limits(folder, text: str = LIMITS):
    (folder / "limits.toml").write_text(text)
    return folder / "limits.toml"


def test_a_triangle_as_it_was_asked_for(rapi, tmp_path):
    out = tmp_path / "t"
    code, said, err = rapi(
        "drive", "--rate", 10, 20, *LEVELS, "--samples", 4000, "-o", out,
        "--limits", limits(tmp_path),
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert "triangle at 20 Hz: 10 to 60 V, 4000 samples a period, 2000 V/s at most" in said
    assert "All drives are within the limits." in said
    names = sorted(path.name for path in out.iterdir())
    assert names == [
        "drive_10Hz.afg", "drive_10Hz.csv", "drive_20Hz.afg", "drive_20Hz.csv", "drives.json",
    ]  # fmt: skip
    drive = read_drive(out / "drive_20Hz.csv")
    t = np.arange(4000) / 4000
    np.testing.assert_allclose(drive.value, np.interp(t, [0, 0.5, 1], [10, 60, 10]), atol=1e-12)
    np.testing.assert_allclose(drive.time, t / 20.0, rtol=1e-12)
    wave = read_afg(out / "drive_20Hz.afg")
    assert (wave.low_v, wave.high_v, wave.frequency_hz) == (10.0, 60.0, 20.0)
    table = json.loads((out / "drives.json").read_text())
    assert table["schema"] == "rapi.drives/1" and set(table["files"]) == {*names} - {"drives.json"}


def test_a_sine_without_limits_says_that_none_were_checked(rapi, tmp_path):
    code, said, _ = rapi("drive", "--frequency", 20, *LEVELS, "--waveform", "sine", "-o",
                         tmp_path / "s")  # fmt: skip
    assert code == 0 and "No limits were given, so none were checked" in said
    value = read_drive(tmp_path / "s" / "drive_20Hz.csv", waveform="sine").value
    np.testing.assert_allclose(value, 35 - 25 * np.cos(2 * np.pi * np.arange(4000) / 4000), 1e-12)
    code, said, _ = rapi("drive", "--rate", 30, *LEVELS, "-o", tmp_path / "j", "--json")
    assert json.loads(said)["drives"][0]["slew_max"] == pytest.approx(3000.0)


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (("--rate", 20, "--low", -1, "--high", 60), 3, ("at 20 Hz", "beyond `low_v` = 0 V")),
        (("--rate", 20, "--low", 10, "--high", 71), 3, ("at 20 Hz", "beyond `high_v` = 70 V")),
        (("--rate", 20, 60, *LEVELS), 3, ("at 60 Hz", "`max_frequency_hz` is 50 Hz")),
        (("--rate", 20, 50, "--low", 0, "--high", 60), 3, ("at 50 Hz", "`slew_v_per_s`")),
        (("--rate", 20, "--low", 60, "--high", 10), 2, ("--low must lie below --high",)),
        (("--rate", -5, *LEVELS), 3, ("positive rates in Hz",)),
        (("--rate", 20, 20, *LEVELS), 3, ("Give each rate once",)),
    ],
)
def test_what_is_not_allowed_is_refused_whole(rapi, tmp_path, options, code, words):
    place = tmp_path / "out"
    found, out, err = rapi("drive", *options, "-o", place, "--limits", limits(tmp_path))
    assert (found, out) == (code, "") and not place.exists()
    assert_one_line(err, *words)


def test_limits_in_another_unit_are_refused(rapi, tmp_path):
    path = limits(tmp_path, "low_um = 0.0\nhigh_um = 70.0\nslew_um_per_s = 5000.0\n")
    code, _, err = rapi("drive", "--rate", 20, *LEVELS, "-o", tmp_path / "o", "--limits", path)
    assert code == 3 and "these limits are in um, and the drive is in V" in err


def test_it_writes_over_its_own_drives_and_over_no_others(rapi, tmp_path):
    line = ("drive", *LEVELS, "-o", tmp_path / "o", "--rate")
    assert rapi(*line, 20)[0] == 0
    assert rapi(*line, 20)[0] == 0
    (tmp_path / "o" / "drive_30Hz.csv").write_text("time_s,drive\n")
    code, _, err = rapi(*line, 20)
    assert code != 0 and "drive_30Hz.csv, which no drives.json there lists" in err


def test_what_it_writes_a_bench_takes(rapi, tmp_path):
    """A dry run of a simulated bench reads the drive and holds it against its limits."""
    pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")
    assert rapi("drive", "--rate", 20, "--low", 1, "--high", 5, "-o", tmp_path / "t")[0] == 0
    drive, sent = tmp_path / "t" / "drive_20Hz.csv", tmp_path / "sent"
    code, _, err = rapi("measure", bench_file(tmp_path), drive, "-o", sent, "--dry-run")
    assert (code, err) == (0, "")
    assert [path for path in sent.iterdir() if path.suffix == ".bytes"]
