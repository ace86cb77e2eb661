"""Drives put in place of their readings, beside the waveform that was sent."""

import numpy as np
import pytest

from rapi_jax import DataError, Drive, Run, triangle
from rapi_jax.io.imports.cleaning._clean import clean_drives
from rapi_jax.io.imports.cleaning._waveform_fit import fit_waveform
from rapi_jax.recording._drive import Waveform

RATE, SAMPLE_HZ, SWING, BIAS = 20.0, 20e3, 4.5, 3.0


def wave(waveform: str, cycles: np.ndarray, rise: float = 0.5) -> np.ndarray:
    """What a generator puts out, V; written apart from the code under test."""
    if waveform == "sine":
        return BIAS - SWING / 2.0 * np.cos(2.0 * np.pi * cycles)
    corners = ([0.0, rise, 1.0], [BIAS - SWING / 2, BIAS + SWING / 2, BIAS - SWING / 2])
    return np.interp(cycles % 1.0, *corners)


def read(sent: np.ndarray, bits: int, seed: int = 0, noise: float = 2e-3) -> np.ndarray:
    """The same as a scope of `bits` over 10 V reads it, with noise in V."""
    volts = sent + noise * np.random.default_rng(seed).standard_normal(sent.size)
    step = 10.0 / 2**bits
    return np.round(volts / step) * step


def run_of(
    value: np.ndarray, waveform: Waveform = "triangle", rate: float = RATE, name: str = "run00"
) -> Run:
    drive = Drive(np.arange(value.size) / SAMPLE_HZ, value, rate, waveform)
    return Run(drive, 16.0 * value, name)


@pytest.mark.parametrize("bits", [8, 10, 12])
@pytest.mark.parametrize(
    ("waveform", "rise"), [("triangle", 0.5), ("triangle", 0.8), ("sine", 0.5)]
)
@pytest.mark.parametrize("begin", [0.0, 0.137])
def test_a_fitted_waveform_is_the_one_that_was_sent(bits, waveform, rise, begin):
    sent = wave(waveform, RATE * np.arange(3000) / SAMPLE_HZ + begin, rise)
    run = run_of(read(sent, bits), waveform)
    (made,), (note, errors) = clean_drives([run], "fitted", "V")
    assert errors.startswith("The standard errors of a fit do not include")
    step = 10.0 / 2**bits
    # Four quantities from 3000 readings, each off by a step over sqrt(12) and by the noise.
    most = 8.0 * np.hypot(step / np.sqrt(12.0), 2e-3) / np.sqrt(3000 / 4)
    assert np.abs(made.drive.value - sent).max() < most
    said = float(note.split(f"in place of the drive's readings is a {waveform} of ")[1].split()[0])
    assert abs(said - SWING) < 2.0 * most
    np.testing.assert_array_equal(made.response, run.response)


@pytest.mark.parametrize("seed", [6, 10, 13, 16])
def test_the_rate_of_few_periods_is_read_off_all_samples(seed):
    """Over one whole period of 2.4 harmonics look like another rate, by 5e-3 to 8e-3 for these."""
    cycles = 40.0 * np.arange(1200) / SAMPLE_HZ + 0.53
    rng = np.random.default_rng(seed)
    bent = [0.01 * np.cos(2 * np.pi * (k * cycles + rng.random())) for k in range(2, 6)]
    run = run_of(np.round((wave("sine", cycles) + sum(bent)) / 0.0584) * 0.0584, "sine", 40.0)
    assert run.drive.periods == 1
    found = fit_waveform(run.drive)
    assert found is not None and abs(found.rate / 40.0 - 1.0) < 1e-3


def test_the_rate_is_the_one_said_unless_readings_are_against_it():
    time = np.arange(6000) / SAMPLE_HZ
    for rate in (RATE, 1.0002 * RATE):
        run = run_of(read(wave("triangle", rate * time), 12))
        found = fit_waveform(run.drive)
        assert found is not None
        assert found.rate == RATE if rate == RATE else abs(found.rate / rate - 1.0) < 1e-5


def test_a_broken_end_that_is_another_run_is_not_looked_at():
    sent = wave("triangle", RATE * np.arange(3030) / SAMPLE_HZ)
    other = sent.copy()
    other[3000:] = sent[3000] + 2.0 * (sent[3000:] - sent[3000])
    (made,), _ = clean_drives([run_of(read(other, 12))], "fitted", "V")
    np.testing.assert_allclose(made.drive.value[:3000], sent[:3000], atol=5e-4)


