"""What is said of a drive without the period stated: its kind, and advice that is right."""

import re

import numpy as np
import pytest

from fitting.identification.data_checks._data_checks import find_faults
from fitting.identification.data_checks._drive_character import (
    characterise,
    describe_repetition,
    rate_error,
)
from rapi_jax import Drive, Recording

RATE = 2000.0
TIME = np.arange(8000) / RATE
RNG = np.random.default_rng(1)


def tones(repeats_s: float, low: float = 1.0, high: float = 50.0) -> np.ndarray:
    """Twenty equal tones of random phases from `low` to `high` Hz."""
    numbers = np.unique(np.geomspace(low * repeats_s, high * repeats_s, 20).round())
    phases = RNG.uniform(0, 2 * np.pi, numbers.size)
    waves = [
        np.sin(2 * np.pi * k / repeats_s * TIME + p) for k, p in zip(numbers, phases, strict=True)
    ]
    return 3.0 + np.sum(waves, axis=0)


def faults(value: np.ndarray, said: float, waveform="multisine") -> list:
    drive = Drive(TIME, value, said, waveform)
    noise = 1e-3 * RNG.standard_normal(value.size)
    return find_faults(Recording.of([drive], [value + noise]))


@pytest.mark.parametrize("said", [5.0, 10.0, 31.0])
def test_a_broadband_drive_is_called_so_and_its_own_repetition_given(said):
    (fault,) = faults(tones(1.0), said)
    assert fault.kind == "wrong period" and "it is broadband" in fault.message
    assert "repeats every 1 s. Say `excitation_hz = 1`" in fault.message
    assert "swings at" not in fault.message


@pytest.mark.parametrize("said", [5.0, 10.0])
def test_a_broadband_drive_without_repetition_has_no_rate(said):
    for value in (
        tones(4.0),
        3.0 + np.convolve(RNG.standard_normal(TIME.size), np.hanning(60), "same"),
        3.0 + np.sin(2 * np.pi * (TIME + 5.0 * TIME**2)),  # 1 to 41 Hz
    ):
        (fault,) = faults(value, said)
        assert fault.kind == "broadband drive"
        assert "repeats nowhere in the 4 s recorded. Leave `excitation_hz` out" in fault.message


def test_a_sum_of_few_tones_is_no_broadband_drive_and_gets_no_rate_of_its_swings():
    (fault,) = faults(3.0 + np.sin(2 * np.pi * (TIME + 2.0 * TIME**2)), 10.0)  # 1 to 17 Hz
    assert fault.kind == "wrong period" and "it is a sum of tones" in fault.message
    assert "Leave `excitation_hz` out" in fault.message


@pytest.mark.parametrize("high", [50.0, 400.0, 900.0])
@pytest.mark.parametrize("repeats_s", [1.0, 2.0])
def test_a_broadband_drive_with_its_own_rate_has_no_fault(repeats_s, high):
    """Also of two periods, and with power up to near half the sampling rate."""
    value = tones(repeats_s, 0.05 * high, high)
    assert faults(value, 1.0 / repeats_s) == []
    (fault,) = faults(value, 1.37 / repeats_s)
    assert fault.kind == "wrong period"
    assert faults(tones(4.0), 0.25) == []


@pytest.mark.parametrize(
    "wave",
    [
        lambda cycles: np.abs(2 * np.mod(cycles, 1) - 1),
        lambda cycles: np.mod(cycles, 1),
        lambda cycles: np.sign(np.sin(2 * np.pi * cycles + 0.1)),
        lambda cycles: np.sin(2 * np.pi * cycles),
    ],
)
def test_waves_of_another_rate_are_no_broadband_drives(wave):
    (fault,) = faults(3.0 + wave(2.0 * TIME), 3.0, "triangle")
    assert fault.kind == "wrong period" and "repeats at about 2 Hz" in fault.message


@pytest.mark.parametrize(("true", "rate"), [(2.0, ""), (1.5, " and `excitation_hz = 1.5`")])
def test_a_growing_swing_does_not_repeat_at_any_rate(true, rate):
    (fault,) = faults(3.0 + TIME * np.sin(2 * np.pi * true * TIME), 2.0, "sine")
    assert fault.kind == "wrong period"
    assert f"swings at about {true:g} Hz" in fault.message
    assert f'so does not repeat. Say `waveform = "other"`{rate}.' in fault.message


