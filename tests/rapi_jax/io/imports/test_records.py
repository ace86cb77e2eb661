"""Long records cut into runs; clocks with gaps, jitter and few digits; averages; made drives."""

from dataclasses import replace

import numpy as np
import pytest
from scope_files import VOLT_TO_GHZ, said, scanned, taken

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, MadeDrive, import_recording, write_import


def test_four_rates_and_a_second_swing_after_a_rest(tmp_path):
    parts = [(10.0, 3, 4.5), (20.0, 4, 4.5), (40.0, 5, 4.5), (20.0, 4, 2.0)]
    t, u, y = scanned(*parts)
    rest = 3000
    u, y = np.r_[np.full(rest, 3.0), u], np.r_[np.full(rest, 15.0), y]
    made = taken(tmp_path, np.arange(u.size) / 20e3, u, y)
    runs = made.recording.runs
    assert [run.drive.excitation_hz for run in runs] == [10.0, 20.0, 40.0, 20.0]
    assert [run.drive.periods for run in runs] == [3, 4, 5, 4]
    np.testing.assert_allclose([run.drive.u_pp for run in runs], [4.5, 4.5, 4.5, 2.0], rtol=0.04)
    begin = np.cumsum([rest / 20e3, *(n / hz for hz, n, _ in parts[:-1])])
    np.testing.assert_allclose([run.drive.start_s for run in runs], begin, atol=2e-3)
    assert "dropped" in said(made) and "in which the drive rests" in said(made)


def test_a_rest_before_the_scan_is_said_to_be_one(tmp_path):
    """And a drive that moves without a period is not."""
    t, u, y = scanned((10.0, 3, 4.5))
    low = float(u.min())
    rest = taken(tmp_path, np.arange(u.size + 900) / 20e3, np.r_[np.full(900, low - 1.0), u],
                 np.r_[np.full(900, -9.0), y])  # fmt: skip
    assert "(0.045 s) in which the drive rests: 0-899" in said(rest)
    walk = np.r_[np.linspace(low - 1.0, low - 0.5, 900), u]
    moved = taken(tmp_path, np.arange(u.size + 900) / 20e3, walk, np.r_[np.full(900, -9.0), y])
    assert "belong to no whole period of one rate: 0-899" in said(moved)


def test_broken_ends_stay_for_settling(tmp_path):
    t, u, y = scanned((10.0, 4, 4.5))
    part = slice(500, 7400)
    made = taken(tmp_path, t[part], u[part], y[part])
    (run,) = made.recording.runs
    assert (run.drive.size, run.drive.periods, run.drive.excitation_hz) == (6900, 2, 10.0)
    assert "incomplete periods are kept, but not fitted: 0.75 of one before them and 0.7" in said(
        made
    )


@pytest.mark.parametrize("noise", [0.0, 5e-3])  # V
@pytest.mark.parametrize("digits", [1, 4, 12])
def test_a_rate_that_follows_from_a_turn_begins_a_run_of_its_own(tmp_path, noise, digits):
    """Both triangles leave the turn together, and differ by 3 % of the swing 15 samples later."""
    t, u, y = scanned((10.0, 4, 4.5), (30.0, 6, 4.5))
    rng = np.random.default_rng(3)
    made = taken(tmp_path, t, np.round(u + noise * rng.normal(size=u.size), digits), y)
    slow, fast = made.recording.runs
    assert (slow.drive.excitation_hz, fast.drive.excitation_hz) == (10.0, 30.0)
    step = t[1] - t[0]
    turn = round(4 / 10.0 / step)
    apart = 2 * 4.5 * (30.0 - 10.0) * step  # V a sample
    late = 2 + 1.5 * (6.0 * noise + 10.0**-digits) / apart
    assert slow.drive.size - turn <= late
    assert abs(round(fast.drive.start_s / step) - turn) <= late


def test_a_time_without_a_unit_is_told_with_the_rate_that_follows(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5))
    table = "".join(f"{1e3 * a:.4f},{b:.6f},{c:.6f}\n" for a, b, c in zip(t, u, y, strict=True))
    (tmp_path / "ms.csv").write_text("t,drive,response\n" + table)
    notes = said(import_recording(tmp_path / "ms.csv", VOLT_TO_GHZ))
    assert "assumed: the time is in s" in notes and "a drive of 0.01 Hz" in notes
    assert "--time-unit" in notes
    stated = import_recording(tmp_path / "ms.csv", replace(VOLT_TO_GHZ, time_unit="ms"))
    assert "the time is in s" not in said(stated)
    assert stated.recording.runs[0].drive.excitation_hz == 10.0


