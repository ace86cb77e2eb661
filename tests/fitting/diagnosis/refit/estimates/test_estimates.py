"""Standard errors of effects, also of refits that ran away."""

import numpy as np
import pytest

from fitting.diagnosis.refit.estimates._profile_cost import scaled_inverse

JACOBIAN = np.random.default_rng(0).standard_normal((40, 3)) * [1.0, 1e-3, 50.0]


def test_the_inverse_is_that_of_the_scaled_matrix():
    inverse, unit = scaled_inverse(JACOBIAN.T @ JACOBIAN)
    assert unit == pytest.approx(np.linalg.norm(JACOBIAN, axis=0))
    want = np.linalg.inv(JACOBIAN.T @ JACOBIAN)
    assert inverse / np.outer(unit, unit) == pytest.approx(want, rel=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_unknown_whose_derivative_overflows_counts_as_unseen(bad):
    """It spoils its row and column; the others keep the errors they have without it."""
    matrix = np.full((4, 4), bad)
    matrix[:3, :3] = JACOBIAN.T @ JACOBIAN
    inverse, unit = scaled_inverse(matrix)
    alone, lengths = scaled_inverse(JACOBIAN.T @ JACOBIAN)
    assert unit[3] == 0.0 and unit[:3] == pytest.approx(lengths)
    assert inverse[:3, :3] == pytest.approx(alone)
