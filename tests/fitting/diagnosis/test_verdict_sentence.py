"""How sure the first sentence of a diagnosis is."""

import pytest

from fitting.diagnosis._diagnosis import Verdict
from fitting.diagnosis._text import verdict_advice, verdict_sentence
from fitting.diagnosis._verdict import doubt_data
from fitting.identification.data_checks._fault import Fault
from rapi_jax.effects import Resonance


@pytest.mark.parametrize(
    ("low", "verb"), [(0.02, "gap is"), (0.0, "gap may be"), (-0.4, "gap may be")]
)
def test_an_effect_that_may_predict_no_better_is_no_finding(low, verb):
    """Of a magnetic core: a resonance, 66 %, that closes 8 % of the gap, -36 to 52."""
    closed = {"value": 0.08, "low": low, "high": 0.52}
    shrinkage = {"closed_fraction": closed, "before": 0.0567, "after": 0.0547}
    said = verdict_sentence("resonance", (Resonance,), 0.66, shrinkage, "V")
    assert verb in said and "it closes 8 %" in said


def test_where_nothing_explains_data_with_a_fault_that_comes_first():
    verdict = Verdict(
        name="unlisted", mechanism="unlisted", effects=(), probability=0.97, set=("unlisted",),
        reason="", sentence="The gap is real.", advice="Record the next scan.",
    )  # fmt: skip
    fault = Fault("unsettled start", "run00", "run 'run00': cut the first period off.", ())
    said = doubt_data(verdict, [fault])
    assert "cut the first period off. Then diagnose it again." in said.advice
    assert "next scan" not in said.advice and said.sentence == verdict.sentence


@pytest.mark.parametrize(("most", "refused"), [(None, False), (6.5, False), (0.8, True)])
def test_compensation_that_surely_makes_scans_worse_is_advised_against(most, refused):
    said = verdict_advice("resonance", (Resonance,), ["resonance"], None, straighter=most)
    assert ("Do not compensate" in said) == refused