def test_runs_of_one_setting_share_its_levels_and_others_do_not():
    time = np.arange(3000) / SAMPLE_HZ
    volts = [wave("triangle", rate * time) for rate in (20.0, 40.0, 40.0)]
    volts[2] = BIAS + 0.5 * (volts[2] - BIAS)
    runs = [
        run_of(read(v, 8, seed), rate=rate, name=f"run{seed:02d}")
        for seed, (v, rate) in enumerate(zip(volts, (20.0, 40.0, 40.0), strict=True))
    ]
    made, _ = clean_drives(runs, "fitted", "V")
    levels = [(fit.amplitude, fit.offset) for run in made if (fit := fit_waveform(run.drive))]
    np.testing.assert_allclose(levels[0], levels[1], rtol=1e-7)
    np.testing.assert_allclose(levels, [(4.5, 3.0), (4.5, 3.0), (2.25, 3.0)], atol=3e-3)


def test_an_average_keeps_what_repeats_and_loses_noise():
    """A triangle with rounded turns: no triangle, and the same in each of five periods."""
    cycles = RATE * np.arange(5000) / SAMPLE_HZ
    sent = wave("triangle", cycles) + 0.05 * np.cos(2 * np.pi * 3.0 * cycles + 0.4)
    run = run_of(read(sent, 12))
    (made,), (note, _) = clean_drives([run], "averaged", "V")
    off = made.drive.value - sent
    assert np.sqrt(np.mean(off**2)) < 0.7 * 2e-3 / np.sqrt(5.0)  # a plain mean leaves all of it
    assert "the average over its 5 period(s)" in note
    assert int(note.split("harmonics up to number ")[1].split()[0]) >= 3
    with pytest.raises(
        DataError, match=r"is no triangle: .* up to 0\.05\d? V.*--drive-as averaged"
    ):
        clean_drives([run], "fitted", "V")


def test_steps_keep_their_edges():
    cycles = RATE * np.arange(20000) / SAMPLE_HZ
    sent = np.where((cycles % 1.0) < 0.5, 1.0, 5.0)
    run = run_of(sent + 2e-3 * np.random.default_rng(0).standard_normal(sent.size), "step")
    (made,), _ = clean_drives([run], "averaged", "V")
    np.testing.assert_allclose(np.std(made.drive.value - sent), 2e-3 / np.sqrt(20.0), rtol=0.1)
    with pytest.raises(DataError, match="only a triangle or a sine is fitted"):
        clean_drives([run], "fitted", "V")


def test_a_tone_that_does_not_repeat_with_the_drive_is_told():
    time = np.arange(6000) / SAMPLE_HZ
    sent = wave("triangle", RATE * time) + 0.02 * np.sin(2 * np.pi * 53.0 * time)
    *_, note = clean_drives([run_of(read(sent, 12))], "fitted", "V")[1]
    assert "slower than noise. If the device saw it, too, keep the readings" in note


def test_what_does_not_repeat_and_what_is_measured_stay():
    (sent,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=300, periods=3)
    free = Run(Drive(sent.time, sent.value), sent.value, "run00")
    (same,), (note,) = clean_drives([free], "fitted", "V")
    assert same.drive is free.drive and note == (
        "run00: the drive does not repeat, so its readings stay as they are"
    )
    assert clean_drives([free], "measured", "V") == ([free], [])
    exact = Run(sent, sent.value, "run00")
    (made,), _ = clean_drives([exact], "fitted", "V")
    np.testing.assert_allclose(made.drive.value, sent.value, atol=1e-7)


def test_a_run_starts_at_the_turn_that_few_bits_hid():
    """Two samples of the run before, in which the drive fell at half the rate."""
    sent = np.concatenate([BIAS - SWING / 2 + 0.01 * np.array([2, 1]),
                           wave("triangle", RATE * np.arange(3000) / SAMPLE_HZ)])  # fmt: skip
    (made,), _ = clean_drives([run_of(read(sent, 8))], "fitted", "V")
    assert (made.drive.size, made.drive.start_s, made.drive.periods) == (3000, 2 / SAMPLE_HZ, 3)
    assert made.response.size == 3000
