"""What takes probability from hypotheses after they were ranked."""

import pytest

from fitting.diagnosis._verdict import describe_doubted_laws, laws_of_hysteresis
from fitting.diagnosis.family._choice import FamilyChoice
from fitting.diagnosis.which.evidence._conformal import credible_set
from fitting.diagnosis.which.evidence._probability import (
    doubt_law,
    doubt_remainder,
    doubt_unknown_noise,
    doubt_unpredictive,
)
from fitting.diagnosis.which.evidence._thresholds import THRESHOLDS
from rapi_jax import RAPI, FixedRAPI
from rapi_jax.effects import AmplitudeLaw, Creep

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


def test_what_no_hysteresis_leaves_keeps_unlisted_in_the_set():
    """Probabilities sum to 1, the others keep their ratios; what is larger already stays."""
    ranked = [("delay", 0.90), ("etalon", 0.06), ("unlisted", 0.04)]
    found = dict(doubt_remainder(ranked))
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["unlisted"] == pytest.approx(THRESHOLDS.unlisted_share)
    assert found["delay"] / found["etalon"] == pytest.approx(15.0)
    assert "unlisted" in credible_set(doubt_remainder(ranked))
    sure = [("unlisted", 0.9), ("delay", 0.1)]
    assert doubt_remainder(sure) == sure


def test_a_law_of_thresholds_may_be_that_of_another_hysteresis():
    """What it loses the other effect of a pair gains, else `unlisted`; others stay."""
    half = THRESHOLDS.law_of_hysteresis
    ranked = [
        ("amplitude_law+creep", 0.6), ("creep", 0.1), ("rate_law", 0.2), ("delay+rate_law", 0.06),
        ("unlisted", 0.03), ("none", 0.01),
    ]  # fmt: skip
    found = dict(doubt_law(ranked, {"amplitude_law", "rate_law"}))
    want = {
        "amplitude_law+creep": (1 - half) * 0.6, "creep": 0.1 + half * 0.6,
        "rate_law": (1 - half) * 0.2, "delay+rate_law": (1 - half) * 0.06,
        "unlisted": 0.03 + half * 0.26, "none": 0.01,
    }  # fmt: skip
    assert found == pytest.approx(want)
    assert dict(doubt_law(ranked, ())) == dict(ranked)


@pytest.mark.parametrize(
    ("operator", "laws"), [(RAPI, set()), (FixedRAPI, {"amplitude_law"}), (None, set())]
)
def test_laws_are_doubted_where_other_thresholds_were_taken(operator, laws):
    family = None if operator is None else FamilyChoice(operator, {operator.__name__: 0.0})
    found = laws_of_hysteresis(family, [AmplitudeLaw, Creep])
    assert found.keys() == laws
    notes = describe_doubted_laws(found, ["amplitude_law+creep", "creep"], "GHz")
    assert len(notes) == len(laws)
    assert all(note.startswith("A dependence on amplitude or bias may be") for note in notes)
    assert describe_doubted_laws(found, ["creep"], "GHz") == ()


def test_where_noise_is_unknown_an_effect_is_never_certain():
    """Of 44 simulated devices, nearly all named with certainty, 32 were named right."""
    ranked = [("delay", 0.98), ("etalon", 0.02), ("unlisted", 0.0)]
    found = dict(doubt_unknown_noise(ranked))
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["unlisted"] == pytest.approx(THRESHOLDS.unlisted_unknown_noise)
    assert found["delay"] / found["etalon"] == pytest.approx(49.0)
    assert "unlisted" in credible_set(doubt_unknown_noise(ranked))


@pytest.mark.parametrize("first", ["none", "unlisted"])
def test_it_is_as_certain_as_before_that_nothing_or_something_unknown_is_missing(first):
    """None of 23 simulated devices without effects was called otherwise."""
    ranked = [(first, 0.97), ("delay", 0.02), (next(iter({"none", "unlisted"} - {first})), 0.01)]
    assert doubt_unknown_noise(ranked) == ranked
