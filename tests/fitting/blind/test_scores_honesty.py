"""Calibration and proper scores beside forecasters whose scores are known."""

import numpy as np
import pytest
from blind_entries import FAILED, answer, prediction

from fitting.blind.scoring._calibration_error import (
    calibration_error,
    calibration_scores,
    reliability_diagram,
)
from fitting.blind.scoring._outcome import Outcome
from fitting.blind.scoring._scan_comparison import compare_scans
from fitting.blind.scoring._thresholds import THRESHOLDS

BOTH = pytest.mark.parametrize("equal_mass", [True, False])


def entry(truth, said, sure=1.0, other="none", *names):
    kind = "listed" if truth else "null"
    found = prediction(said, *(names or (said,)), sure=sure, other=other)
    return Outcome.of(answer("x", kind, *truth), found)


@BOTH
def test_a_calibrated_forecaster_has_no_error(equal_mass):
    rng = np.random.default_rng(0)
    sure = rng.random(200_000)
    right = (rng.random(sure.size) < sure).astype(float)
    assert calibration_error(sure, right, equal_mass=equal_mass) < 0.01


@BOTH
def test_an_overconfident_one_is_off_by_its_excess(equal_mass):
    right = np.repeat([1.0, 0.0], [70, 30])
    np.random.default_rng(0).shuffle(right)
    found = calibration_error(np.full(100, 0.95), right, equal_mass=equal_mass)
    # Bins of equal mass split what is tied, but none is right more often than it says.
    assert found == pytest.approx(0.25, abs=0.02 if equal_mass else 1e-12)


def test_bins_differ():
    """Two crowds in one bin of equal width cancel; in bins of equal mass they do not."""
    sure = np.repeat([0.91, 0.99], 500)
    right = np.repeat([1.0, 0.9], 500)
    assert calibration_error(sure, right, equal_mass=False) == pytest.approx(0.0, abs=1e-12)
    assert calibration_error(sure, right, equal_mass=True) == pytest.approx(0.09)
    curve = reliability_diagram(sure, right)
    assert [(c["n"], c["confidence"]) for c in curve[::9]] == [
        (100, pytest.approx(0.91)), (100, pytest.approx(0.99)),
    ]  # fmt: skip


def test_the_interval_holds_the_error_and_chance_is_told():
    rng = np.random.default_rng(1)
    entries = [entry(("creep",) if rng.random() < 0.8 else (), "creep", 0.8) for _ in range(60)]
    found = calibration_scores(entries)["ece_equal_width"]
    assert found["low"] <= found["value"] <= found["high"]
    assert found["by_chance"] == pytest.approx(np.sqrt(2 / np.pi * 0.16 / 60), rel=0.1)


def test_brier_and_log_by_hand():
    entries = [entry(("creep",), "creep", 0.8), entry((), "creep", 0.6), entry((), "none")]
    found = calibration_scores(entries)
    brier = (2 * 0.2**2 + 2 * 0.6**2 + 0) / 3
    assert found["brier"]["value"] == pytest.approx(brier)
    assert found["log"]["value"] == pytest.approx(-(np.log(0.8) + np.log(0.4)) / 3)
    # The base rate says 1/3 creep, 2/3 none every time.
    assert found["brier"]["base_rate"] == pytest.approx(1 - 1 / 9 - 4 / 9)
    assert found["log"]["base_rate"] == pytest.approx(-(np.log(1 / 3) + 2 * np.log(2 / 3)) / 3)
    assert found["brier"]["met"] is True


def test_a_truth_that_was_not_considered_costs_much_but_not_all():
    found = calibration_scores([entry(("drift",), "creep")])
    assert found["log"]["value"] == pytest.approx(-np.log(THRESHOLDS.least_probability))
    assert found["log"]["met"] is False
    assert found["brier"]["value"] == 2.0


def test_a_better_next_scan_is_significant():
    def three(k):
        first = entry(("creep",), "creep", 0.5, "none", "creep", "none", "drift")
        advised = entry(("creep",), "creep", 0.9 + k / 1000, "none", "creep")
        other = entry(("creep",), "creep", 0.6, "none", "creep", "none")
        return first, advised, other

    found = compare_scans([three(k) for k in range(12)])
    assert found["set_size"]["advised"] == 1.0
    assert (found["set_size"]["better"], found["set_size"]["worse"]) == (12, 0)
    assert found["set_size"]["p_sign"] == pytest.approx(2.0**-12)
    assert found["probability_of_truth"]["p_signed_rank"] == pytest.approx(2.0**-12)
    assert found["met"] is True
    swapped = compare_scans([(a, c, b) for a, b, c in [three(k) for k in range(12)]])
    assert swapped["met"] is False
    assert swapped["set_size"]["p_sign"] == 1.0


def test_ties_and_failures_of_the_next_scan():
    same = entry((), "none")
    found = compare_scans([(same, same, same)])
    assert (found["set_size"]["p_signed_rank"], found["met"]) == (1.0, False)
    failed = Outcome.of(answer("broken", "null"), FAILED)
    found = compare_scans([(same, failed, same)])
    assert (found["n"], found["failed"], found["met"]) == (0, ["x"], None)
    assert compare_scans([])["met"] is None
