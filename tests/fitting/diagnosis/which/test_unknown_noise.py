"""Where noise is not known, an effect has to predict data held out before it is named."""

import dataclasses

import numpy as np
import pytest

from fitting.diagnosis._diagnosis import Verdict
from fitting.diagnosis._text import effect_label, verdict_advice, verdict_sentence
from fitting.diagnosis._verdict import doubt_noise
from fitting.diagnosis.noise._residual_whiteness import ResidualWhiteness
from fitting.diagnosis.where._description import describe_localisation
from fitting.diagnosis.which.evidence._evidence import Evidence, HypothesisEvidence
from fitting.diagnosis.which.evidence._probability import hypothesis_probabilities
from rapi_jax.effects import Creep, CurrentCoupling, Drift, Etalon, ModeHop

LINES = 400


def evidence(with_effect: float) -> Evidence:
    """Chi-square a line of 30 without an effect, and `with_effect` with creep."""
    none = HypothesisEvidence((), 0, 30.0 * LINES, 0.0, 0.0)
    creep = HypothesisEvidence(("creep",), 1, with_effect * LINES, 0.0, 0.0)
    return Evidence(LINES, 0, False, (none, creep))


@pytest.mark.parametrize(
    ("closed", "name"),
    [(None, "creep"), (0.9, "creep"), (0.7, "creep"), (0.1, "unlisted"), (-3.0, "unlisted")],
)
def test_what_stays_open_on_held_out_data_speaks_for_something_unlisted(closed, name):
    known = {} if closed is None else {"creep": closed}
    ranked = hypothesis_probabilities(evidence(5.0), known)
    assert ranked[0][0] == name and ranked[0][1] > 0.9
    assert sum(p for _, p in ranked) == pytest.approx(1.0)


def test_an_effect_that_leaves_noise_is_named_however_it_predicts():
    assert hypothesis_probabilities(evidence(1.0), {"creep": -1.0})[0][0] == "creep"


def test_the_sentence_does_not_close_less_than_nothing():
    shrinkage = {
        "closed_fraction": {"value": -2.98, "low": 0.0, "high": 1.0},
        "before": 0.049,
        "after": 0.0978,
    }
    said = verdict_sentence("creep", (Creep,), 0.97, shrinkage, "GHz")
    assert "held-out data: 49 MHz rms without it, 97.8 MHz with it" in said and "-298" not in said


def test_a_gap_that_held_out_data_do_not_show_is_said():
    """A richer hysteresis predicts them to noise without the effect, whose share has no value."""
    found = {"closed_fraction": None, "before": 0.0219, "after": 0.0248, "held_out": ["last"]}
    said = verdict_sentence("creep", (Creep,), 0.97, found | {"floor": 0.02}, "GHz")
    assert "gap may be" in said and "Held-out data do not show it" in said
    assert "leaves 21.9 MHz rms" in said
    for lacking in ({"floor": None}, {"floor": 0.02, "held_out": []}):
        short = verdict_sentence("creep", (Creep,), 0.97, found | lacking, "GHz")
        assert "gap is" in short and short.endswith("(probability 97 %).")


@pytest.mark.parametrize(
    ("low", "value", "high", "text"),
    [
        (0.9, 0.94, 0.96, "94 % (90 to 96) of the gap"),
        (0.994, 0.995, 0.997, "99.5 % (99.4 to 99.7) of the gap"),
        (0.97, 0.9995, 0.99999, "over 99.9 % (at least 97) of the gap"),
        (0.9995, 0.9995, 0.99999, "over 99.9 % of the gap"),
    ],
)
def test_the_sentence_has_the_share_with_its_interval_and_a_readable_unit(low, value, high, text):
    closed = {"low": low, "value": value, "high": high}
    shrinkage = {"closed_fraction": closed, "before": 0.136, "after": 0.0259}
    said = verdict_sentence("creep", (Creep,), 0.97, shrinkage, "GHz")
    assert text in said
    assert said.endswith("held-out data: the residual falls from 136 to 25.9 MHz rms.")


