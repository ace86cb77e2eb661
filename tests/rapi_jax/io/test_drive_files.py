"""Drive, generator and limits files: what is written is read again, what is wrong is refused."""

import re

import numpy as np
import pytest

from rapi_jax import DataError, Drive, DriveLimits, LimitError, compensate, linear_scan
from rapi_jax.examples import paper_device
from rapi_jax.io import read_afg, read_drive, read_limits, write_afg, write_drive
from rapi_jax.io.drives._afg_waveform import FULL, AfgWaveform


@pytest.fixture(scope="module")
def drive():
    (target,) = linear_scan(40.0, span=75.0, samples=2048)
    return compensate(paper_device(), target, limits=DriveLimits(0.0, 7.5, 2e3), bias=3.0).drive


def test_a_drive_comes_back_to_the_bit(drive, tmp_path):
    write_drive(drive, tmp_path / "drive.csv")
    text = (tmp_path / "drive.csv").read_text()
    assert text.startswith("time_s,drive\n0.0,")
    got = read_drive(tmp_path / "drive.csv")
    assert (got.value == drive.value).all() and (got.time == drive.time).all()
    assert got.rate == pytest.approx(40.0, rel=1e-12) and got.repeats


@pytest.mark.fault(name="a drive file that is none", promise="refused in one line")
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1 must be time_s,drive"),
        ("time,volt\n0,1\n", "line 1 must be time_s,drive"),
        ("time_s,drive\n" + "".join(f"{i},x\n" for i in range(9)), "line 2 must hold 2 finite"),
        ("time_s,drive\n" + "".join(f"{i},1\n" for i in range(9)) + "9\n", "line 11"),
        ("time_s,drive\n" + "".join(f"{i},{'nan' if i == 4 else 1}\n" for i in range(9)), "line 6"),
        ("time_s,drive\n0,1\n1,2\n2,1\n", "8 samples or more"),
        ("time_s,drive\n" + "".join(f"{i // 2},1\n" for i in range(9)), "repeats at sample 1"),
        ("time_s,drive\n", "holds no samples"),
    ],
)
def test_what_is_no_drive_is_refused_in_one_line(text, message, tmp_path):
    (tmp_path / "drive.csv").write_text(text)
    with pytest.raises(DataError, match=message) as caught:
        read_drive(tmp_path / "drive.csv")
    assert "\n" not in str(caught.value) and "drive.csv" in str(caught.value)


def test_generator_codes_stand_for_the_drive(drive, tmp_path):
    wave = AfgWaveform.of(drive)
    assert wave.codes.size == 131072 and wave.codes.max() <= FULL
    assert wave.low_v <= drive.value.min() < wave.low_v + 1e-4 + 1e-12
    assert wave.high_v - 1e-4 - 1e-12 < drive.value.max() <= wave.high_v
    step = (wave.high_v - wave.low_v) / FULL
    at = (np.arange(131072) + 0.5) / (131072 * drive.rate)
    want = np.interp(at, drive.time, drive.value, period=1 / drive.rate)
    assert np.abs(wave.volts - want).max() <= step / 2 * (1 + 1e-9)
    write_afg(wave, tmp_path / "drive.afg")
    got = read_afg(tmp_path / "drive.afg")
    assert (got.codes == wave.codes).all()
    assert (got.low_v, got.high_v, got.frequency_hz) == (wave.low_v, wave.high_v, 40.0)


def test_generator_codes_of_two_periods_are_those_of_one(drive):
    twice = Drive(
        np.arange(2 * drive.size) * drive.step_s, np.tile(drive.value, 2), 40.0, "triangle"
    )
    assert (AfgWaveform.of(twice).codes == AfgWaveform.of(drive).codes).all()


def test_a_drive_without_a_period_has_no_codes(drive):
    with pytest.raises(DataError, match="repeats"):
        AfgWaveform.of(Drive(drive.time, drive.value, None))


@pytest.mark.fault(name="a generator file that is damaged", promise="refused in one line")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t[: len(t) // 2], "cut short"),
        (lambda t: t[: t.rstrip().rindex("\n") + 1], "holds 99 codes"),
        (lambda t: t.replace("rapi.afg/1", "rapi.afg/9"), "line 1 must be"),
        (lambda t: t.replace("low_v", "lowv"), "header must give"),
        (lambda t: t + "1\n", "cut short|whole"),
        (lambda t: t.replace("\ncode\n", "\ncode\n0.5\n", 1), "holds|whole"),
        (lambda t: t.replace("\ncode\n", "\ncode\nx\n", 1), "must hold 1 finite"),
        (lambda t: t.replace("low_v = ", "low_v = 9"), "must lie below"),
        (
            lambda t: re.sub("\ncode\n[0-9]+\n", "\ncode\n16383\n", t),
            "whole numbers from 0 to 16382",
        ),
        (lambda t: re.sub("\ncode\n[0-9]+\n", "\ncode\n1e300\n", t), "whole numbers from 0 to"),
        (lambda t: re.sub("\ncode\n[0-9]+\n", "\ncode\n-1\n", t), "whole numbers from 0 to"),
        (lambda t: re.sub("\ncode\n[0-9]+\n", "\ncode\n7.5\n", t), "whole numbers from 0 to"),
    ],
)
def test_a_damaged_generator_file_is_refused(drive, tmp_path, change, message):
    path = tmp_path / "drive.afg"
    write_afg(AfgWaveform.of(drive, 100), path)
    path.write_text(change(path.read_text()))
    with pytest.raises(DataError, match=message):
        read_afg(path)


