"""Models of both recordings in which one parameter alone differs, each fitted.

About the joint fit a large change is not seen to first order: other parameters seem to have changed
with the one that did. So each is fitted, and what it leaves is tested to first order about it.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from ._difference_test import compare_estimates
from ._joint_fit import JointFit, SharedErrors, Two, fit_jointly, linearise


@dataclasses.dataclass(frozen=True, eq=False)
class SingleChange:
    """`about`: parameters before and after, one of them changed. `left`: the statistic of what the
    others would still have to change by; `z`: the change in standard errors.
    """

    about: Two
    left: float
    z: float


def single_changes(
    errors: tuple[SharedErrors, SharedErrors],
    alone: Two,
    joint: JointFit,
    steps: Two,
    size: int,
    degrees: float,
) -> list[SingleChange]:
    """That of each parameter of both, of which there are `size`."""
    out = []
    for place in range(size):
        fit = fit_jointly(errors, alone, steps, size, place, (joint.before, joint.after))
        about = fit.before, fit.after
        values, covariances = linearise(errors, alone, about, steps)
        rest = compare_estimates(
            (values[0] - fit.before, values[1] - fit.after), covariances, size, degrees
        )
        change = float(fit.after[place] - fit.before[place])
        z = change / float(rest.change_stderr[place])
        out.append(SingleChange(about, rest.statistic, z))
    return out


def contrast_changes(
    singles: list[SingleChange],
) -> tuple[Float[np.ndarray, " parameters"], float]:
    """Changes in standard errors, and the statistic of no change, on one scale for all.

    That statistic is what the best single change explains, with what it leaves.
    """
    best = min(singles, key=lambda one: one.left)
    whole = best.left + best.z**2
    explained = np.array([max(whole - one.left, 0.0) for one in singles])
    return np.sqrt(explained) * np.sign([one.z for one in singles]), whole
