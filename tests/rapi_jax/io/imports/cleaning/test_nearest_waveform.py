"""Which waveform a drive is that a record shows for hardly more than one period."""

import dataclasses

import numpy as np
import pytest

from rapi_jax import DataError, Drive
from rapi_jax.io import ImportOptions, import_recording
from rapi_jax.io.imports.cleaning._nearest_waveform import choose_waveform

SIZE, STEP_S, RATE = 2500, 1e-5, 50.0  # a period and a quarter
PHASE = 0.725  # at its middle: it begins and ends on the way up


def wave(kind: str, cycles: np.ndarray) -> np.ndarray:
    """From -1 to 1; "rounded" is a triangle that an amplifier rounds."""
    if kind == "sine":
        return -np.cos(2.0 * np.pi * cycles)
    if kind == "saturated":
        return np.tanh(-4.0 * np.cos(2.0 * np.pi * cycles))
    triangle = 1.0 - 4.0 * np.abs(np.mod(cycles, 1.0) - 0.5)
    return triangle + (0.02 * np.cos(2.0 * np.pi * cycles) if kind == "rounded" else 0.0)


def record(tmp_path, kind: str):
    """A scope's file of steps of 20 mV, with noise of 8 mV rms, of which no turn is seen twice."""
    time = (np.arange(SIZE) - SIZE // 2) * STEP_S
    cycles = RATE * time + PHASE
    drive = 0.8 * wave(kind, cycles) + 8e-3 * np.random.default_rng(0).standard_normal(SIZE)
    drive = 0.02 * np.round(drive / 0.02)
    response = 0.02 * np.round(0.5 * wave("sine", cycles - 0.04) / 0.02)
    path = tmp_path / "scope.csv"
    rows = zip(time, drive, response, strict=True)
    text = "".join(f"{t:.7e},{u:.4f},{y:.4f}\n" for t, u, y in rows)
    path.write_text("TIME (s),CH1 (V),CH2 (V)\n" + text)
    return path


OPTIONS = ImportOptions(drive="CH1", response="CH2", rates=(RATE,))


@pytest.mark.parametrize("kind", ["sine", "triangle", "rounded"])
def test_the_nearer_waveform_is_taken_and_can_be_fitted(tmp_path, kind):
    path = record(tmp_path, kind)
    made = import_recording(path, OPTIONS)
    expected = "sine" if kind == "sine" else "triangle"
    assert made.recording.runs[0].drive.waveform == expected
    assert any(f"its waveform is taken for a {expected} (" in note for note in made.notes)
    if kind != "rounded":
        fitted = dataclasses.replace(OPTIONS, drive_as="fitted")
        (run,) = import_recording(path, fitted).recording.runs
        off = run.drive.value - 0.8 * wave(
            kind, RATE * (run.drive.time - SIZE // 2 * STEP_S) + PHASE
        )
        assert np.abs(off).max() < 3e-3


def test_what_is_neither_is_not_taken_for_a_triangle():
    time = np.arange(SIZE) * STEP_S
    drive = Drive(time, wave("saturated", RATE * time + PHASE), RATE, "other")
    waveform, said = choose_waveform(drive)
    assert waveform == "other" and "neither a triangle nor a sine (it departs from" in said


@pytest.mark.parametrize(("kind", "wrong"), [("sine", "triangle"), ("triangle", "sine")])
def test_a_waveform_that_is_refused_is_refused_with_the_one_that_fits(tmp_path, kind, wrong):
    options = dataclasses.replace(OPTIONS, waveform=wrong, drive_as="fitted")
    with pytest.raises(DataError, match=f"is no {wrong}: .*give `--waveform {kind}`"):
        import_recording(record(tmp_path, kind), options)