def test_swapped_columns_are_told_before_an_average_is_advised(tmp_path):
    t, u, y = scanned((10.0, 4, 4.5), (20.0, 4, 4.5), (40.0, 4, 4.5))
    u = u + 0.002 * np.random.default_rng(0).standard_normal(u.size)
    with pytest.raises(DataError) as refused:
        taken(tmp_path, t, y, u, drive_as="fitted")
    text = str(refused.value)
    assert text.index("are swapped: exchange them") < text.index("--drive-as averaged")


def test_a_file_that_is_given_twice_is_refused(tmp_path):
    for name, rate in (("a", 10.0), ("b", 40.0)):
        t, u, y = scanned((rate, 3, 4.5))
        np.savez(tmp_path / f"{name}.npz", time=t, drive=u, response=y)
    files = [tmp_path / f"{name}.npz" for name in "abb"]
    with pytest.raises(DataError, match=r"run01 \(of b.npz\) and run02 \(of b.npz\) hold the same"):
        import_recording(files, VOLT_TO_GHZ)
    assert len(import_recording(files[:2], VOLT_TO_GHZ).recording.runs) == 2
    write_import(import_recording(files[0], VOLT_TO_GHZ), tmp_path / "r")
    with pytest.raises(DataError, match="hold the same readings"):
        import_recording([tmp_path / "r", tmp_path / "r"])


@pytest.mark.parametrize(
    "names",
    ["t,drive,resp", "X,CH1,CH2,Start,Increment\nSecond,Volt,Volt,0.000000E+00,2.500000E-04"],
)
def test_commas_that_part_columns_and_mark_decimals_are_told(tmp_path, names):
    t, u, y = scanned((10.0, 3, 4.5))
    rows = [
        *(",".join(f"{x:.6e}" for x in row) for row in zip(t, u, y, strict=True)),
    ]
    table = "\n".join(rows).replace(".", ",")
    (tmp_path / "german.csv").write_text(f"{names}\n{table}")
    with pytest.raises(
        DataError, match="comma is both the separator and the decimal sign: each row"
    ):
        import_recording(tmp_path / "german.csv", VOLT_TO_GHZ)


def test_a_noisy_drive_of_eight_bits_at_an_odd_rate(tmp_path):
    t, u, y = scanned((13.37, 4, 4.5), (26.91, 6, 4.5))
    u = np.round((u + 0.01 * np.random.default_rng(1).standard_normal(u.size)) * 32) / 32
    runs = taken(tmp_path, t, u, y).recording.runs
    np.testing.assert_allclose([run.drive.rate for run in runs], [13.37, 26.91], rtol=1e-3)
    assert [run.drive.periods for run in runs] == [4, 6]


def test_cycles_of_growing_swing_are_one_run_that_does_not_repeat(tmp_path):
    t, u, y = scanned(*[(10.0, 1, swing) for swing in (1.0, 1.5, 2.0, 2.5, 3.0, 3.5)])
    made = taken(tmp_path, t, u - np.interp(t * 10, np.arange(6), np.zeros(6)), y)
    (run,) = made.recording.runs
    assert (run.drive.waveform, run.drive.excitation_hz, run.drive.size) == ("other", 10.0, t.size)
    assert "cycles that do not repeat" in said(made)


def test_a_single_sweep_and_no_cutting(tmp_path):
    t, u, y = scanned((10.0, 1, 4.5), (10.0, 4, 4.5), (20.0, 4, 4.5))
    (run,) = taken(tmp_path, t[:900], u[:900], y[:900]).recording.runs
    assert (run.drive.waveform, run.drive.excitation_hz) == ("other", None)
    (run,) = taken(tmp_path, t, u, y, cut=False).recording.runs
    assert run.drive.size == t.size and run.drive.excitation_hz == 10.0


def test_noise_of_a_drive_is_not_averaged_where_runs_of_several_sampling_rates_follow(tmp_path):
    """Runs of as many samples a period each, joined to one file: a usual export."""
    rng = np.random.default_rng(0)
    t, u, y, begin = [], [], [], 0.0
    for rate in (5.0, 10.0, 40.0):
        own, volts, reading = scanned((rate, 4, 4.5), sample_hz=2000.0 * rate, noise=0.0)
        t.append(begin + own)
        begin += own[-1] + own[1] - own[0]
        u.append(volts + 2e-3 * rng.standard_normal(own.size))
        y.append(reading + 0.025 * rng.standard_normal(own.size))
    made = taken(tmp_path, *map(np.concatenate, (t, u, y)))
    runs = made.recording.runs
    assert [run.drive.excitation_hz for run in runs] == [5.0, 10.0, 40.0]
    assert [run.drive.periods for run in runs] == [4, 4, 4]
    assert [round(1.0 / run.drive.step_s) for run in runs] == [10_000, 20_000, 80_000]
    for run, volts, reading in zip(runs, u, y, strict=True):
        np.testing.assert_array_equal(run.drive.value, volts)
        np.testing.assert_array_equal(run.response, reading)


