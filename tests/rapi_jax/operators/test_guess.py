"""First guesses: programs that are compiled once, however many recordings of one shape follow."""

import jax
import numpy as np
import pytest

from rapi_jax import RAPI, GeneralRAPI
from rapi_jax.examples import paper_recording
from rapi_jax.operators._guess import _in_turn


@pytest.mark.parametrize("operator", [RAPI, GeneralRAPI])
def test_another_recording_of_the_same_shape_compiles_nothing(operator, caplog):
    """What each fit adds is never freed: after some hundred the process would run out of maps."""
    first, second = (paper_recording(samples=300, periods=1, seed=k)[0] for k in (1, 2))
    operator.initial_guesses(first)
    with jax.log_compiles(), caplog.at_level("WARNING"):
        operator.initial_guesses(second)
        assert not [m for m in caplog.messages if "ompil" in m]
        operator.initial_guesses(second, plays=3)
        assert [m for m in caplog.messages if "ompil" in m]  # so the log would have shown one


def test_each_side_of_symmetry_has_its_best_among_the_first():
    """The best of all first; a fit seldom passes from asymmetric plays of one kind to the other."""
    lam = [0.5, 0.6, 0.7, 0.95, 1.0, 1.05, 1.5, 1.6]
    cost = np.array([0.2, 0.1, 0.3, 0.5, 0.6, 0.4, 0.9, 0.8])
    order = _in_turn(cost, [{"lam": value} for value in lam])
    assert sorted(order) == list(range(8))
    assert order[:6] == [1, 5, 7, 0, 3, 6]


def test_shapes_without_asymmetry_are_in_the_order_of_their_cost():
    assert _in_turn(np.array([3.0, 1.0, 2.0]), [{}, {}, {}]) == [1, 2, 0]
