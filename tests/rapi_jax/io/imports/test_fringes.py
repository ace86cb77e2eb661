"""Fringes of an interferometer and a cavity from an oscilloscope, against NumPy's cosine alone."""

import re

import numpy as np
import pytest
from scope_files import MAKERS, put

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, import_recording, read_recording, write_import

LIGHT = 299_792_458.0  # m/s
FSR = 0.9  # GHz
RATE = 200e3  # samples a second
DELAY = 24.5e-9  # s
LAG = 1e-4  # s
COLUMNS = ImportOptions(drive="CH1", fringes="CH2", interferometer="24.5 ns")


def branch(along):
    """From 0 to 1, steeper at its end."""
    return along + 0.15 * along * (along - 1.0)


def scan(periods, span=8.0):
    """Optical frequency (GHz) of a laser with hysteresis, after so many periods."""
    along = np.mod(periods, 1.0) * 2
    return span * np.where(along < 1, branch(along), 1.0 - branch(along - 1.0))


def triangle(periods):
    along = np.mod(periods, 1.0)
    return 1.0 + 4.0 * np.where(along < 0.5, 2 * along, 2 - 2 * along)


def bits(x, low, high, of=8):
    """What a digitizer of so many bits makes of a voltage."""
    step = (high - low) / 2**of
    return low + step * np.clip(np.round((x - low) / step), 0, 2**of - 1)


def recorded(*rates, periods=3, seed=0, delay=DELAY):
    """Time, drive, fringes, cavity and true frequency (GHz), one rate after the other."""
    rng = np.random.default_rng(seed)
    ends = np.concatenate([[0.0], np.cumsum([periods / hz for hz in rates])])
    t = np.arange(round(ends[-1] * RATE)) / RATE
    passed = periods * np.arange(ends.size)
    drive = triangle(np.interp(t, ends, passed))
    before = np.r_[-1.0 / rates[0], ends], np.r_[-1, passed]  # it scans before it is recorded
    ghz = scan(np.interp(t - LAG, *before))
    light = 0.2 + 0.8 * np.cos(2 * np.pi * ghz * 1e9 * delay + 0.7)
    peaks = 1.0 / (1.0 + 2e3 * np.sin(np.pi * (ghz + 0.31) / FSR) ** 2)
    noise = 0.01 * rng.standard_normal((3, t.size))
    return (
        t,
        bits(drive + noise[0], -1.0, 7.0),
        bits(light + noise[1], -1.0, 1.6),
        bits(peaks + noise[2], -0.1, 1.4),
        ghz,
    )


def put_table(path, t, **columns):
    head = "TIME (s)," + ",".join(f"{name} (V)" for name in columns)
    table = np.column_stack([t, *columns.values()])
    np.savetxt(path, table, fmt="%.9g", delimiter=",", header=head, comments="")
    return path


def difference(run, t, ghz):
    """Reading less truth, GHz, but beyond a turn at the very edge of the run, which is said."""
    at = run.drive.start_s + run.drive.time
    error = run.response - np.interp(at, t, ghz)
    inside = (run.drive.time > 1.2 * LAG) & (run.drive.time < run.drive.time[-1] - 4 * LAG)
    return error[inside] - error[inside].mean()


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    t, u, light, peaks, ghz = recorded(20.0, 40.0)
    path = tmp_path_factory.mktemp("scope") / "scope.csv"
    return put_table(path, t, CH1=u, CH2=light, CH3=peaks), t, ghz


def test_interferometer_alone(table):
    path, t, ghz = table
    made = import_recording(path, COLUMNS)
    runs = made.recording.runs
    assert [run.drive.excitation_hz for run in runs] == pytest.approx([20.0, 40.0], rel=1e-3)
    assert [run.drive.periods for run in runs] == [3, 3]
    assert made.recording.response_unit == "GHz"
    assert made.recording.response_origin == "run"
    for run in runs:
        assert np.sqrt(np.mean(difference(run, t, ghz) ** 2)) < 2e-4
    text = "\n".join(made.notes)
    for word in ("as given", "zero of its own", "rises with the drive", "fringes: CH2"):
        assert word in text + str(made.recording.provenance)
    assert "clipped" not in text


def test_what_the_response_was_read_from_is_kept_when_recordings_are_joined(table, tmp_path):
    path, *_ = table
    write_import(import_recording(path, COLUMNS), tmp_path / "a")
    assert read_recording(tmp_path / "a").provenance["response_from"] == "fringes"
    again = import_recording([tmp_path / "a"]).recording
    assert again.provenance["response_from"] == "fringes"
    plain = import_recording(path, ImportOptions(drive="CH1", response="CH2")).recording
    assert "response_from" not in plain.provenance


def test_a_cavity_corrects_the_scale(table):
    path, t, ghz = table
    wrong = ImportOptions(
        drive="CH1", fringes="CH2", interferometer="24.0 ns", cavity="CH3", cavity_spacing="0.9 GHz"
    )
    made = import_recording(path, wrong)
    for run in made.recording.runs:
        assert np.sqrt(np.mean(difference(run, t, ghz) ** 2)) < 2e-4
    assert "peaks of the cavity calibrate" in "\n".join(made.notes)


