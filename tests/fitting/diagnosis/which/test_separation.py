"""Odds between effects that look alike beside a base that misfits: as sure as the lines agree."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import norm

from fitting.diagnosis.which.evidence._evidence import (
    Evidence,
    HypothesisEvidence,
    difference_error,
)
from fitting.diagnosis.which.evidence._probability import hypothesis_probabilities

LINES = 2000


def test_it_is_the_error_of_a_sum_over_lines():
    one, other = np.random.default_rng(1).chisquare(1, (2, 50))
    assert difference_error(one, one) == 0.0
    assert difference_error(one, other) == difference_error(other, one)
    assert difference_error(other + 2.0, other) == pytest.approx(2.0 * np.sqrt(50))


def test_between_two_that_are_equally_wrong_differences_are_as_large_as_it_says():
    """Each misses other lines, by as much; 2000 draws of the noise and of which lines."""
    rng = np.random.default_rng(2)
    found = []
    for _ in range(2000):
        noise, size = rng.standard_normal(400), rng.exponential(6.0, 400)
        mine = rng.random(400) < 0.5
        one, other = (noise + size * mine) ** 2, (noise + size * ~mine) ** 2
        found.append((one - other).sum() / difference_error(one, other))
    share = np.mean(np.abs(found) > norm.isf(0.025))
    assert share == pytest.approx(0.05, abs=3 * np.sqrt(0.05 * 0.95 / 2000))


APART = 1500.0  # of chi-square, between the look-alikes


def evidence(left: float, sigmas: float, *, noise_known: bool = True) -> Evidence:
    """Two look-alikes, so many standard errors apart; `left`: of chi-square a line."""
    near, far = (APART / sigmas if sigmas else np.inf), 1.0

    def hypothesis(name: str, chi_square: float, errors: tuple[float, ...]):
        return HypothesisEvidence(
            (name,), 1, chi_square, 0.0, 0.0, chi_square, difference_errors=errors
        )

    none = HypothesisEvidence((), 0, 10.0 * LINES, 0.0, 0.0, difference_errors=(0.0, far, far))
    delay = hypothesis("delay", left * LINES, (far, 0.0, near))
    lowpass = hypothesis("amplifier_lowpass", left * LINES + APART, (far, near, 0.0))
    return Evidence(LINES, 0, noise_known, (none, delay, lowpass))


def odds(of: Evidence) -> float:
    found = dict(hypothesis_probabilities(of))
    return found["delay"] / found["amplifier_lowpass"]


@pytest.mark.parametrize("sigmas", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(("left", "noise_known"), [(1.3, True), (0.5, False)])
def test_beside_a_misfit_odds_are_those_of_the_normal_law(sigmas, left, noise_known):
    found = odds(evidence(left, sigmas, noise_known=noise_known))
    assert found == pytest.approx(norm.cdf(sigmas) / norm.sf(sigmas), rel=1e-6)


def test_lines_that_agree_and_a_base_that_fits_leave_the_odds():
    surest = odds(evidence(1.3, 30.0))
    assert surest > 20.0
    without = [
        dataclasses.replace(h, difference_errors=None) for h in evidence(1.3, 0.5).hypotheses
    ]
    unknown = Evidence(LINES, 0, noise_known=True, hypotheses=tuple(without))
    assert odds(unknown) == pytest.approx(surest)
    assert odds(evidence(1.0, 0.5)) == pytest.approx(odds(evidence(1.0, 30.0)))


def test_a_hypothesis_within_another_is_not_helped():
    """What an effect adds to one that is there is judged by chi-square alone."""
    found = evidence(1.3, 0.5)
    none, delay, lowpass = found.hypotheses
    pair = dataclasses.replace(lowpass, effects=("amplifier_lowpass", "delay"), parameters=2)
    both = dataclasses.replace(found, hypotheses=(none, delay, pair))
    far = dataclasses.replace(pair, difference_errors=None)
    alone = dataclasses.replace(found, hypotheses=(none, delay, far))
    assert hypothesis_probabilities(both) == hypothesis_probabilities(alone)


@pytest.mark.parametrize("left", [1.0, 1.5, 10.0, 1e4])
@pytest.mark.parametrize("removed", [0.0, 0.001, 0.5])
def test_no_effect_is_never_likelier_than_if_nothing_else_were_considered(left, removed):
    """Where all hypotheses leave much, they are hardly told apart: what each leaves still tells."""
    found = evidence(left, 1.0)
    none = dataclasses.replace(
        found.hypotheses[0], synchronous=left * LINES, difference_errors=None
    )
    effect = dataclasses.replace(
        none, effects=("delay",), parameters=1, synchronous=(1.0 - removed) * none.synchronous
    )
    alone = dataclasses.replace(found, hypotheses=(none,))
    beside = dataclasses.replace(found, hypotheses=(none, effect))
    most = dict(hypothesis_probabilities(alone))["none"]
    ranked = dict(hypothesis_probabilities(beside))
    assert ranked["none"] <= most * (1.0 + 1e-12)
    assert sum(ranked.values()) == pytest.approx(1.0)


def test_it_is_in_files_and_older_files_lack_it():
    found = evidence(1.3, 0.7)
    assert Evidence.from_dict(found.to_dict()) == found
    older = found.to_dict()
    for hypothesis in older["hypotheses"]:
        del hypothesis["difference_errors"]
    assert {h.difference_errors for h in Evidence.from_dict(older).hypotheses} == {None}
