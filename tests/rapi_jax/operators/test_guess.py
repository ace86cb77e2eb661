"""First guesses: programs that are compiled once, however many recordings of one shape follow."""

import dataclasses

import jax
import numpy as np
import pytest

from rapi_jax import RAPI, GeneralRAPI, Recording, predict, sine, triangle
from rapi_jax.examples import paper_device, paper_recording
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


@pytest.mark.parametrize("waveform", [triangle, sine])
@pytest.mark.parametrize("quarter", [1, 2, 3])
def test_guesses_are_those_of_a_period_from_its_minimum(waveform, quarter):
    """A single period may begin anywhere: what repeats has been everywhere before.

    Taken to begin in the state of the minimum, half of it was of another history, and two of 45
    simulated devices that the operator fits exactly ended in a wrong minimum.
    """
    drives = waveform([2.0, 3.0], amplitude=1.6, bias=3.0, samples=400, periods=1)
    rolled = [
        dataclasses.replace(d, value=np.roll(d.value, -quarter * d.size // 4)) for d in drives
    ]
    found = []
    for several in (drives, rolled):
        readings = [predict(paper_device(), drive) for drive in several]
        found.append(RAPI.initial_guesses(Recording.of(several, readings), count=4))
    for one, other in zip(*found, strict=True):
        for name in ("alpha", "lam", "zeta", "b"):
            assert float(getattr(other, name)) == pytest.approx(float(getattr(one, name)), rel=1e-6)