@pytest.mark.parametrize("said", ["24.5ns", f"{DELAY * LIGHT:.9g} m", f"{1e-6 / DELAY:.9g} MHz"])
def test_delay_path_and_spacing_say_the_same(said):
    from rapi_jax.io.imports.fringes._optics import interferometer_delay_s

    assert interferometer_delay_s(said) == pytest.approx(DELAY, rel=1e-8)


def test_a_frequency_that_falls_with_the_drive(tmp_path):
    t, u, light, _, ghz = recorded(40.0)
    path = put_table(tmp_path / "scope.csv", t, CH1=u, CH2=light)
    falling = ImportOptions(
        drive="CH1", fringes="CH2", interferometer="24.5 ns", response_scale=-1.0
    )
    made = import_recording(path, falling)
    assert np.sqrt(np.mean(difference(made.recording.runs[0], t, -ghz) ** 2)) < 2e-4
    assert "falls with the drive" in "\n".join(made.notes)


def test_a_maker_s_file_with_the_fringes_apart_from_the_drive(tmp_path):
    t, u, light, _, ghz = recorded(40.0)
    path = put(tmp_path / "light.csv", MAKERS["Keysight"][0](t, light, light))
    drive = put_table(tmp_path / "drive.csv", t[::10], CH1=u[::10])
    apart = ImportOptions(
        drive_file=str(drive), drive="CH1", fringes="1", interferometer="24.5 ns", drive_unit="V"
    )
    made = import_recording(path, apart)
    (run,) = made.recording.runs
    assert run.drive.size > 14_000
    assert np.sqrt(np.mean(difference(run, t, ghz) ** 2)) < 2e-4
    assert "the drive is taken at the times of the fringes" in "\n".join(made.notes)


def refused(path, **options):
    with pytest.raises(DataError) as caught:
        import_recording(path, ImportOptions(drive="CH1", fringes="CH2", **options))
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_what_is_missing_is_asked_for(table):
    path, *_ = table
    text = refused(path, cavity="CH3")
    assert "--interferometer" in text and "40.8 MHz" in text
    assert "--cavity-spacing" in text
    assert "CH9" in refused(path, interferometer="24.5 ns", cavity="CH9", cavity_spacing="1 GHz")
    assert "with its unit" in refused(path, interferometer="24.5")
    assert "Did you mean MHz" in refused(path, interferometer="40.8 Mhz")
    assert "Check its unit" in refused(path, interferometer="24.5 s")


def test_fringes_that_are_none_or_broken(tmp_path):
    t, u, light, _, _ = recorded(40.0, periods=2)
    broken = light.copy()
    broken[500] = np.nan
    path = put_table(tmp_path / "a.csv", t, CH1=u, CH2=broken)
    assert "sample 500" in refused(path, interferometer="24.5 ns")
    dark = np.random.default_rng(0).standard_normal(t.size)
    path = put_table(tmp_path / "b.csv", t, CH1=u, CH2=dark)
    assert "its light reach the detector" in refused(path, interferometer="24.5 ns")


@pytest.mark.parametrize("first, last", [(0.031, 0.034), (0.0255, 0.03)])
def test_a_stretch_without_fringes_is_named(tmp_path, first, last):
    t, u, light, _, _ = recorded(40.0)
    gone = (t > first) & (t < last)  # of a branch of 12.5 ms, in its middle and from its start
    noise = 0.01 * np.random.default_rng(1).standard_normal(t.size)
    path = put_table(tmp_path / "scope.csv", t, CH1=u, CH2=np.where(gone, 0.2 + noise, light))
    text = refused(path, interferometer="24.5 ns")
    said = re.search(r"no fringes pass from (\S+) to (\S+) s", text)
    assert said and "light blocked" in text
    within = 4 * 2.5e-4  # s, two blocks of four fringes
    assert float(said[1]) == pytest.approx(first, abs=within)
    assert float(said[2]) == pytest.approx(last, abs=within)


def test_few_samples_a_fringe_are_said(tmp_path):
    t, u, light, _, _ = recorded(40.0, periods=2, delay=80e-9)
    path = put_table(tmp_path / "scope.csv", t, CH1=u, CH2=light)
    made = import_recording(path, ImportOptions(drive="CH1", fringes="CH2", interferometer="80 ns"))
    assert "samples each" in "\n".join(made.notes)


def test_a_response_and_fringes_are_not_both_given():
    with pytest.raises(ValueError, match="not both"):
        ImportOptions(response="CH2", fringes="CH3", interferometer="1 m")
    with pytest.raises(ValueError, match="1 or -1"):
        ImportOptions(fringes="CH3", interferometer="1 m", response_scale=4.5)
    with pytest.raises(ValueError, match="go with"):
        ImportOptions(response="CH2", cavity="CH3")
