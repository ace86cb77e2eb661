"""What is advised where the fitted model has no inverse."""

from unittest.mock import Mock

import equinox as eqx
import pytest

from fitting.identification.assessment._inversion import describe_missing_inverse
from fitting.identification.problem._problem import Problem, Solution
from rapi_jax import ECDL, Recording, triangle
from rapi_jax.examples import paper_device


def falling(operator):
    """The operator with a linear part that falls with the drive."""
    return eqx.tree_at(lambda one: one.d, operator, operator.d.at[0].multiply(-1.0))


@pytest.mark.parametrize(
    ("swings", "other"), [((4.0,), False), ((4.0, 2.0), True)], ids=["one swing", "two swings"]
)
def test_another_law_of_the_swing_is_advised_where_two_swings_can_tell_it(swings, other):
    drives = [
        drive
        for swing in swings
        for drive in triangle([10.0, 20.0], amplitude=swing, bias=3.0, samples=200, periods=2)
    ]
    recording = Recording.of(drives, [14.0 * drive.value for drive in drives])
    problem = Mock(spec=Problem, recording=recording)
    problem.model.return_value = ECDL(falling(paper_device().operator))
    (note,) = describe_missing_inverse(problem, Mock(spec=Solution, values=None))
    assert "does not rise with the drive" in note and "ecord more rates and swings." in note
    assert ("--operator FixedRAPI" in note) == other
