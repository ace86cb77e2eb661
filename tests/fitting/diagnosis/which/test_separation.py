"""Odds between effects that look alike beside a base that misfits: as sure as the lines agree."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import norm

from fitting.diagnosis.which.evidence._evidence import (
    Evidence,
    HypothesisEvidence,
    vuong_statistic,
)
from fitting.diagnosis.which.evidence._probability import hypothesis_probabilities

LINES = 2000


def test_of_equal_hypotheses_it_is_zero_and_it_changes_sign_with_their_order():
    one, other = np.random.default_rng(1).chisquare(1, (2, 50))
    assert vuong_statistic(one, one) == 0.0
    assert vuong_statistic(one, other) == -vuong_statistic(other, one)
    assert vuong_statistic(other + 1.0, other) == pytest.approx(np.sqrt(50))


def test_of_two_that_are_equally_wrong_it_is_standard_normal():
    """Each misses other lines, by as much; 2000 draws of the noise and of which lines."""
    rng = np.random.default_rng(2)
    found = []
    for _ in range(2000):
        noise, size = rng.standard_normal(400), rng.exponential(6.0, 400)
        mine = rng.random(400) < 0.5
        found.append(
            vuong_statistic((noise + size * mine) ** 2, (noise + size * ~mine) ** 2),
        )
    share = np.mean(np.abs(found) > norm.isf(0.025))
    assert share == pytest.approx(0.05, abs=3 * np.sqrt(0.05 * 0.95 / 2000))


def evidence(left: float, sigmas: float, *, noise_known: bool = True) -> Evidence:
    """Two look-alikes 1500 of chi-square apart; `left`: of chi-square a line."""

    def hypothesis(name: str, chi_square: float, separation: tuple[float, ...]):
        return HypothesisEvidence(
            (name,), 1, chi_square, 0.0, 0.0, chi_square, separation=separation
        )

    none = HypothesisEvidence((), 0, 10.0 * LINES, 0.0, 0.0, separation=(0.0, 9.0, 9.0))
    delay = hypothesis("delay", left * LINES, (-9.0, 0.0, -sigmas))
    lowpass = hypothesis("amplifier_lowpass", left * LINES + 1500.0, (-9.0, sigmas, 0.0))
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
    without = [dataclasses.replace(h, separation=None) for h in evidence(1.3, 0.5).hypotheses]
    unknown = Evidence(LINES, 0, noise_known=True, hypotheses=tuple(without))
    assert odds(unknown) == pytest.approx(surest)
    assert odds(evidence(1.0, 0.5)) == pytest.approx(odds(evidence(1.0, 30.0)))


def test_a_hypothesis_within_another_is_not_helped():
    """What an effect adds to one that is there is judged by chi-square alone."""
    found = evidence(1.3, 0.5)
    none, delay, lowpass = found.hypotheses
    pair = dataclasses.replace(lowpass, effects=("amplifier_lowpass", "delay"), parameters=2)
    both = dataclasses.replace(found, hypotheses=(none, delay, pair))
    far = dataclasses.replace(pair, separation=None)
    alone = dataclasses.replace(found, hypotheses=(none, delay, far))
    assert hypothesis_probabilities(both) == hypothesis_probabilities(alone)


def test_it_is_in_files_and_older_files_lack_it():
    found = evidence(1.3, 0.7)
    assert Evidence.from_dict(found.to_dict()) == found
    older = found.to_dict()
    for hypothesis in older["hypotheses"]:
        del hypothesis["separation"]
    assert {h.separation for h in Evidence.from_dict(older).hypotheses} == {None}