@pytest.mark.parametrize(
    ("name", "effects", "closed", "slow", "sentence", "advice"),
    [
        (
            "none",
            (),
            None,
            0.0,
            "consistent with noise. The noise itself was not measured",
            "measure the noise",
        ),
        ("unlisted", (), None, 0.9, "does not look like noise: 90 %", "Add no effect"),
        (
            "creep",
            ("creep",),
            -1.0,
            0.9,
            "as it was",
            "Do not add the effect on",
        ),
        (
            "creep",
            ("creep",),
            None,
            0.9,
            "as it was",
            "Do not add the effect on",
        ),
        ("creep", ("creep",), 0.8, 0.9, "as it was", "as it was"),
    ],
)
def test_verdicts_on_unknown_noise(name, effects, closed, slow, sentence, advice):
    verdict = Verdict(name, name, effects, 0.9, (name,), "", "as it was", "as it was")
    left = ResidualWhiteness(0.1, 10.0, slow, 0.1, 0.0, 0.01)
    fraction = None if closed is None else {"value": closed, "low": 0.0, "high": 1.0}
    said = doubt_noise(verdict, left, "um", fraction)
    assert sentence in said.sentence and advice in said.advice
    assert said.name == name


@pytest.mark.parametrize("effect", [Etalon, ModeHop, CurrentCoupling, Drift])
def test_optical_causes_are_not_said_of_a_sensor(effect):
    shrinkage = {"closed_fraction": None}
    for unit, same in (("GHz", True), ("um", False), ("V", False)):
        said = verdict_sentence(effect.name, (effect,), 0.9, shrinkage, unit)
        advice = verdict_advice(effect.name, (effect,), [], None, unit=unit)
        assert (effect.label in said) == same and (effect.remedy in advice) == same
        assert advice
    assert Creep.label in verdict_sentence("creep", (Creep,), 0.9, shrinkage, "um")


def test_an_effect_less_likely_than_not_is_no_finding():
    """Of three periods of a piezo, delay 48 %, amplifier 29 %: nothing to build on."""
    closed = {"value": 0.8, "low": 0.7, "high": 0.9}
    for fraction in (None, closed):
        shrinkage = {"closed_fraction": fraction, "before": 0.3, "after": 0.1}
        assert "gap may be" in verdict_sentence("creep", (Creep,), 0.48, shrinkage, "um")
        assert "gap is probably" in verdict_sentence("creep", (Creep,), 0.9, shrinkage, "um")
    advice = verdict_advice("creep", (Creep,), ["creep", "drift"], None, unit="um")
    drift = effect_label(Drift, "um")
    assert (
        f"cannot decide which effect it is: {Creep.label}, or {drift}" in advice
        and Creep.remedy not in advice
    )


def test_what_repeats_is_not_said_where_nothing_does():
    entry = {"run": 0, "excitation_hz": 10.0, "amplitude": 1.0, "direction": "up"}
    entries = [
        entry
        | {"region": region, "rms": 1.0, "rms_not_locked": 0.0, "share": s, "of_readings": 0.5}
        for region, s in (("edge", 0.9), ("middle", 0.1))
    ]
    assert describe_localisation(entries).endswith("; most of it repeats with the scan.")
    assert "repeats" not in describe_localisation(entries, repeats=False)


def tied(*identified: float, noise_known: bool = False) -> Evidence:
    """No effect, and two effects that leave as much as each other on the flexible base.

    On the identified base lines agree as those of noise alone do.
    """
    names, flexible = ((), ("creep",), ("etalon",)), (3.0, 1.0, 1.0)
    error = 2.0 * np.sqrt(LINES)
    errors = [tuple(0.0 if a == b else error for b in range(3)) for a in range(3)]
    return Evidence(
        LINES,
        0,
        noise_known,
        tuple(
            HypothesisEvidence(
                name, len(name), left * LINES, 0.0, 0.0, base * LINES, identified_errors=each
            )
            for name, left, base, each in zip(names, flexible, identified, errors, strict=True)
        ),
    )


def test_effects_that_a_searched_base_cannot_tell_apart_are_told_by_the_identified_one():
    alike, told = (dict(hypothesis_probabilities(tied(9.0, 3.0, x))) for x in (3.0, 5.0))
    assert alike["creep"] == pytest.approx(alike["etalon"])
    assert told["creep"] > 100.0 * told["etalon"]
    for name in ("none", "unlisted"):  # of which nothing else is said
        assert told[name] == pytest.approx(alike[name], rel=1e-6)


@pytest.mark.parametrize("noise_known", [True, False])
def test_nothing_is_told_where_noise_is_known_or_the_lines_are_not(noise_known):
    """A density of plays needs no such help, and without its errors no difference is one."""
    found = tied(9.0, 3.0, 5.0, noise_known=noise_known)
    without = tuple(dataclasses.replace(h, identified_errors=None) for h in found.hypotheses)
    alone = dataclasses.replace(found, hypotheses=without)
    same = hypothesis_probabilities(found) == hypothesis_probabilities(alone)
    assert same == noise_known
    if not noise_known:
        told = dict(hypothesis_probabilities(alone))
        assert told["creep"] == pytest.approx(told["etalon"])
