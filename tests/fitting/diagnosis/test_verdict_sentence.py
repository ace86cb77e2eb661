"""How sure the first sentence of a diagnosis is."""

import dataclasses

import pytest
from bare import bare

from fitting.diagnosis._diagnosis import Diagnosis, Verdict
from fitting.diagnosis._text import closed_share, verdict_advice, verdict_sentence
from fitting.diagnosis._verdict import (
    doubt_data,
    explain_random_jumps,
    explain_richer_hysteresis,
    mention_likeliest,
)
from fitting.diagnosis.how_far._cross_validation import CrossValidation
from fitting.diagnosis.noise._telegraph import RandomJumps
from fitting.diagnosis.which._candidate import Candidate
from fitting.identification.data_checks._fault import Fault
from fitting.report.diagnosis._files import _reasons
from fitting.report.diagnosis._numbers import SPACE, format_interval
from rapi_jax.effects import Resonance


@pytest.mark.parametrize(
    ("low", "verb"), [(0.02, "gap is probably"), (0.0, "gap may be"), (-0.4, "gap may be")]
)
def test_an_effect_that_may_predict_no_better_is_no_finding(low, verb):
    """Of a magnetic core: a resonance, 66 %, that closes 8 % of the gap, -36 to 52."""
    closed = {"value": 0.08, "low": low, "high": 0.52}
    shrinkage = {"closed_fraction": closed, "before": 0.0567, "after": 0.0547}
    said = verdict_sentence("resonance", (Resonance,), 0.66, shrinkage, "V")
    assert verb in said and "it closes 8 %" in said


@pytest.mark.parametrize(
    ("probability", "verb"),
    [
        (0.97, "gap is a"),
        (0.94, "gap is probably a"),
        (0.51, "gap is probably a"),
        (0.49, "gap may be"),
    ],
)
def test_the_verb_follows_the_probability(probability, verb):
    closed = {"value": 0.8, "low": 0.7, "high": 0.9}
    for found in (None, closed):
        shrinkage = {"closed_fraction": found, "before": 0.3, "after": 0.1}
        said = verdict_sentence("resonance", (Resonance,), probability, shrinkage, "um")
        assert verb in said and "mechanical resonance" in said


def test_what_predicts_held_out_data_no_better_may_be_however_probable():
    closed = {"value": -0.1, "low": -0.4, "high": 0.2}
    shrinkage = {"closed_fraction": closed, "before": 0.3, "after": 0.31}
    said = verdict_sentence("resonance", (Resonance,), 0.97, shrinkage, "um")
    assert "gap may be" in said and "does not improve the prediction" in said


def test_where_nothing_explains_data_with_a_fault_that_comes_first():
    verdict = Verdict(
        name="unlisted", mechanism="unlisted", effects=(), probability=0.97, set=("unlisted",),
        reason="", sentence="The gap is real.", advice="Record the next scan.",
    )  # fmt: skip
    fault = Fault("unsettled start", "run00", "run 'run00': cut the first period off.", ())
    said = doubt_data(verdict, [fault])
    assert "cut the first period off. Then diagnose it again." in said.advice
    assert "next scan" not in said.advice and said.sentence == verdict.sentence


def unlisted(*credible: str) -> Verdict:
    """A verdict that names nothing, with these in the credible set."""
    return Verdict(
        name="unlisted", mechanism="unlisted", effects=(), probability=0.57, set=credible,
        reason="", sentence="None explains it (probability 57 %).", advice="",
    )  # fmt: skip


def known(*effects) -> Candidate:
    return bare(Candidate, effects=effects)


def test_the_likeliest_of_the_known_effects_is_named_beside_an_unlisted_answer():
    ranked = [(None, 0.57), (known(Resonance()), 0.42), (known(), 0.01)]
    closed = bare(CrossValidation, closed={"value": 0.82, "low": 0.71, "high": 0.91})
    said = mention_likeliest(unlisted("unlisted", "resonance"), ranked, {"resonance": closed}, "V")
    assert said.sentence.startswith("None explains it (probability 57 %). Of the known ones")
    assert "a mechanical resonance (42 %), which closes 82 % (71 to 91)" in said.sentence
    without = mention_likeliest(unlisted("unlisted", "resonance"), ranked, {}, "V")
    assert without.sentence.endswith("a mechanical resonance (42 %).")


@pytest.mark.parametrize(
    "verdict",
    [
        unlisted("unlisted"),
        dataclasses.replace(unlisted("resonance", "unlisted"), name="resonance"),
    ],
)
def test_what_is_not_in_the_set_or_is_the_answer_is_not_mentioned(verdict):
    ranked = [(None, 0.57), (known(Resonance()), 0.42)]
    assert mention_likeliest(verdict, ranked, {}, "V") == verdict


