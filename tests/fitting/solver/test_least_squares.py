"""What a fit reports where the data cannot decide, and how bounds, ties and precision behave."""

import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting import least_squares
from fitting.solver._bound_transform import Bounds

T = np.linspace(0.0, 1.0, 20)
Y = 1.0 + 2.0 * T + 0.1 * np.cos(17.0 * T)


def line(values, args):
    t, y = args
    return values[0] + values[1] * t - y


def exact_line():
    columns = np.stack([np.ones_like(T), T], axis=1)
    values, squares, _, _ = np.linalg.lstsq(columns, Y)
    variance = squares[0] / (T.size - 2)
    return values, np.sqrt(variance * np.diag(np.linalg.inv(columns.T @ columns)))


def test_a_linear_fit_is_the_normal_equations():
    fit = least_squares(line, [0.3, -4.0], (T, Y))
    values, stderr = exact_line()
    assert fit.converged and fit.reason == ""
    assert np.allclose(fit.values, values, rtol=1e-9)
    assert np.allclose(fit.stderr, stderr, rtol=1e-9)
    assert np.isclose(fit.cost, 0.5 * fit.residual @ fit.residual)
    assert fit.trace[0][0] == 0 and fit.trace[-1] == (fit.steps, fit.cost)


def test_an_exact_fit_converges():
    fit = least_squares(line, [0.0, 0.0], (T, 1.0 + 2.0 * T))
    assert fit.converged
    assert np.allclose(fit.values, [1.0, 2.0], rtol=1e-12)


@pytest.mark.parametrize("samples", [0, 1])
def test_too_few_samples_are_no_success(samples):
    fit = least_squares(line, [0.0, 0.0], (T[:samples], Y[:samples]))
    assert not fit.converged
    assert fit.reason == f"{samples} residuals cannot fix 2 parameters"
    assert np.isinf(fit.stderr).all()
    assert fit.spectrum[0].shape == (2,)
    assert (fit.values == 0.0).all() and fit.steps == 0


def test_one_sample_fixes_one_parameter_but_not_its_error():
    fit = least_squares(lambda v, y: v - y, [3.0], Y[:1])
    assert fit.converged and fit.degrees == 0
    assert np.allclose(fit.values, Y[0])
    assert np.isinf(fit.stderr).all()


@pytest.mark.parametrize("t", [np.zeros_like(T), np.full_like(T, 0.7)], ids=["zero", "constant"])
def test_a_constant_drive_shows_in_the_spectrum_and_the_errors(t):
    fit = least_squares(line, [0.5, 0.5], (t, Y))
    assert fit.converged  # an optimum, one of many
    assert np.allclose(fit.values[0] + fit.values[1] * t, Y.mean())
    assert np.isinf(fit.stderr[1])
    assert np.isinf(fit.stderr[0]) == t.any()
    assert (fit.spectrum[0] > 1e-12).sum() == 1