def test_an_average_of_samples_is_said_and_keeps_no_folded_tone(tmp_path):
    t, u, y = scanned((10.0, 4, 4.5), noise=0.0)
    tone = np.sin(2 * np.pi * 2000.0 * t)  # every tenth sample would see it at rest
    made = taken(tmp_path, t, u, y + tone, decimate=10)
    run = made.recording.runs[0]
    assert run.drive.size == 800 and "the average of 10" in said(made)
    np.testing.assert_allclose(run.response, y.reshape(-1, 10).mean(axis=1), atol=1e-9)
    np.testing.assert_allclose(run.drive.value, u.reshape(-1, 10).mean(axis=1), atol=1e-9)
    np.testing.assert_allclose(run.drive.start_s, 4.5 * 5e-5)


def test_too_many_samples_are_averaged_without_being_asked(tmp_path):
    t, u, y = scanned((10.0, 4, 4.5), (20.0, 4, 4.5))
    made = taken(tmp_path, t, u, y, max_samples=6100)
    assert [round(run.drive.step_s / 5e-5) for run in made.recording.runs] == [2, 2]
    assert "decimated (more than 6100)" in said(made)
    assert "decimated" not in said(taken(tmp_path, t, u, y))


def test_flat_parts_are_listed(tmp_path):
    t, u, y = scanned((10.0, 4, 4.5))
    top = float(np.quantile(y, 0.9))
    made = taken(tmp_path, t, u, np.minimum(y, top))
    assert "the response is flat at its extreme for up to" in said(made)
    digitised = np.round(y * 5) / 5
    assert "flat" not in said(taken(tmp_path, t, np.round(u * 40) / 40, digitised))
    sine = 3.0 - 2.0 * np.cos(2 * np.pi * 10.0 * t)
    assert "flat" not in said(taken(tmp_path, t, np.round(sine * 32) / 32, y))


def test_a_drive_that_was_not_recorded(tmp_path):
    t, u, y = scanned((10.0, 4, 4.5))
    made = taken(tmp_path, t, u, y, made=MadeDrive(4.5, 10.0, offset=3.0))
    (run,) = made.recording.runs
    np.testing.assert_allclose(run.drive.value, u, atol=1e-9)
    assert "no drive was recorded; assumed is a triangle at 10 Hz" in said(made)
    with pytest.raises(DataError, match="does not repeat at 13 Hz .* Correct --drive-rate"):
        taken(tmp_path, t, u, y, made=MadeDrive(4.5, 13.0, offset=3.0))


def test_sampling_rate_stated_rates_and_several_files(tmp_path):
    t, u, y = scanned((10.0, 4, 4.5))
    for k, name in enumerate("ab"):
        np.savez(tmp_path / f"{name}.npz", drive=u, response=y + 0.01 * k)
    options = replace(VOLT_TO_GHZ, sample_rate=20e3, rates=(10.0, 40.0))
    made = import_recording([tmp_path / "a.npz", tmp_path / "b.npz"], options)
    assert [run.name for run in made.recording.runs] == ["run00", "run01"]
    np.testing.assert_allclose(made.recording.runs[1].drive.start_s, 0.4, rtol=1e-3)
    assert "assumed: the files follow each other without a pause" in said(made)
    assert "share one zero of the response; of measurements with" in said(made)
    apart = replace(options, response_origin="run")
    again = import_recording([tmp_path / "a.npz", tmp_path / "b.npz"], apart)
    assert "without a pause" in said(again) and "share one zero" not in said(again)
    options = replace(VOLT_TO_GHZ, sample_rate=40e3, rates=(10.0,))
    with pytest.raises(DataError, match="repeats at 20 Hz, not at 10 Hz as said. Correct --rate"):
        import_recording(tmp_path / "a.npz", options)


def test_time_stamps_and_temperature(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=1000.0)
    lines = [
        f"2026-11-24T10:00:{s:09.6f}+01:00;{a};{b};21.5".replace(".", ",", 1)
        for s, a, b in zip(t.tolist(), u.tolist(), y.tolist(), strict=True)
    ]
    text = "when;drive;response;lab\n" + "\n".join(lines).replace(",", ".")
    (tmp_path / "a.csv").write_text(text)
    made = import_recording(tmp_path / "a.csv", replace(VOLT_TO_GHZ, temperature_c="lab"))
    assert made.recording.temperature_c == 21.5
    assert made.recording.recorded_at is not None and made.recording.recorded_at.hour == 9
    np.testing.assert_allclose(made.recording.runs[0].drive.step_s, 1e-3, rtol=1e-6)


