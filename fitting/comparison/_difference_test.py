r"""Whether estimates of two recordings differ, and in which parameters.

With estimates $\theta_1, \theta_2$ of covariances $V_1, V_2$ and $\delta = \theta_2 - \theta_1$,
$\delta'(V_1 + V_2)^{-1}\delta$ is what one model for both recordings costs more than one for each,
in units of the measured noise (the constrained minimum of the sum of both chi-squares). It is
referred to F, since the noise is estimated.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy import stats

from fitting._multiple_tests import adjust_holm

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class DifferenceTest:
    """Differences of all parameters, each by itself and each given that no other changed.

    - `statistic`, `degrees`, `p_value`: of all parameters together.
    - `stderr`, `p`, `p_holm`: of each difference; `change`, `change_stderr`, `p_given`,
      `p_given_holm`: of each, if all others are the same in both.
    - `p_change`: the smaller of that of all together and of each given the others, for both.
    """

    difference: Float[np.ndarray, " parameters"]
    stderr: Float[np.ndarray, " parameters"]
    p: Float[np.ndarray, " parameters"]
    p_holm: Float[np.ndarray, " parameters"]
    change: Float[np.ndarray, " parameters"]
    change_stderr: Float[np.ndarray, " parameters"]
    p_given: Float[np.ndarray, " parameters"]
    p_given_holm: Float[np.ndarray, " parameters"]
    statistic: float
    degrees: tuple[float, float]
    p_value: float
    p_change: float


def compare_estimates(
    values: tuple[Float[np.ndarray, " before"], Float[np.ndarray, " after"]],
    covariances: tuple[Float[np.ndarray, "before before"], Float[np.ndarray, "after after"]],
    size: int,
    degrees: float,
) -> DifferenceTest:
    """The tests of two estimates, before and after, of the first `size` parameters of each.

    The others are of one alone. `degrees`: of freedom of the measured noise.
    """
    difference = values[1][:size] - values[0][:size]
    variance = covariances[0][:size, :size] + covariances[1][:size, :size]
    stderr = np.sqrt(np.diag(variance))
    inverse = np.linalg.inv(variance / np.outer(stderr, stderr)) / np.outer(stderr, stderr)
    statistic = float(difference @ inverse @ difference)
    change_stderr = 1.0 / np.sqrt(np.diag(inverse))
    change = change_stderr**2 * (inverse @ difference)
    p = 2.0 * stats.t.sf(np.abs(difference / stderr), degrees)
    p_given = 2.0 * stats.t.sf(np.abs(change / change_stderr), degrees)
    p_given_holm = adjust_holm(p_given)
    p_value = float(stats.f.sf(statistic / size, size, degrees))
    return DifferenceTest(
        difference=difference,
        stderr=stderr,
        p=p,
        p_holm=adjust_holm(p),
        change=change,
        change_stderr=change_stderr,
        p_given=p_given,
        p_given_holm=p_given_holm,
        statistic=statistic,
        degrees=(float(size), float(degrees)),
        p_value=p_value,
        p_change=min(1.0, 2.0 * min(p_value, float(p_given_holm.min()))),
    )


def detectable_changes(test: DifferenceTest, tests: int) -> Float[np.ndarray, " parameters"]:
    """How much each parameter alone must change so that a change is found in 95 % of cases.

    That is by its own test, for all parameters and for so many `tests` beside each other; the test
    of all parameters together can only find more.
    """
    size, degrees = test.degrees
    level = THRESHOLDS.change_level / (tests * size)
    needed = stats.t.isf(0.5 * level, degrees) + stats.t.ppf(THRESHOLDS.detection_power, degrees)
    return float(needed) * test.change_stderr
