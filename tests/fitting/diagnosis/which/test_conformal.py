"""Sets hold the answer in 95 %, by crepes' p-values and on devices that nobody saw."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.diagnosis.which.evidence._conformal import (
    answer_type,
    conformal_factor,
    credible_set,
    least_factor,
    temper,
    widen,
)

crepes = pytest.importorskip("crepes")


def overconfident(rng, count, power=4.0):
    """Ranked probabilities that are the true ones to the power of `power`, and the answer."""
    for _ in range(count):
        true = rng.dirichlet(np.full(6, 0.3))
        right = f"h{rng.choice(6, p=true)}"
        said = true**power / np.sum(true**power)
        yield sorted(((f"h{k}", float(p)) for k, p in enumerate(said)), key=lambda x: -x[1]), right


@given(st.lists(st.floats(1e-9, 1.0), min_size=2, max_size=12), st.floats(1.0, 30.0))
def test_tempering_keeps_the_order_and_flattens(weights, factor):
    ranked = sorted(
        ((f"h{k}", w / sum(weights)) for k, w in enumerate(weights)), key=lambda x: -x[1]
    )
    found = temper(ranked, factor)
    assert [n for n, _ in found] == [n for n, _ in ranked]
    assert sum(p for _, p in found) == pytest.approx(1.0)
    assert found[0][1] <= ranked[0][1] + 1e-12
    again = [p for _, p in temper(found, 1.0 / factor)]
    assert again == pytest.approx([p for _, p in ranked], rel=1e-6)


def test_the_least_factor_is_where_the_answer_enters():
    ranked = [("creep", 0.99), ("delay", 0.009), ("none", 0.001)]
    factor = least_factor(ranked, "delay")
    assert "delay" in credible_set(temper(ranked, factor))
    assert "delay" not in credible_set(temper(ranked, 0.999 * factor))
    assert least_factor(ranked, "creep") == 1.0
    assert least_factor(ranked, "drift") == np.inf


@pytest.mark.parametrize("size", [19, 20, 57, 99, 400])
def test_the_factor_is_that_of_the_p_values_of_crepes(size):
    rng = np.random.default_rng(size)
    scores = np.exp(rng.normal(size=size))
    factor = conformal_factor(scores)
    oracle = crepes.ConformalClassifier()
    oracle.fit(scores)
    inside, outside = oracle.predict_p(np.array([factor, factor * 1.0001]), smoothing=False)
    assert inside > 0.05 >= outside


def test_too_few_devices_have_no_factor():
    assert conformal_factor(np.ones(18)) == np.inf and conformal_factor(np.ones(19)) == 1.0


def test_sets_of_new_devices_hold_the_answer():
    """Without widening in 86 % here; with it in 95 % of devices like those of the calibration."""
    rng = np.random.default_rng(2)
    cases = overconfident(rng, 600)
    scores = np.array([least_factor(ranked, right) for ranked, right in cases])
    factor = conformal_factor(scores)
    fresh = list(overconfident(rng, 2000))
    before = np.mean([right in credible_set(ranked) for ranked, right in fresh])
    after = np.mean([right in credible_set(temper(ranked, factor)) for ranked, right in fresh])
    assert before < 0.9
    # 0.95, less three standard deviations of both samples.
    assert abs(after - 0.95) < 3.0 * np.sqrt(0.05 * 0.95 * (1 / 600 + 1 / 2000))


def test_each_type_of_answer_is_widened_by_its_own():
    names = {"none": "none", "unlisted": "unlisted", "creep": "single", "creep+delay": "pair"}
    assert {name: answer_type(name) for name in names} == names
    ranked = [("creep+delay", 0.97), ("creep", 0.03)]
    assert widen(ranked, {"single": 5.0}) == ranked
    assert widen(ranked, {"pair": 5.0})[0][1] < 0.7
