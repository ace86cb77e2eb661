"""Outputs of plays on monotone stretches, against the recursion of Eq. 9 in a Python loop."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.diagnosis.base_misfit._play_outputs import PlayShapes, play_outputs, telling_samples

SHAPES = PlayShapes(
    r=np.array([0.0, 0.1, 0.4, 0.9]),
    lam=np.array([1.0, 1.3, 0.8, 1.6]),
    eta=np.array([1.0, 0.7, 1.2, 1.0]),
    bow=np.array([0.0, 0.02, -0.02, 0.01]),
    u_0=1.0,
)


def by_recursion(u, shapes, start):
    """Sample after sample, play after play."""
    out = np.zeros((shapes.r.size, u.size))
    for i in range(shapes.r.size):
        y = start[i]
        for k, x in enumerate(u):
            upper = shapes.lam[i] * x + shapes.eta[i] * shapes.r[i]
            upper += shapes.bow[i] * (x - shapes.u_0) ** 2
            y = max(x - shapes.r[i], min(upper, y))
            out[i, k] = y
    return out


def first(shapes, u_min):
    upper = shapes.lam * u_min + shapes.eta * shapes.r + shapes.bow * (u_min - shapes.u_0) ** 2
    return np.maximum(u_min - shapes.r, upper)  # Eq. 13


@given(st.lists(st.floats(0.0, 3.0), min_size=1, max_size=40))
def test_any_drive(values):
    u = np.array(values)
    found = play_outputs(u, SHAPES, float(u.min()))
    assert found == pytest.approx(by_recursion(u, SHAPES, first(SHAPES, u.min())), abs=1e-12)


@given(st.lists(st.integers(0, 6), min_size=1, max_size=40), st.data())
def test_turns_and_the_samples_asked_for_tell_the_same_outputs(values, data):
    u = np.array(values) / 2.0
    at = np.array(data.draw(st.lists(st.integers(0, u.size - 1), min_size=1)))
    samples, place = telling_samples(u, at)
    found = play_outputs(u[samples], SHAPES, float(u.min()))[:, place]
    assert found == pytest.approx(play_outputs(u, SHAPES, float(u.min()))[:, at], abs=1e-12)


@pytest.mark.parametrize("hold", [0, 5])
def test_a_drive_that_rests_at_its_turns(hold):
    ramp = np.linspace(0.2, 2.8, 30)
    u = np.concatenate([ramp, np.full(hold, 2.8), ramp[::-1], np.full(hold, 0.2), ramp])
    found = play_outputs(u, SHAPES, 0.2)
    assert found == pytest.approx(by_recursion(u, SHAPES, first(SHAPES, 0.2)), abs=1e-12)


def test_an_unknown_start_is_the_middle_of_the_band():
    u = np.full(3, 1.5)
    low, high = SHAPES.bounds(u)
    assert play_outputs(u, SHAPES, None) == pytest.approx((low + high) / 2.0)
