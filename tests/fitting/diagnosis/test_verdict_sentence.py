"""How sure the first sentence of a diagnosis is."""

import pytest

from fitting.diagnosis._text import verdict_sentence
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
