"""The host-side damped Gauss-Newton driver, on problems with known minima."""

import dataclasses

import numpy as np
import pytest

from fitting.solver._damped_gauss_newton import (
    Damping,
    Linearisation,
    StoppingRule,
    minimise_damped,
)

DAMPING = Damping(initial=1e-4, decrease=8.0, increase=12.0, smallest=1e-9, largest=1e4, attempts=9)
TO_ROUNDING = StoppingRule(lambda decrease, cost: decrease <= 0.0)


def linearised(residual, jacobian, *, secants=False):
    matrix, gradient = jacobian.T @ jacobian, jacobian.T @ residual

    def step(damping):
        return -np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), gradient)

    return Linearisation(step, uses_secants=secants)


def rosenbrock(p):
    return np.array([10.0 * (p[1] - p[0] ** 2), 1.0 - p[0]])


def minimise_rosenbrock(max_steps):
    return minimise_damped(
        np.array([-1.2, 1.0]),
        cost=lambda p: float(rosenbrock(p) @ rosenbrock(p)),
        linearise=lambda p, width: linearised(
            rosenbrock(p), np.array([[-20.0 * p[0], 10.0], [-1.0, 0.0]])
        ),
        move=lambda p, step: p + step,
        damping=DAMPING,
        stop=TO_ROUNDING,
        max_steps=max_steps,
    )


def test_rosenbrock_is_minimised_from_its_classical_start():
    assert minimise_rosenbrock(100) == pytest.approx([1.0, 1.0], abs=1e-8)


def test_the_limit_of_steps_holds_and_the_cost_never_rises():
    costs = [float(np.sum(rosenbrock(minimise_rosenbrock(n)) ** 2)) for n in range(12)]
    assert (np.diff(costs) <= 0).all() and costs[0] == pytest.approx(24.2)


def minimise_arctan(shares, max_steps):
    """From 3 an undamped step for arctan(p) = 0 goes to -9.5, where it is larger."""
    return minimise_damped(
        np.array([3.0]),
        cost=lambda p: float(np.arctan(p) @ np.arctan(p)),
        linearise=lambda p, width: linearised(np.arctan(p), np.diag(1.0 / (1.0 + p**2))),
        move=lambda p, step: p + step,
        damping=dataclasses.replace(DAMPING, shares=shares),
        stop=TO_ROUNDING,
        max_steps=max_steps,
    )


def test_a_step_that_overshoots_is_shortened_before_it_is_damped():
    step = -10.0 * np.arctan(3.0) / (1.0 + DAMPING.initial)
    assert minimise_arctan((0.3, 0.1), 1) == pytest.approx([3.0 + 0.3 * step], rel=1e-12)
    assert minimise_arctan((0.95, 0.1), 1) == pytest.approx([3.0 + 0.1 * step], rel=1e-12)
    damped = minimise_arctan((), 1)
    assert damped[0] != pytest.approx(3.0 + 0.3 * step) and abs(damped[0]) < 3.0
    for shares in ((), (0.3, 0.1)):
        assert minimise_arctan(shares, 50) == pytest.approx([0.0], abs=1e-8)


def test_secants_narrow_where_a_kink_is_nearer_than_they_are_wide():
    """A minimum at a kink, from a start where a secant of width 1 has the wrong sign."""

    def residual(p):
        return np.array([1.0 + np.abs(p[0] + 0.5) + 2.0 * np.maximum(p[0], 0.0)])

    widths = []

    def linearise(p, width):
        widths.append(width)
        secant = (residual(p + width) - residual(p)) / width
        return linearised(residual(p), secant[:, None], secants=True)

    def end(narrow):
        widths.clear()
        return minimise_damped(
            np.array([-0.7]),
            cost=lambda p: float(residual(p) @ residual(p)),
            linearise=linearise,
            move=lambda p, step: np.clip(p + step, -1.0, 1.0),
            damping=DAMPING,
            stop=TO_ROUNDING,
            max_steps=10,
            narrow_secant=narrow,
        )

    assert end(1.0)[0] == -0.7 and widths == [1.0]
    assert abs(end(0.01)[0] + 0.5) < 0.1 and set(widths) == {1.0, 0.01}


def test_two_slow_steps_in_a_row_end_it():
    taken = []
    minimise_damped(
        np.array([1.0]),
        cost=lambda p: float(p @ p),
        linearise=lambda p, width: Linearisation(lambda damping: -0.5 * p),
        move=lambda p, step: taken.append(step) or p + step,
        damping=DAMPING,
        stop=StoppingRule(lambda decrease, cost: False, slow=lambda decrease, cost: True),
        max_steps=10,
    )
    assert len(taken) == 2


def test_a_step_that_foresees_next_to_nothing_is_not_tried():
    """At a minimum of 3.0 the residual is no smaller anywhere, and the equations say so."""
    tried = []

    def end(start, *, foresees):
        tried.clear()

        def linearise(p, width):
            equations = linearised(p, np.eye(1))
            fall = (
                (lambda step: float(-step @ (2.0 * p + step))) if foresees else (lambda _: np.inf)
            )
            return dataclasses.replace(equations, decrease=fall)

        return minimise_damped(
            np.array([start]),
            cost=lambda p: 3.0 + float(p @ p),
            linearise=linearise,
            move=lambda p, step: tried.append(step) or p + step,
            damping=DAMPING,
            stop=StoppingRule(lambda decrease, cost: decrease < 1e-6),
            max_steps=50,
        )

    assert abs(end(2.0, foresees=True)[0]) < 1e-3 and len(tried) < 4
    assert end(0.0, foresees=True)[0] == 0.0 and not tried
    assert end(0.0, foresees=False)[0] == 0.0 and len(tried) == DAMPING.attempts
