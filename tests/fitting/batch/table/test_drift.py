"""Parameters that drift: the statistic by brute force, and the claim on simulated sessions."""

import itertools

import numpy as np
import pytest
from scipy import stats

from fitting.batch.table.statistics._drift import find_drift


def session(n: int, count: int, rng: np.random.Generator, kind: str):
    """Times, values and standard errors of a session without drift."""
    t = np.sort(rng.uniform(0.0, 8.0, n))
    if kind == "late":
        t[-1] = 200.0  # one recording a week after the others
    stderr = np.full((n, count), 0.5)
    if kind == "noisier":
        stderr *= np.exp(np.linspace(-1.0, 1.0, n))[:, None]
    a = rng.standard_normal((count, count))
    factor = np.linalg.cholesky(a @ a.T + 0.3 * np.eye(count))
    factor /= np.sqrt(np.sum(factor**2, axis=1))[:, None]
    drawn = {"long tails": rng.standard_t(3, (n, count))}.get(kind)
    drawn = rng.standard_normal((n, count)) if drawn is None else drawn
    return t, drawn @ factor.T + stderr * rng.standard_normal((n, count)), stderr


def test_p_is_that_of_all_orders():
    rng = np.random.default_rng(0)
    t = np.array([0.0, 1.0, 2.5, 3.0, 4.0, 7.0])
    x = np.array([0.1, 0.3, 0.2, 0.5, 0.45, 0.9])[:, None]

    def studentised(times):
        off, error = times - times.mean(), x[:, 0] - x.mean()
        return abs(np.sum(off * error)) / np.sqrt(np.sum(off**2 * error**2))

    seen = studentised(t)
    every = [studentised(np.array(order)) for order in itertools.permutations(t)]
    exact = np.mean([one >= seen * (1 - 1e-9) for one in every])
    draws = 20_000
    found = find_drift(t, x, np.zeros_like(x), permutations=draws, seed=int(rng.integers(99)))
    assert found is not None
    assert abs(found.p[0] - exact) < 5 * np.sqrt(exact * (1 - exact) / draws) + 1 / draws


def test_slope_and_robust_error_are_those_of_least_squares():
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0.0, 5.0, 25))
    x = 3.0 + 0.4 * t + (0.1 + 0.1 * t) * rng.uniform(-1, 1, 25)
    found = find_drift(t, x[:, None], np.zeros((25, 1)), permutations=99)
    assert found is not None
    design = np.stack([np.ones(25), t], axis=1)
    inverse = np.linalg.inv(design.T @ design)
    beta = inverse @ design.T @ x
    residual = x - design @ beta
    leverage = np.einsum("ij,jk,ik->i", design, inverse, design)
    meat = design.T * (residual / (1 - leverage)) ** 2 @ design  # HC3
    error = np.sqrt((inverse @ meat @ inverse)[1, 1])
    span = np.ptp(t)
    np.testing.assert_allclose([found.change[0], found.stderr[0]], [beta[1] * span, error * span])
    np.testing.assert_allclose(found.middle + 0.0, beta[0] + beta[1] * found.mean_time)


def test_a_precise_recording_weighs_more():
    t = np.arange(12.0)
    x = np.where(t < 6, 0.0, 1.0)[:, None] + 0.05 * np.cos(7 * t)[:, None]
    stderr = np.full((12, 1), 0.05)
    x[5, 0], stderr[5, 0] = 2.0, 40.0
    found = find_drift(t, x, stderr, permutations=999)
    even = find_drift(t, x, np.full((12, 1), 0.05), permutations=999)
    assert found is not None and even is not None
    assert found.p[0] < even.p[0] and found.p[0] < 0.05


def test_one_outlier_makes_no_drift_and_hides_none():
    rng = np.random.default_rng(2)
    t = np.arange(40.0)
    x = rng.standard_normal((40, 1))
    drifting = x + 4.0 * (t / 39.0)[:, None]
    x[-1], drifting[0] = 1e6, 1e6
    none, some = find_drift(t, x, np.zeros_like(x)), find_drift(t, drifting, np.zeros_like(x))
    assert none is not None and some is not None and none.p[0] > 0.05 > some.p[0]


def test_too_few_or_at_one_time_is_not_tested():
    assert find_drift(np.arange(5.0), np.ones((5, 1)), np.ones((5, 1))) is None
    assert find_drift(np.zeros(9), np.arange(9.0)[:, None], np.ones((9, 1))) is None


def test_the_same_table_gives_the_same_p():
    t, x, stderr = session(20, 3, np.random.default_rng(3), "plain")
    one, two = (find_drift(t, x, stderr, permutations=999) for _ in range(2))
    assert one is not None and two is not None
    np.testing.assert_array_equal(one.p, two.p)


def rates(n: int, count: int, sessions: int, kind: str, size: float) -> tuple[int, int]:
    """In how many sessions without drift one is named, and one of `size` deviations is found."""
    rng, false, found = np.random.default_rng(4), 0, 0
    for _ in range(sessions):
        t, x, stderr = session(n, count, rng, kind)
        still = find_drift(t, x, stderr, permutations=999)
        x[:, 0] += size * np.sqrt(1.25) * np.linspace(-0.5, 0.5, n)
        moved = find_drift(t, x, stderr, permutations=999)
        assert still is not None and moved is not None
        false, found = false + bool((still.p < 0.05).any()), found + bool(moved.p[0] < 0.05)
    return false, found


def most(sessions: int) -> int:
    """What 5 % of sessions do not exceed but once in a thousand."""
    return int(stats.binom.ppf(0.999, sessions, 0.05))


def test_false_drifts_are_as_rare_as_said_in_short():
    false, found = rates(60, 4, 60, "plain", 3.0)
    assert false <= most(60) and found >= 57


@pytest.mark.calibration
@pytest.mark.parametrize("kind", ["plain", "noisier", "long tails", "late"])
@pytest.mark.parametrize(("n", "count"), [(6, 4), (10, 10), (30, 10), (100, 10)])
def test_false_drifts_are_as_rare_as_said(n, count, kind):
    false, _ = rates(n, count, 400, kind, 3.0)
    assert false <= most(400)


@pytest.mark.calibration
@pytest.mark.parametrize("kind", ["plain", "noisier"])
def test_a_drift_of_three_deviations_is_found(kind):
    _, found = rates(60, 10, 100, kind, 3.0)
    assert found >= 95
