"""Numerical rank of a Jacobian: which directions and parameters the data determine.

Columns are scaled to unit length before any decision, so that no choice of units enters. What is
decided by `THRESHOLDS.rank` or by the caller's tolerance is always relative to the largest singular
value.
"""

import numpy as np

from ._thresholds import THRESHOLDS

_EPS = float(np.finfo(float).eps)


def is_determined(singular_values: np.ndarray, tolerance: float) -> np.ndarray:
    """Which directions count towards the rank: above `tolerance` times the largest value."""
    return singular_values > tolerance * singular_values.max(initial=0.0)


def scale_columns(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`matrix` with columns of unit length, zero ones as they are, and their lengths."""
    length = np.linalg.norm(matrix, axis=0)
    return matrix / np.where(length > 0, length, 1.0), length


def qr_factor(matrix: np.ndarray) -> np.ndarray:
    """The triangular factor of `matrix`."""
    return np.asarray(np.linalg.qr(matrix, mode="r"))


def singular_directions(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Singular values and right vectors, as many as columns, also where there are fewer rows."""
    _, values, right = np.linalg.svd(qr_factor(matrix))
    return np.pad(values, (0, matrix.shape[1] - values.size)), right


def undetermined_columns(jacobian: np.ndarray) -> np.ndarray:
    """Which columns are zero, or take part in a direction that changes next to no residual."""
    length = np.linalg.norm(jacobian, axis=0)
    zero = length <= THRESHOLDS.zero_column * max(length.max(initial=0.0), 1e-300)
    _, values, right = np.linalg.svd(qr_factor(jacobian / np.where(zero, 1.0, length)))
    null = right[: values.size][~is_determined(values, THRESHOLDS.rank)]
    return zero | (np.abs(null) > THRESHOLDS.null_component).any(axis=0)


def pseudo_gram(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`(J'J)^-1` on what `J` determines, and which columns it does not determine.

    Rank to rounding, not `THRESHOLDS.rank`: a weak direction has a large variance, not none.
    """
    scaled, length = scale_columns(jacobian)
    values, right = singular_directions(scaled)
    kept = is_determined(values, _EPS * max(jacobian.shape))
    spread = right.T * np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
    unit = np.where(length > 0, length, np.inf)
    null = np.abs(right[~kept]) > THRESHOLDS.exact_null_component
    return (spread @ spread.T) / np.outer(unit, unit), null.any(axis=0) | (length == 0)


def inverse_gram(jacobian: np.ndarray) -> np.ndarray:
    """`(J'J)^-1`; infinite variance where a column is zero or redundant."""
    out, undetermined = pseudo_gram(jacobian)
    out[undetermined, undetermined] = np.inf
    return out
