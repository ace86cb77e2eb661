"""What an unknown start may change: against plays begun anywhere, and nothing where it is known."""

import numpy as np
import pytest

from fitting.diagnosis.base_misfit._start_columns import start_columns

SAMPLES = 400


def triangle(phase: float, periods: float = 2.0) -> np.ndarray:
    place = np.mod(phase + np.arange(SAMPLES) / SAMPLES * periods, 1.0)
    return 1.0 + 4.0 * (1.0 - np.abs(2.0 * place - 1.0))


def outputs(u: np.ndarray, start: np.ndarray, threshold: np.ndarray) -> np.ndarray:
    """Plays by the recursion itself (Eq. 9), with a falling bound half as steep again."""
    state, out = start, np.empty((threshold.size, u.size))
    for k, drive in enumerate(u):
        state = np.maximum(drive - threshold, np.minimum(1.5 * drive + threshold, state))
        out[:, k] = state
    return out


@pytest.mark.parametrize("phase", [0.0, 0.1, 0.25, 0.5, 0.9])
def test_they_span_what_plays_begun_elsewhere_change(phase):
    """Of a hundred plays, all but 2 %: a line between 24 points instead of the curve itself."""
    rng = np.random.default_rng(5)
    u, threshold = triangle(phase), rng.uniform(0.05, 0.8, 100)
    low, high = u[0] - threshold, 1.5 * u[0] + threshold
    begun = [outputs(u, low + share * (high - low), threshold).sum(axis=0) for share in (0.2, 0.9)]
    change = begun[1] - begun[0]
    columns = start_columns(np.stack([u, u]), np.array([True, False]))
    assert not columns[:, 0].any()
    left = change - columns[:, 1].T @ np.linalg.lstsq(columns[:, 1].T, change, rcond=None)[0]
    assert np.linalg.norm(change) > 1.0
    assert np.linalg.norm(left) < 0.02 * np.linalg.norm(change)


def test_behind_both_ends_of_the_range_only_a_constant_is_left():
    u = triangle(0.25)
    columns = start_columns(u[None], np.array([False]))[:, 0]
    end = max(int(np.argmax(u)), int(np.argmin(u)))
    assert not columns[:-1, end + 1 :].any()
    np.testing.assert_allclose(columns[:-1, : end + 1].sum(axis=0), 1.0)
    np.testing.assert_array_equal(columns[-1], 1.0)


def test_a_drive_at_rest_has_a_constant_alone():
    columns = start_columns(np.full((1, 10), 2.0), np.array([False]))[:, 0]
    assert not columns[:-1].any() and columns[-1].all()
