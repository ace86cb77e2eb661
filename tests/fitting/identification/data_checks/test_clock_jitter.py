"""Jitter under even time stamps shows in noise that grows with the slope, and nothing else does."""

import numpy as np
import pytest
from spoiled import WAYS, healthy

from fitting.identification.data_checks._clock_jitter import describe_jitter, measure_slope_noise
from rapi_jax import Drive, Recording, predict
from rapi_jax.io import read_recording

SEEDS = range(6)


def spoiled(way: str | None, seed: int) -> tuple[Recording, list[np.ndarray], list[float]]:
    """A recording, and what a perfect model of the device leaves of it."""
    columns = healthy(seed)
    drives = [
        Drive(t, u, r, "triangle")
        for t, u, r in zip(columns.time, columns.drive, columns.rates, strict=True)
    ]
    clean = [np.asarray(predict(columns.device, drive)) for drive in drives]
    if way:
        WAYS[way](columns)
    errors = [c - y for c, y in zip(clean, columns.response, strict=True)]
    return columns.recording(), errors, columns.step


@pytest.mark.parametrize(("part", "runs"), [(20, 0.7), (90, 0.7)])
def test_hidden_jitter_is_found_with_its_size(part, runs):
    """Uniform within `part` % of a step either way: 1 / sqrt(3) of it rms."""
    clear, sizes = [], []
    for seed in SEEDS:
        recording, errors, steps = spoiled(f"clock jitters {part} %, hidden", seed)
        (said,) = describe_jitter(recording, errors)
        assert said.startswith("jitter: the noise of run") and "own clock" in said
        for run, error, step in zip(recording.runs, errors, steps, strict=True):
            found = measure_slope_noise(error, run.response + error, step)
            assert found is not None
            clear.append(found.clear)
            sizes.append(found.jitter_s / step)
    assert np.mean(clear) > runs
    assert np.median(sizes) == pytest.approx(part / 100 / np.sqrt(3), rel=0.1)


@pytest.mark.parametrize("way", [None, "noise of 5 % of span", "noise of 10 % of span"])
def test_white_noise_of_any_size_is_no_jitter(way):
    for seed in SEEDS:
        recording, errors, _ = spoiled(way, seed)
        assert describe_jitter(recording, errors) == []


def test_a_measured_piezo_has_none(shared_data):
    """The mean period is the model: its noise does not know the slope."""
    (run,) = read_recording(shared_data / "picma_1hz").runs
    periods = run.response[151 : 151 + 39 * 200].reshape(39, 200)
    error = periods.mean(axis=0) - periods
    error = error - error.mean(axis=1, keepdims=True)
    predicted = np.tile(periods.mean(axis=0), 39)
    found = measure_slope_noise(error.ravel(), predicted, run.drive.step_s)
    assert found is not None and not found.clear and found.share < 0.2
