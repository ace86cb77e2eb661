"""Drives whose noise hides their turns; drives that do not repeat, however they are averaged."""

from dataclasses import replace

import numpy as np
import pytest

from rapi_jax.io import ImportOptions, import_recording

SAMPLE_HZ, RATE = 10e3, 60.0
VOLTS = ImportOptions(drive_unit="V", response_unit="V", sample_rate=SAMPLE_HZ)


def taken(folder, drive, **more):
    """What is made of a drive, and a response that lags it."""
    np.savez(folder / "a.npz", drive=drive, response=2.0 * np.roll(drive, 3))
    return import_recording(folder / "a.npz", replace(VOLTS, **more))


def current(noise: float, seed: int = 4) -> np.ndarray:
    """Seven periods of a distorted sine as a scope of eight bits reads it."""
    phase = 2.0 * np.pi * RATE * np.arange(1200) / SAMPLE_HZ
    clean = np.sin(phase) - 0.2 * np.sin(3.0 * phase)
    return np.round((clean + noise * np.random.default_rng(seed).standard_normal(1200)) * 32) / 32


@pytest.mark.parametrize("noise", [0.05, 0.1])
def test_a_noisy_drive_repeats_by_its_average(tmp_path, noise):
    made = taken(tmp_path, current(noise))
    (run,) = made.recording.runs
    assert run.drive.rate == pytest.approx(RATE, rel=2e-3)
    assert run.drive.periods >= 5
    np.testing.assert_array_equal(np.unique(run.drive.value * 32 % 1), [0.0])  # as it was read
    (note,) = (line for line in made.notes if "the drive carries noise" in line)
    found = float(note.split("noise of ")[1].split()[0])
    assert found == pytest.approx(noise, rel=0.2)
    assert "where the drive that was sent is known, give that" in note


def test_a_tone_is_not_averaged_away(tmp_path):
    t = np.arange(1200) / SAMPLE_HZ
    drive = current(0.02) + 0.4 * np.sin(2.0 * np.pi * 843.0 * t)
    made = taken(tmp_path, drive)
    (run,) = made.recording.runs
    assert run.drive.waveform == "other" and not run.drive.repeats
    (note,) = (line for line in made.notes if "cycles that do not repeat" in line)
    assert "give --rate and --waveform" in note


def test_a_rate_and_a_waveform_that_are_said_are_taken(tmp_path):
    t = np.arange(1200) / SAMPLE_HZ
    drive = current(0.02) + 0.4 * np.sin(2.0 * np.pi * 843.0 * t)
    made = taken(tmp_path, drive, rates=(RATE,), waveform="multisine")
    (run,) = made.recording.runs
    assert (run.drive.waveform, run.drive.rate, run.drive.periods) == ("multisine", RATE, 6)
