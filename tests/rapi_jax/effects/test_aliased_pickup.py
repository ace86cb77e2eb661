"""Tones that every run reads too slowly: found where runs of several rates agree."""

import numpy as np
import pytest

from rapi_jax.effects import Pickup, ResidualSummary


def sampled(hertz: float, runs: list[tuple[float, float]]) -> ResidualSummary:
    """A tone, with noise; `runs`: when each begins, s, and its readings a second."""
    rng = np.random.default_rng(9)
    time = np.concatenate([start + np.arange(320) / rate for start, rate in runs])
    tone, zero = 0.3 * np.sin(2 * np.pi * hertz * time + 0.7), np.zeros(time.size)
    return ResidualSummary(
        time, zero, zero, tone + 0.1 * rng.normal(size=time.size),
        np.repeat(np.arange(len(runs)), 320), (1.37,) * len(runs), (3.0,) * len(runs),
        1.0 / max(rate for _, rate in runs), 0.1, 1.0,
    )  # fmt: skip


@pytest.mark.parametrize("hertz", [256.1, 606.75, 884.3])
def test_a_pickup_is_found_that_every_run_reads_too_slowly(hertz):
    """Of 88, 32 and 438 readings a second: each shows it elsewhere, and they agree on one place."""
    evidence = sampled(hertz, [(0.3, 87.68), (5.1, 32.0), (16.2, 438.4), (18.07, 32.0)])
    found = [float(p.hertz) for p in Pickup.initial_guesses(evidence)]
    assert min(abs(f - hertz) for f in found) <= 0.25 / evidence.duration_s


def test_one_run_tells_no_tone_that_it_reads_too_slowly():
    evidence = sampled(606.75, [(0.3, 438.4)])
    found = [float(p.hertz) for p in Pickup.initial_guesses(evidence)]
    assert max(f for f in found if f not in (50, 60, 100, 120, 150, 180)) < 0.5 * 438.4
