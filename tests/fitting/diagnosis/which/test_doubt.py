"""What takes probability from hypotheses after they were ranked."""

import pytest

from fitting.diagnosis.which.evidence._probability import doubt_unpredictive

RANKED = [("creep", 0.9), ("delay", 0.06), ("unlisted", 0.03), ("none", 0.01)]


def closed(low: float, value: float, high: float) -> dict[str, float]:
    return {"value": value, "low": low, "high": high}


def test_an_effect_that_leaves_most_of_the_gap_open_on_new_data_is_no_answer():
    found = doubt_unpredictive(RANKED, {"creep": closed(-0.1, 0.03, 0.2)})
    assert found[0][0] == "unlisted"
    assert dict(found)["creep"] < 0.05 and dict(found)["delay"] == 0.06
    assert sum(p for _, p in found) == pytest.approx(1.0)


@pytest.mark.parametrize("one", [closed(0.9, 0.99, 1.0), closed(-2.0, 0.1, 0.8)])
def test_an_effect_that_closes_it_or_may_do_so_stays(one):
    """Also where too little was held out to say."""
    assert dict(doubt_unpredictive(RANKED, {"creep": one})) == pytest.approx(dict(RANKED))
    assert dict(doubt_unpredictive(RANKED, {})) == pytest.approx(dict(RANKED))
