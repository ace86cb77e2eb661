"""Maps show a known error at its place, as plain numbers."""

import dataclasses
import json

import numpy as np
import pytest
from silent import session

from fitting.diagnosis.noise._periods import PeriodBlock, period_blocks
from fitting.diagnosis.noise._spectrum import Spectrum, measure_spectrum
from fitting.diagnosis.where._residual_profiles import residual_profiles, time_since_turn
from rapi_jax import Drive, Recording, Run
from rapi_jax.sampling._batch import to_batch


def white(parts: list[PeriodBlock], size: float = 0.1) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [size * rng.standard_normal(b.left.shape) for b in parts]


def array(values: list[float | None]) -> np.ndarray:
    return np.array([np.nan if v is None else v for v in values])


def test_each_map_shows_the_error_with_the_sign_of_data_less_model():
    """The model lacks a decay of 5 ms after the drive's maximum."""
    recording, parts = session()
    e = white(parts)
    for x, b in zip(e, parts, strict=True):
        period = b.step_s * b.phase.size
        x -= (np.exp(-(b.phase - 0.5) * period / 5e-3) * (b.phase >= 0.5))[None, :]
    found = residual_profiles(e, parts, measure_spectrum(e, parts), recording)
    json.dumps(found, allow_nan=False)
    centre = array(found["phase"]["phase"])
    for row in found["phase"]["rows"]:
        expected = np.exp(-(centre - 0.5) / row["excitation_hz"] / 5e-3) * (centre > 0.5)
        off = array(row["mean"]) - expected
        assert (np.abs(off) < 5 * array(row["stderr"]) + 0.04).all()  # 0.04: bend within a bin
    seconds = array(found["since_turn"]["seconds"])
    for row in found["since_turn"]["rows"]:
        mean = array(row["mean"])
        seen = np.isfinite(mean) & (seconds > 1e-3)
        expected = np.exp(-seconds / 5e-3) if row["turn"] == "high" else 0 * seconds
        assert np.abs(mean - expected)[seen].max() < 0.12
    assert found["session"]["time_s"] == sorted(found["session"]["time_s"])
    assert len(found["session"]["rms"]) == 20
    first = found["harmonics"]["rows"][0]
    assert first["harmonic"][0] == 1
    assert first["significant"][0]
    assert first["amplitude"][0] > 3 * first["floor"][0]
    assert any(line["locked"] for line in found["lines"])


def test_the_stated_errors_are_those_of_the_means():
    """Of 160 bins with noise alone, 2 to 18 lie outside 95 % of Student's t with 8 degrees."""
    recording, parts = session()
    e = white(parts)
    rows = residual_profiles(e, parts, measure_spectrum(e, parts), recording)["phase"]["rows"]
    z = np.concatenate([array(r["mean"]) / array(r["stderr"]) for r in rows])
    assert 2 <= (np.abs(z) > 2.306).sum() <= 18


def test_frequency_is_that_of_the_model():
    recording, parts = session(rates=(10.0,))
    up = parts[0].phase < 0.5
    model = np.where(up, 2 * parts[0].phase, 2 - 2 * parts[0].phase)[None, :] * np.ones((5, 1))
    e = [model * 1.0]
    held = [dataclasses.replace(parts[0], data=model - e[0])]
    found = residual_profiles(e, held, Spectrum.of_white(1e-6), recording)["frequency"]
    for row in found["rows"]:
        off = array(row["mean"]) + array(found["nu"])
        assert np.nanmax(np.abs(off)) < 0.02


def test_an_origin_of_its_own_is_left_out():
    recording, parts = session()
    e = [x + 7.0 for x in white(parts)]
    mean = residual_profiles(e, parts, measure_spectrum(e, parts), recording, own_origin=True)[
        "session"
    ]["mean"]
    assert np.abs(mean).max() < 0.1


@pytest.mark.parametrize("masked", [1.0, 0.0])
def test_missing_readings_become_null(masked: float):
    """A tenth of all phases, or one run as a whole, is masked."""
    recording, parts = session()
    gone = parts[1].phase < 0.1 if masked else parts[1].phase < 2.0
    parts[1] = dataclasses.replace(parts[1], use=parts[1].use * ~gone[None, :])
    e = [x * b.use for x, b in zip(white(parts), parts, strict=True)]
    found = residual_profiles(e, parts, measure_spectrum(e, parts), recording)
    json.dumps(found, allow_nan=False)
    row = found["phase"]["rows"][1]
    assert row["mean"][0] is None
    assert row["stderr"][0] is None
    assert (row["mean"][20] is None) == (not masked)


def test_a_run_that_does_not_repeat_has_maps_too():
    t = np.arange(900) / 1000.0
    drive = Drive(t, np.interp(t, [0.0, 0.3, 0.5, 0.899], [1.0, 4.0, 2.0, 3.0]))
    recording = Recording.of([drive], [np.zeros(900)])
    parts = period_blocks(recording, to_batch(recording, lead=True))
    found = residual_profiles(
        white(parts), parts, Spectrum.of_white(0.01, measured=False), recording
    )
    json.dumps(found, allow_nan=False)
    assert found["harmonics"]["rows"] == []
    assert {row["excitation_hz"] for row in found["since_turn"]["rows"]} == {None}
    assert max(found["since_turn"]["seconds"]) == pytest.approx(0.4, rel=0.3)


@pytest.mark.parametrize("minimum", [0.0, 0.0013, 0.0049, 0.02, 0.371, 0.998])
def test_the_time_since_a_turn_that_lies_between_samples(minimum):
    """At 40 Hz a bin of 1/200 of a period is 125 us."""
    cycles = np.arange(3200) / 800
    up = np.mod(cycles - minimum, 1.0)
    value = np.where(up < 0.4, up / 0.4, (1.0 - up) / 0.6)
    drive = Drive(cycles / 40.0, value, 40.0, "triangle")
    recording = Recording((Run(drive, value),))
    (block,) = period_blocks(recording, to_batch(recording, lead=True))
    rising, seconds = time_since_turn(drive, block)
    phase = np.mod(block.time[0] * 40.0 - minimum, 1.0)
    inside = np.abs(np.mod(np.stack([phase, phase - 0.4]) + 0.5, 1.0) - 0.5).min(axis=0) > 0.5 / 800
    assert np.array_equal(rising[inside], (phase < 0.4)[inside])
    truth = np.where(phase < 0.4, phase, phase - 0.4) / 40.0
    assert np.abs(seconds - truth)[inside].max() < 1e-7
