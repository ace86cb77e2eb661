"""Effects of odd values: how much less surely they are named."""

import dataclasses

import numpy as np
import pytest

from fitting.diagnosis.which.evidence._evidence import Evidence, HypothesisEvidence
from fitting.diagnosis.which.evidence._probability import hypothesis_probabilities
from rapi_jax.effects import ALL, Pickup

LINES, ODDS = 2000, 20.0


def evidence(odd: float, *, noise_known: bool = True) -> Evidence:
    """A pickup and a drift that leave about as much, of which the pickup's values are `odd`."""
    none = HypothesisEvidence((), 0, 1.3 * LINES, 0.0, 0.0)
    pickup = HypothesisEvidence(("pickup",), 1, 1.05 * LINES, 0.0, 0.0, log_prior=-np.log(odd))
    drift = HypothesisEvidence(("drift",), 1, 1.05 * LINES + 0.5, 0.0, 0.0)
    return Evidence(LINES, 0, noise_known, (none, pickup, drift))


@pytest.mark.parametrize("noise_known", [True, False])
def test_odds_are_by_as_much_less(noise_known):
    usual, odd = (
        dict(hypothesis_probabilities(evidence(odds, noise_known=noise_known)))
        for odds in (1.0, ODDS)
    )
    against = {name: usual["pickup"] / usual[name] for name in usual if name != "pickup"}
    for name in ("none", "drift"):
        assert odd["pickup"] / odd[name] == pytest.approx(against[name] / ODDS, rel=1e-9)
    assert sum(odd.values()) == pytest.approx(1.0)


def test_what_is_not_listed_gains_as_much_on_the_only_effect():
    found = evidence(1.0)
    alone = dataclasses.replace(
        found, hypotheses=(found.hypotheses[0], evidence(1.0).hypotheses[1])
    )
    rare = dataclasses.replace(
        found, hypotheses=(found.hypotheses[0], evidence(ODDS).hypotheses[1])
    )
    usual, odd = (dict(hypothesis_probabilities(one)) for one in (alone, rare))
    assert usual["none"] < 1e-6  # so that all that matters is the effect against what is unlisted
    before, after = (found["pickup"] / found["unlisted"] for found in (usual, odd))
    assert after == pytest.approx(before / ODDS, rel=1e-4)


def test_only_a_slow_tone_is_odd():
    assert [cls.name for cls in ALL if cls.at().log_prior() != 0.0] == []
    tones = [0.1, 2.0, 19.9, 20.1, 50.0, 900.0]
    found = [Pickup.at(amplitude=0.1, hertz=hertz).log_prior() for hertz in tones]
    assert found == pytest.approx([-np.log(ODDS)] * 3 + [0.0] * 3)


def test_it_is_in_files_and_older_files_lack_it():
    found = evidence(ODDS)
    assert Evidence.from_dict(found.to_dict()) == found
    older = found.to_dict()
    for hypothesis in older["hypotheses"]:
        del hypothesis["log_prior"]
    assert {h.log_prior for h in Evidence.from_dict(older).hypotheses} == {0.0}