def test_character_in_numbers():
    """Half of the power of a sine and of its triple each; the lines are a quarter of a Hz apart."""
    found = characterise(Drive(TIME, np.sin(2 * np.pi * 3 * TIME) + np.sin(2 * np.pi * 9 * TIME)))
    assert (found.low_hz, found.high_hz) == pytest.approx((3.0, 9.0), abs=0.5)
    assert found.main_share == pytest.approx(0.5, abs=0.02)
    assert found.repeats_s == pytest.approx(1 / 3, rel=1e-3)
    steady = characterise(Drive(TIME, np.sin(2 * np.pi * 3 * TIME)))
    assert steady.main_hz == pytest.approx(3.0, abs=0.05) and not steady.changing


def scan(waveform: str, rate: float, noise: float, seed: int) -> np.ndarray:
    """A scan over 4.5 V, read with so much noise (of its span)."""
    phase = (rate * TIME) % 1.0
    values = {
        "triangle": 1.0 - np.abs(2.0 * phase - 1.0),
        "sine": 0.5 - 0.5 * np.cos(2 * np.pi * phase),
    }
    read = np.random.default_rng(seed).standard_normal(TIME.size)
    return 0.75 + 4.5 * (values[waveform] + noise * read)


@pytest.mark.parametrize("waveform", ["triangle", "sine"])
@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("error", [-0.01, 0.01, 0.008])
def test_a_rate_wrong_by_a_hundredth_is_found_and_the_right_one_given(waveform, noise, error):
    said, value = 0.8 / (1.0 + error), scan(waveform, 0.8, noise, 1)
    assert rate_error(Drive(TIME, value, said, waveform)) == pytest.approx(error, abs=6e-4)
    (fault,) = faults(value, said, waveform)
    found = re.search(r"repeats at (?:about )?([0-9.]+) Hz. Correct `excitation_hz`", fault.message)
    assert fault.kind == "wrong period" and found is not None
    assert float(found[1]) == pytest.approx(0.8, abs=2e-3)


@pytest.mark.parametrize("waveform", ["triangle", "sine"])
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("rate", [0.3, 0.5, 0.8, 5.0])
def test_a_right_rate_is_not_called_wrong(waveform, noise, rate):
    for seed in range(3):
        value = scan(waveform, rate, noise, seed)
        assert abs(rate_error(Drive(TIME, value, rate, waveform))) < 1e-3
        assert faults(value, rate, waveform) == []
        assert faults(value, rate * 1.001, waveform) == []  # as rates are rounded


@pytest.mark.parametrize("said", [None, 3.0])
@pytest.mark.parametrize("hz", [1.0, 3.2, 7.03])
def test_a_drive_that_repeats_unsaid_is_told_its_rate(hz, said):
    """To 1e-4, though a period holds no whole number of samples; of a file's drive with noise."""
    noise = 1e-3 * RNG.standard_normal(TIME.size)
    drive = Drive(TIME, 3.0 + np.sin(2 * np.pi * hz * TIME + 0.4) + noise, said, "other")
    text = describe_repetition(Recording.of([drive], [drive.value]))
    assert text is not None and "run 'run00' repeats" in text
    (rate,) = re.findall(r"excitation_hz = ([\d.]+)", text)
    assert float(rate) == pytest.approx(hz, rel=2e-4)


def test_a_drive_that_does_not_repeat_or_is_said_to_is_told_nothing():
    decaying = Drive(TIME, np.exp(-TIME) * np.sin(2 * np.pi * TIME), 1.0, "other")
    once = Drive(TIME, np.abs(TIME - 2.0))
    resting = Drive(TIME, np.ones(TIME.size))
    said = Drive(TIME, np.sin(2 * np.pi * TIME), 1.0, "sine")
    for drive in (decaying, once, resting, said):
        assert describe_repetition(Recording.of([drive], [TIME])) is None
