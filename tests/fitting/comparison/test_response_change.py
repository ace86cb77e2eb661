"""How much a response changed, where the parameters of it trade against each other."""

import numpy as np
import pytest

from fitting.comparison._joint_fit import SharedErrors
from fitting.comparison._response_change import response_change

SAMPLES, NOISE = 500, 0.01
WAVES = np.sqrt(2.0 * SAMPLES) * np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, SAMPLES), 3))[0]
SLOW, FAST = WAVES[:, :2].T / np.sqrt(2.0)  # of rms 1, at right angles


class Valley(SharedErrors):
    """Readings that fix `b - a**2` well and `a` hardly: one valley, and it is curved."""

    def __init__(self):
        pass

    def by_model(self, session, values):
        a, b = values
        return 0.05 * a * SLOW + 10.0 * (b - a**2) * FAST


def covariance(at):
    slopes = np.stack([0.05 * SLOW - 20.0 * at[0] * FAST, 10.0 * FAST], axis=1)
    return NOISE**2 * np.linalg.inv(slopes.T @ slopes)


def test_a_change_along_a_curved_valley_is_not_lost_in_noise():
    """What is uncertain at either end would move the response much between them."""
    ends = np.array([0.0, 0.0]), np.array([1.0, 1.0])
    found = response_change(
        (Valley(), Valley()), ends, ends, (covariance(ends[0]), covariance(ends[1]))
    )
    assert found.low < 0.05 < found.high
    assert found.value == pytest.approx(0.05, rel=0.02) and found.high - found.low < 0.01


def test_noise_alone_is_no_change():
    rng = np.random.default_rng(0)
    at = np.array([1.0, 1.0])
    spread = covariance(at)
    found = []
    for _ in range(50):
        ends = tuple(at + rng.multivariate_normal(np.zeros(2), 1e-2 * spread) for _ in at)
        found.append(
            response_change((Valley(), Valley()), ends, (at, at), (1e-2 * spread, 1e-2 * spread))
        )
    assert np.mean([interval.low == 0.0 for interval in found]) > 0.85