@pytest.mark.parametrize(
    ("name", "faults", "words"),
    [
        ("resonance", [], []),
        (
            "unlisted",
            [],
            ["its diagnosis names no effect that explains the gap (probability 57 %)"],
        ),
        ("resonance", [{"kind": "clipped", "message": "run 'a'."}], ["clipped: run 'a'."]),
    ],
)
def test_why_a_diagnosis_makes_no_drive(name, faults, words):
    verdict = dataclasses.replace(unlisted("unlisted"), name=name)
    found = _reasons(bare(Diagnosis, verdict=verdict, content={"faults": faults}))
    assert len(found) == len(words) and all(w in f for w, f in zip(words, found, strict=True))


@pytest.mark.parametrize(("most", "refused"), [(None, False), (6.5, False), (0.8, True)])
def test_compensation_that_surely_makes_scans_worse_is_advised_against(most, refused):
    said = verdict_advice("resonance", (Resonance,), ["resonance"], None, straighter=most)
    assert ("Do not compensate" in said) == refused


@pytest.mark.parametrize("unit", ["V", "GHz"])
def test_jumps_are_the_headline_only_where_the_gap_is_not_several_times_larger(unit):
    """Of a magnetic core: jumps of 31 mV beside a gap of 357 mV that repeats with the scan."""
    verdict = dataclasses.replace(unlisted("unlisted"), advice="See where it lies.")
    jumps = RandomJumps(1e-6, 0.031)
    beside = explain_random_jumps(verdict, jumps, 0.357, unit)
    assert beside.sentence.startswith(verdict.sentence)
    assert f"jumps of about 31 m{unit}".replace("mGHz", "MHz") in beside.sentence
    assert beside.advice.startswith(verdict.advice) and "a loose contact" in beside.advice
    alone = explain_random_jumps(verdict, jumps, 0.02, unit)
    assert alone.sentence.startswith("The part of the residual that does not repeat with the scan")
    for said in (beside, alone):
        assert ("optical feedback" in said.advice) == (unit == "GHz")


@pytest.mark.parametrize(("expected", "refused"), [(None, False), (3.1, False), (0.32, True)])
def test_compensation_that_is_predicted_to_make_scans_worse_is_not_advised(expected, refused):
    """Of a steel core: a factor of 0.32 (0.24 to 8.6), so it is not sure."""
    said = verdict_advice(
        "resonance", (Resonance,), ["resonance"], None, straighter=8.6, expected=expected
    )
    assert ("Compensate with the corrected model" in said) != refused
    assert ("Do not compensate with this model yet" in said) == refused


@pytest.mark.parametrize("separates", [[], ["delay", "resonance"]])
def test_a_scan_that_would_not_decide_is_not_advised_as_if_it_did(separates):
    tied = ["delay", "resonance"]
    said = verdict_advice("delay", (Resonance,), tied, {"separates": separates})
    assert ("Record the next scan given below." in said) == bool(separates)
    assert ("No scan within the limits is sure to decide it" in said) == (not separates)


def test_sentence_and_table_have_the_same_interval():
    """The gap may grow: an end below 0 is no 0."""
    for closed in (
        {"value": 0.59, "low": -0.908, "high": 1.0},
        {"value": 0.40, "low": -0.035, "high": 0.84},
        {"value": 0.94, "low": 0.9, "high": 0.96},
    ):
        plain = format_interval(closed).translate({ord(SPACE): " ", ord("\N{MINUS SIGN}"): "-"})
        assert closed_share(closed) == plain.replace(" %)", ")")


@pytest.mark.parametrize(("plays", "said"), [(None, "as it is"), (24, "which has 24 plays")])
def test_where_more_plays_leave_noise_it_is_their_model_that_is_advised(plays, said):
    advice = verdict_advice("none", (), [], None, plays=plays)
    assert advice.startswith("Use the model") and said in advice


@pytest.mark.parametrize(("left", "used"), [(2.2, True), (9.95, False)])
def test_a_model_with_more_plays_is_advised_where_it_leaves_less(left, used):
    """What the identified model leaves, five times the noise, is never called noise."""
    verdict = dataclasses.replace(
        unlisted("none"),
        sentence="No effect is missing: the residual of the model is noise (probability 98 %).",
        advice="Use the model of this diagnosis.",
    )
    said = explain_richer_hysteresis(verdict, {"plays": 24, "rms": left}, 10.7, 2.02, "nm")
    assert "is noise (" not in said.sentence and "(probability 98 %)." in said.sentence
    for number in ("10.7 nm rms", f"24 plays, {left:g} nm rms", "noise is 2.02 nm"):
        assert number in said.sentence
    assert (said.advice == verdict.advice) == used