@pytest.mark.parametrize("low, high", [(0.0, 5.0), (0.00004, 4.99996), (0.0001, 4.99990001)])
def test_levels_never_exceed_the_limits(low, high):
    """They are set in steps of 0.1 mV: a drive between the last step and the limit is refused."""
    limits = DriveLimits(low, high, 1e6)
    edge, turn = 0.0, np.abs(np.arange(64) / 32 - 1)  # from 1 down to 0 and up
    for margin in (0.0002, edge):
        value = high - margin - turn * (high - low - 2 * margin)
        one = Drive(np.arange(64) / 640, value, 10.0, "triangle")
        on_steps = np.allclose(np.array([low, high]) * 1e4 % 1, 0, atol=1e-9)
        if margin == edge and not on_steps:
            with pytest.raises(LimitError, match=r"steps of 0\.1 mV"):
                AfgWaveform.of(one, 64, limits=limits)
            continue
        wave = AfgWaveform.of(one, 64, limits=limits)
        assert low - 1e-12 <= wave.low_v and wave.high_v <= high + 1e-12
        assert wave.volts.min() >= low - 1e-12 and wave.volts.max() <= high + 1e-12


def test_limits_are_read(tmp_path):
    path = tmp_path / "limits.toml"
    path.write_text("low_v = 0.0\nhigh_v = 6.5\nslew_v_per_s = 900.0\n")
    assert read_limits(path) == DriveLimits(0.0, 6.5, 900.0)
    bench = tmp_path / "bench.toml"
    bench.write_text(f'schema = "rapi.bench/1"\n[limits]\n{path.read_text()}')
    assert read_limits(bench) == read_limits(path)
    path.write_text("low_um = 0.0\nhigh_um = 90.0\nslew_um_per_s = 900.0\nstep_um = 1.0\n")
    assert read_limits(path) == DriveLimits(0.0, 90.0, 900.0, 1.0, unit="um")
    path.write_text("low_v = 0.0\nhigh_v = 6.5\nslew_v_per_s = 900.0\n")
    path.write_text(path.read_text() + "step_v = 0.1\nmax_frequency_hz = 50.0\n")
    assert read_limits(path) == DriveLimits(0.0, 6.5, 900.0, 0.1, 50.0)


@pytest.mark.fault(name="a limits file that is wrong", promise="refused in one line")
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("low_v = 0.0\nhigh_v = 6.5\n", "slew_v_per_s"),
        ("low_v = 0.0\nhigh_v = 6.5\nslew_v_per_s = 900.0\nhigh = 3.0\n", "`high`"),
        ("low_v = 0.0\nhigh_v = nan\nslew_v_per_s = 900.0\n", "high_v"),
        ("low_v = 7.0\nhigh_v = 6.5\nslew_v_per_s = 900.0\n", "must lie below"),
        ('low_v = "0"\nhigh_v = 6.5\nslew_v_per_s = 900.0\n', "low_v"),
        ("low_v = \n", "not valid TOML"),
        ("low_um = 0.0\nhigh_um = 6.5\nslew_v_per_s = 900.0\n", "in V, but other limits"),
        ("low_v = 0.0\nhigh_v = 6.5\nslew_v_per_s = inf\n", "slew_v_per_s"),
        ("low_v = 0.0\nhigh_v = 6.5\nslew_v_per_s = 9.0\nstep_v = nan\n", "step_v"),
        ("low_v = true\nhigh_v = 6.5\nslew_v_per_s = 900.0\n", "low_v"),
    ],
)
def test_limits_that_are_wrong_are_refused(text, message, tmp_path):
    (tmp_path / "limits.toml").write_text(text)
    with pytest.raises(DataError, match=message) as caught:
        read_limits(tmp_path / "limits.toml")
    assert "\n" not in str(caught.value)


@pytest.mark.fault(name="a drive cut within its last number", promise="refused")
def test_a_drive_cut_within_its_last_number_is_refused(tmp_path):
    rows = [f"{k / 640},{3.0 + 0.125 * (k % 32)}" for k in range(64)]
    path = tmp_path / "drive.csv"
    path.write_text("time_s,drive\n" + "\n".join(rows) + "\n")
    read_drive(path)
    path.write_text(path.read_text()[:-5])
    with pytest.raises(DataError, match="breaks off"):
        read_drive(path)