def test_a_duplicated_parameter_shows_in_the_spectrum_and_the_errors():
    def twice(values, args):
        t, y = args
        return values[0] + (values[1] + values[2]) * t - y

    fit = least_squares(twice, [0.0, 1.0, 5.0], (T, Y))
    values, stderr = exact_line()
    assert fit.converged
    assert np.isclose(fit.values[1] + fit.values[2], values[1], rtol=1e-8)
    assert np.isfinite(fit.stderr[0]) and np.isinf(fit.stderr[1:]).all()
    size, right = fit.spectrum
    assert size[-1] < 1e-14 * size[0]
    assert np.allclose(np.abs(right[-1]), [0.0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-9)


def test_a_dead_parameter_stays_and_has_no_error():
    def dead(values, args):
        return line(values[:2], args) + 0.0 * values[2]

    fit = least_squares(dead, [0.0, 0.0, 7.0], (T, Y))
    values, _ = exact_line()
    assert fit.converged
    assert np.allclose(fit.values, [*values, 7.0], rtol=1e-8)
    assert np.isfinite(fit.stderr[:2]).all() and np.isinf(fit.stderr[2])
    assert fit.spectrum[0][-1] == 0.0


def test_a_parameter_that_runs_away_is_no_success():
    def decay(values, args):
        t, y = args
        return jnp.exp(-values[0] * (t + 0.1)) - y

    fit = least_squares(decay, [1.0], (T, -1.0 - Y))
    assert not fit.converged
    assert "gradient is not zero" in fit.reason


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_start_without_a_finite_residual_is_no_success(bad):
    y = Y.copy()
    y[3] = bad
    fit = least_squares(line, [0.0, 1.0], (T, y))
    assert not fit.converged
    assert fit.reason == "not finite at the start"
    assert (fit.values == [0.0, 1.0]).all() and fit.steps == 0


def test_a_start_whose_squares_overflow_has_an_infinite_cost_and_no_warning():
    fit = least_squares(line, [0.0, 1.0], (T, Y + 1e200))
    assert fit.cost == np.inf
    assert fit.reason == "not finite at the start"


def test_a_fixed_value_does_not_move():
    fit = least_squares(line, [0.25, 0.0], (T, Y), free=np.array([False, True]))
    assert fit.converged
    assert fit.values[0] == 0.25 and fit.stderr[0] == 0.0
    assert np.isclose(fit.values[1], T @ (Y - 0.25) / (T @ T), rtol=1e-9)
    assert (fit.jacobian[:, 0] == 0.0).all()
    assert fit.degrees == T.size - 1


def test_nothing_free_is_a_fit_of_nothing():
    fit = least_squares(line, [0.25, 0.5], (T, Y), free=np.zeros(2, dtype=bool))
    assert fit.converged and fit.steps == 0
    assert (fit.values == [0.25, 0.5]).all() and (fit.stderr == 0.0).all()


@pytest.mark.parametrize("bounded", [False, True])
def test_tied_values_are_one_parameter(bounded):
    start = np.array([1.5, 1.5])
    bounds = Bounds.of(start, np.zeros(2), np.array([np.inf, np.inf])) if bounded else None
    fit = least_squares(line, start, (T, Y), ties=np.array([0, 0]), bounds=bounds)
    one = least_squares(lambda v, a: v[0] * (1.0 + a[0]) - a[1], [1.5], (T, Y))
    assert fit.converged
    assert np.allclose(fit.values, one.values[0], rtol=1e-9)
    assert np.allclose(fit.stderr, one.stderr[0], rtol=1e-7)
    assert fit.degrees == one.degrees == T.size - 1


LIMITS = {
    "none": (-np.inf, np.inf),
    "low": (-1.0, np.inf),
    "high": (-np.inf, 3.0),
    "both": (-1.0, 3.0),
}


TRIANGULAR = np.array([[1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [-2.0, 0.3, 1.0]])
DENSE = np.array([[1.0, -0.4, 0.2], [0.5, 1.0, -0.3], [-2.0, 0.3, 1.0]])  # as an inverse RA-PI's


@pytest.mark.parametrize("coupling", [TRIANGULAR, DENSE], ids=["triangular", "dense"])
@pytest.mark.parametrize(("low", "high"), LIMITS.values(), ids=LIMITS)
@settings(deadline=None, max_examples=50)
@given(data=st.data())
def test_bounds_go_there_and_back(low, high, coupling, data):
    inside = st.floats(max(low, -1e3) + 0.01, min(high, 1e3) - 0.01)
    start = np.array(data.draw(st.lists(inside, min_size=3, max_size=3)))
    values = np.array(data.draw(st.lists(inside, min_size=3, max_size=3)))
    bounds = Bounds.of(coupling @ start, np.full(3, low), np.full(3, high), coupling)
    near = np.minimum(values - low, high - values) < 2e-3 * np.asarray(bounds.scale)
    back = np.asarray(bounds.values(jnp.asarray(bounds.coordinates(coupling @ values))))
    assert np.allclose(bounds.bounded(back)[~near], values[~near], rtol=1e-8, atol=1e-8)
    assert (bounds.bounded(back) > low - 1e-9).all() and (bounds.bounded(back) < high + 1e-9).all()


@pytest.mark.parametrize("tiny", [0.0, 5e-324, -1e-310, 1e-200])
def test_a_start_next_to_zero_is_no_size(tiny):
    """Nothing divided by it is a number."""
    bounds = Bounds.of(np.array([tiny]))
    assert bounds.coordinates(np.array([1.0])) == pytest.approx([1.0])


@pytest.mark.parametrize(("low", "high"), LIMITS.values(), ids=LIMITS)
@pytest.mark.parametrize("x", [-1e4, -30.0, -1.0, 0.0, 1e-3, 1.0, 30.0, 1e4])
def test_bounds_have_the_derivative_of_their_values(low, high, x):
    bounds = Bounds.of(np.array([0.5]), np.array([low]), np.array([high]))
    slope = float(jax.jacfwd(bounds.values)(jnp.array([x]))[0, 0])
    step = 1e-4 * max(abs(x), 1.0)
    below, above = (float(bounds.values(jnp.array([x + d]))[0]) for d in (-step, step))
    assert np.isclose(slope, (above - below) / (2.0 * step), rtol=1e-3, atol=1e-12)
    assert slope > 0.0


@pytest.mark.parametrize("outside", [-1.0, 0.0, 3.0, 5.0])
def test_a_start_on_or_beyond_a_bound_is_put_inside(outside):
    bounds = Bounds.of(np.array([outside]), np.array([0.0]), np.array([3.0]))
    inside = float(bounds.values(jnp.asarray(bounds.coordinates(np.array([outside]))))[0])
    assert 0.0 < inside < 3.0


@pytest.mark.parametrize(("value", "high"), [(6e-5, 0.2), (150.0, 1e6)], ids=["delay", "tone"])
def test_a_start_far_from_its_bounds_stays_where_it_is(value, high):
    """A thousandth of the width between them, of decades, is more than the value itself."""
    bounds = Bounds.of(np.array([value]), np.array([0.0]), np.array([high]))
    there = np.asarray(bounds.values(jnp.asarray(bounds.coordinates(np.array([value])))))
    assert there == pytest.approx([value], rel=1e-9)
    assert not bounds.at_bound(there).any() and bounds.at_bound(1e-4 * there).all()


@pytest.mark.parametrize("kind", ["high", "low", "both"])
@pytest.mark.parametrize("start", [0.5, 0.01, 0.99])
def test_a_fit_ends_on_an_active_bound(kind, start):
    sign = -1.0 if kind == "low" else 1.0
    low = {"high": -np.inf, "low": -1.0, "both": 0.0}[kind]
    high = {"high": 1.0, "low": np.inf, "both": 1.0}[kind]
    first = np.array([0.0, sign * start])
    bounds = Bounds.of(first, np.array([-np.inf, low]), np.array([np.inf, high]))
    fit = least_squares(line, first, (T, sign * Y), bounds=bounds)
    assert fit.converged
    assert fit.at_bound.tolist() == [False, True]
    assert np.isclose(fit.values[1], sign, rtol=1e-6)
    assert np.isclose(fit.values[0], sign * (Y - T).mean(), rtol=1e-6)


@pytest.mark.parametrize("kind", ["high", "low", "both"])
def test_a_bound_that_is_not_reached_changes_nothing(kind):
    first = np.array([0.0, 0.5])
    low, high = {"high": (-np.inf, 9.0), "low": (-9.0, np.inf), "both": (-9.0, 9.0)}[kind]
    bounds = Bounds.of(first, np.full(2, low), np.full(2, high))
    fit = least_squares(line, first, (T, Y), bounds=bounds)
    values, stderr = exact_line()
    assert fit.converged and not fit.at_bound.any()
    assert np.allclose(fit.values, values, rtol=1e-7)
    assert np.allclose(fit.stderr, stderr, rtol=1e-7)


def test_a_coupled_bound_moves_with_the_other_value():
    first = np.array([1.0, 1.5])
    coupling = np.array([[1.0, 0.0], [1.0, 1.0]])  # the second is at most the first and 0.5
    bounds = Bounds.of(first, None, np.array([np.inf, 0.5]), coupling)
    fit = least_squares(line, first, (T, Y), bounds=bounds)
    one = least_squares(lambda v, a: v[0] + (v[0] + 0.5) * a[0] - a[1], [1.0], (T, Y))
    assert fit.converged and fit.at_bound.tolist() == [False, True]
    assert np.allclose(fit.values, [one.values[0], one.values[0] + 0.5], rtol=1e-6)


@pytest.mark.parametrize("coupling", [TRIANGULAR, DENSE], ids=["triangular", "dense"])
@pytest.mark.parametrize("held", [0.0, -0.25, 1.0 / 3.0])
def test_a_held_value_stays_to_the_bit_also_on_or_beyond_its_bound(held, coupling):
    """A held value on its bound was moved inside by 1e-3, and the others were fitted to that."""
    start, free = np.array([0.5, 1.0, held]), np.array([True, True, False])
    low = np.array([-np.inf, -np.inf, 0.0])
    bounds = Bounds.of(start, low, coupling=coupling)

    def curved(v, a):
        return v[0] + v[1] * a[0] + v[2] * a[0] ** 2 - a[1]

    fit = least_squares(curved, start, (T, Y), bounds=bounds, free=free)
    one = least_squares(line, start[:2], (T, Y - held * T**2))
    assert fit.values[2] == held and not fit.at_bound[2] and fit.stderr[2] == 0.0
    assert fit.converged and np.allclose(fit.values[:2], one.values, rtol=1e-9)
    assert fit.cost == pytest.approx(one.cost, rel=1e-9)


HOST = """
import jax, jax.numpy as jnp, numpy as np
from fitting import least_squares
assert not jax.config.jax_enable_x64
t = np.linspace(0.0, 1.0, 20)
y = np.exp(-1.23456789012345 * t)
fit = least_squares(lambda v, a: jnp.exp(-v[0] * a[0]) - a[1], [1.0], (t, y))
assert fit.converged and fit.values.dtype == fit.jacobian.dtype == np.float64
assert abs(fit.values[0] - 1.23456789012345) < 1e-12
assert not jax.config.jax_enable_x64 and jnp.ones(1).dtype == jnp.float32
"""


def test_a_fit_is_in_float64_whatever_the_host_has_set():
    root = Path(__file__).parents[3]
    command = [sys.executable, "-W", "error", "-c", HOST]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