def test_output_is_replaced_only_where_it_is_its_own(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=2000.0)
    made = taken(tmp_path, t, u, y)
    for name in ("r", "r.nc"):
        paths = write_import(made, tmp_path / name, picture=b"\x89PNG\r\n\x1a\n")
        assert len(paths) == 2 and all(path.exists() for path in paths)
        write_import(made, tmp_path / name, picture=b"\x89PNG\r\n\x1a\n")
    assert sorted(path.name for path in (tmp_path / "r").iterdir())[0] == "manifest.toml"
    assert len(list((tmp_path / "r").glob("*.csv"))) == 1
    manifest = tmp_path / "r" / "manifest.toml"
    manifest.write_text(manifest.read_text().replace("excitation_hz = 10.0", "excitation_hz = 9.0"))
    with pytest.raises(OSError, match="was changed after it was imported"):
        write_import(made, tmp_path / "r")
    (tmp_path / "own.preview.png").write_text("mine")
    assert len(write_import(made, tmp_path / "own.nc", picture=b"\x89PNG\r\n\x1a\n")) == 1
    assert (tmp_path / "own.preview.png").read_text() == "mine"
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    with pytest.raises(OSError, match="is there and is no recording"):
        write_import(made, tmp_path / "mine")
    assert (tmp_path / "mine" / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("begin", [0.0, 0.25, 0.5, 0.6])
@pytest.mark.parametrize("size", [401, 1500, 4007, 9998])
@pytest.mark.parametrize("short", [0, 1])
def test_a_record_of_one_period_holds_one_however_its_rate_is_rounded(tmp_path, begin, size, short):
    phase = np.arange(size) / (size - 1 + short) + begin
    u = 3.0 + 2.0 * np.abs(2.0 * np.mod(phase, 1.0) - 1.0)  # V; from its maximum at `begin` 0
    made = taken(tmp_path, np.arange(size) * 1e-3, u, 4.5 * u)
    (run,) = made.recording.runs
    assert (run.drive.waveform, run.drive.periods) == ("triangle", 1)
    assert run.drive.rate == pytest.approx(1e3 / (size - 1 + short), rel=1e-3)


def test_a_run_holds_no_sample_of_the_run_before_it(tmp_path):
    """Turns of an exact drive are known to the sample: whole periods begin there."""
    t, u, y = scanned((10.0, 3, 4.5), (20.0, 3, 4.5), (40.0, 3, 4.5), sample_hz=8000.0, noise=0.0)
    np.savez(tmp_path / "a.npz", time=t, drive=u, response=y)
    made = import_recording(tmp_path / "a.npz", ImportOptions(drive_unit="V", response_unit="GHz"))
    for run, first in zip(made.recording.runs, (0, 2400, 3600), strict=True):
        inside = np.flatnonzero(run.drive.period >= 0)
        whole = slice(first, first + round(3 * 8000.0 / run.drive.rate))
        np.testing.assert_array_equal(run.response[inside], y[whole])


def test_an_option_that_contradicts_the_files_unit_is_told_and_stays_in_force(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5))
    np.savez(tmp_path / "a.npz", **{"time [ms]": 1e3 * t, "drive [V]": u, "response [GHz]": y})

    def notes(**more):
        return import_recording(tmp_path / "a.npz", ImportOptions(**more))

    assert "the file says" not in said(notes())
    assert "the file says" not in said(notes(response_unit="GHz", time_unit="ms", drive_unit="V"))
    assert "the file says" not in said(notes(response_unit="MHz", response_scale=1e3))
    made = notes(response_unit="MHz", time_unit="s")
    assert "the file says GHz for the response" in said(made)
    assert "--response-unit says MHz, which is used" in said(made)
    assert "the file says ms for the time" in said(made)
    assert made.recording.runs[0].drive.excitation_hz == 0.01
    np.testing.assert_allclose(made.recording.runs[0].response, 1e-3 * y)


def test_a_temperature_in_degrees_is_no_charge_in_coulombs(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5))
    np.savez(tmp_path / "a.npz", **{"time": t, "drive [V]": u, "Temp [C]": y, "charge [C]": y})
    with pytest.raises(DataError, match=r"'Temp \[C\]' is named like a temperature"):
        import_recording(tmp_path / "a.npz", ImportOptions(response="Temp"))
    for options in (
        ImportOptions(response="charge"),
        ImportOptions(response="Temp", response_unit="C"),
    ):
        assert import_recording(tmp_path / "a.npz", options).recording.response_unit == "uC"
