"""What can be noise where nothing repeats: white residuals can, slow ones and a loop cannot."""

import dataclasses

import numpy as np
import pytest

from fitting.diagnosis.noise._periods import period_blocks
from fitting.diagnosis.noise._residual_whiteness import measure_whiteness
from fitting.diagnosis.which.evidence._probability import doubt_none
from rapi_jax import Drive, Recording
from rapi_jax.sampling._batch import to_batch

SIZE = 800
TIME = np.arange(SIZE) / SIZE


def whiteness(error: np.ndarray, turns: int = 1, signal: float = 10.0):
    """Of `error` under triangles without a rate, so that nothing is known to repeat."""
    drive = 1.0 - np.abs(2.0 * np.mod(turns * TIME, 1.0) - 1.0)
    recording = Recording.of([Drive(TIME, drive)], [signal * drive])
    blocks = period_blocks(recording, to_batch(recording, lead=True))
    size = blocks[0].size
    return measure_whiteness([error[None, :size]], blocks)


def white(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(SIZE)


def slow(seed: int, correlation: float = 0.98) -> np.ndarray:
    out, last = np.empty(SIZE), 0.0
    for i, step in enumerate(white(seed)):
        last = correlation * last + np.sqrt(1.0 - correlation**2) * step
        out[i] = last
    return out


@pytest.mark.parametrize("turns", [1, 8])
def test_white_residuals_can_be_noise(turns):
    """At 3 standard errors none of 300 draws is doubted, whatever their size beside the span."""
    for seed in range(300):
        found = whiteness(0.3 * white(seed), turns)
        assert found.doubts == (), found
    assert found.rms == pytest.approx(0.3, rel=0.1)


def test_slow_residuals_cannot_be_told_from_an_effect():
    """AR(1) at 0.98 keeps a few percent of its variance in third differences."""
    for seed in range(50):
        (doubt,) = whiteness(0.3 * slow(seed)).doubts
        assert "does not change from sample to sample" in doubt


def test_a_loop_under_white_noise_follows_the_drive():
    """As large as the noise, so that half of the mean square is slow and half white."""
    rate = np.sign(np.cos(2 * np.pi * 8 * TIME)) * np.sin(2 * np.pi * 8 * TIME) ** 2
    loop = 1.2 * rate / rate.std()
    found = whiteness(0.1 * (loop + white(0)), turns=8)
    assert any("follows the drive" in doubt for doubt in found.doubts)
    assert 0.4 < found.of_drive < 0.75


def test_what_is_most_of_the_signal_is_no_noise():
    (doubt,) = whiteness(white(1), signal=2.5).doubts
    assert "readings' variance" in doubt


def test_masked_readings_and_rounding_count_for_nothing():
    drive = Drive(TIME, np.abs(2.0 * TIME - 1.0))
    recording = Recording.of([drive], [10.0 * drive.value])
    (block,) = period_blocks(recording, to_batch(recording, lead=True))
    error = np.where(np.arange(block.size) % 2, 0.0, slow(0)[: block.size])
    half = dataclasses.replace(block, use=(np.arange(block.size) % 2 == 0)[None, :].astype(float))
    assert measure_whiteness([error[None, :]], [half]).doubts
    assert measure_whiteness([1e-9 * slow(0)[None, : block.size]], [block]).doubts == ()


def test_doubt_moves_what_none_has_to_unlisted():
    ranked = [("none", 0.9), ("creep", 0.07), ("unlisted", 0.03)]
    moved = doubt_none(ranked)
    assert [name for name, _ in moved] == ["unlisted", "creep", "none"]
    assert sum(p for _, p in moved) == pytest.approx(1.0)
    assert dict(moved)["creep"] == 0.07
