"""The credible set holds 95 % of the probability, and no hypothesis more than it needs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.diagnosis.which.evidence._conformal import credible_set
from fitting.diagnosis.which.evidence._probability import doubt_all


@pytest.mark.parametrize(
    ("probabilities", "size"), [((0.96, 0.04), 1), ((0.6, 0.36, 0.04), 2), ((0.5, 0.3, 0.2), 3)]
)
def test_by_hand(probabilities, size):
    ranked = list(zip("abc", probabilities, strict=False))
    assert credible_set(ranked) == list("abc")[:size]


@given(st.lists(st.floats(1e-3, 1.0), min_size=1, max_size=20))
def test_it_is_the_smallest_one(weights):
    total = sum(weights)
    ranked = sorted(((f"h{k}", w / total) for k, w in enumerate(weights)), key=lambda p: -p[1])
    found = credible_set(ranked)
    assert found == [name for name, _ in ranked[: len(found)]]
    held = [probability for _, probability in ranked[: len(found)]]
    assert sum(held) >= 0.95 - 1e-12
    assert sum(held[:-1]) < 0.95


def test_a_doubt_about_all_leaves_a_twentieth_and_their_order():
    ranked = [("creep", 0.7), ("none", 0.2), ("unlisted", 0.06), ("delay", 0.04)]
    after = doubt_all(ranked)
    assert [name for name, _ in after] == ["unlisted", "creep", "none", "delay"]
    assert dict(after)["creep"] == pytest.approx(0.035)
    assert sum(p for _, p in after) == pytest.approx(1.0)
