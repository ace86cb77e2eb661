"""The page of a comparison: one unit, one rule for digits, words of the device, facts in order."""

import dataclasses
import re

import pytest
from device_pairs import record
from worlds import drives

from fitting import compare
from fitting._parameter_words import describe_parameter
from fitting.comparison._comparison import Comparison
from fitting.comparison._differences import EffectPresence, EffectSize, Interval
from fitting.report.comparison._sizes import format_probability
from fitting.report.comparison._tables import list_facts, tabulate_parameters
from fitting.report.diagnosis._numbers import SPACE
from rapi_jax import parameters
from rapi_jax.effects import ALL
from rapi_jax.examples import paper_device


@pytest.fixture(scope="module")
def found() -> Comparison:
    session = drives(rates=(10.0, 40.0), amplitudes=(2.0, 3.0), periods=2, samples=200)
    return compare(record(session, 1), record(session, 2), ecdl=paper_device())


@pytest.fixture(scope="module")
def mixed(found) -> Comparison:
    """Sizes of 0.3 and of 13 MHz, and an effect of one recording alone."""
    small, large = Interval(0.0, 0.0, 3.21e-4), Interval(0.013018, 0.012982, 0.013055)
    gap = dataclasses.replace(found.gap, before=small, after=large)
    size = EffectSize(
        "Pickup.hertz",
        describe_parameter("Pickup.hertz"),
        "Hz",
        Interval(150.0, 149.9, 150.1),
        0.05,
    )
    effect = EffectPresence("pickup", "pickup", False, True, 1.4e-3, 0.894594, (size,))
    return dataclasses.replace(
        found,
        gap=gap, misfit=gap, misfit_changed=True, changed=True, effects=(effect,),
        response=Interval(0.01302, 0.01297, 0.01307),
    )  # fmt: skip


def text_of(page: str) -> str:
    return re.sub("<[^>]*>", " ", page.partition("</style>")[2]).replace(SPACE, " ")


def test_sizes_are_in_one_unit_with_digits_by_one_rule(mixed):
    for text in (mixed.sentence, mixed.summary(), text_of(mixed.page())):
        assert not re.search(r"\d [kGT]Hz\b(?!/)", text) and "0.321 MHz" in " ".join(text.split())
        assert "13.02 MHz (12.97 to 13.07)" in " ".join(text.split())
        assert not re.search(r"\b13 MHz (rms|\()", text) and "13.018" not in text


def test_probabilities_are_the_same_in_text_and_table(mixed):
    assert "its probability is 0.1 % before and 89 % after" in mixed.sentence
    text = " ".join(text_of(mixed.page()).split())
    assert "0.1 % before and 89 % after" in text and "89.5" not in text and " 0 %" not in text
    assert format_probability(0.0) == format_probability(1e-9) == f"<{SPACE}0.1{SPACE}%"


def test_one_effect_is_it_and_two_are_them(mixed):
    assert "With it in the model, what is left beyond noise still differs" in mixed.sentence
    two = dataclasses.replace(mixed, effects=mixed.effects * 2)
    assert "With them in the model" in two.sentence and "beside them." in two.sentence


def test_facts_fit_the_first_screen_and_begin_with_what_is_asked_first(mixed):
    facts = list_facts(mixed.to_dict())
    assert [name for name, _ in facts][:4] == ["Changed", "Response", "p", "Parameters"]
    assert len(facts) <= 6 and "Nothing changed" not in mixed.page()
    assert dict(facts)["Parameters"].startswith("unchanged: probability")
    assert "by its own model" in mixed.page()  # further down


def test_what_grows_away_from_zero_grows_by_so_many_per_cent(found):
    """`d_2` is below zero: from -0.10770 to -0.10903 it grew by 1.2 %, as all others did by 1."""
    one = dataclasses.replace(
        found["d_2"],
        before=-0.10770, before_stderr=1e-4, after=-0.10903,
        difference=Interval(-0.00133, -0.00166, -0.00099),
    )  # fmt: skip
    assert one.describe_share() == "+1.2 %" and one.describe(one.difference).endswith(", +1.2 %")
    assert one.describe_percent(one.difference) == "+1.2 % (+0.9 to +1.5)"
    content = dataclasses.replace(found, parameters=(one,)).to_dict()
    assert content["parameters"]["d_2"]["percent"] == pytest.approx(1.2349, abs=1e-3)
    assert tabulate_parameters(content)[0]["cells"][3] == f"+1.2{SPACE}%"


@pytest.mark.parametrize("name", ["d_1", "d_2", "d_3", "d_4"])
def test_a_response_that_is_no_frequency_is_not_tuned(name):
    assert "tuning" in describe_parameter(name) and "tuning" in describe_parameter(name, "MHz")
    words = describe_parameter(name, "um")
    assert "tuning" not in words and "response" in words


def test_every_parameter_of_an_effect_has_words():
    for cls in ALL:
        for p in parameters(cls()):
            words = describe_parameter(f"{cls.__name__}.{p.name}")
            assert words != f"{p.name.replace('_', ' ')} of {cls.label}", p.name
            assert not re.search(r"hertz|_|\btau\b", words), words


def test_an_effects_parameter_stands_in_words_with_its_unit(mixed):
    named = dataclasses.replace(
        mixed["d_2"], name="Pickup.hertz", words=describe_parameter("Pickup.hertz"), unit="Hz"
    )
    shown = dataclasses.replace(mixed, parameters=(named,))
    for text in (text_of(shown.page()), shown.summary()):
        assert "hertz" not in text and "frequency of the pickup" in " ".join(text.split())
    assert "frequency of the pickup 150.00 (149.90 to 150.10) Hz" in shown.sentence
