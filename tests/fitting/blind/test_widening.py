"""Factors that widen sets, from outcomes whose answers are known by construction."""

import json

import numpy as np
import pytest

from fitting.blind.protocol._folder import BankFolder
from fitting.blind.scoring._outcome import Outcome
from fitting.blind.scoring._widening import fit_widening, plain_probabilities, widen_to_bank
from fitting.diagnosis.which.evidence._calibration import Calibration, load_calibration
from fitting.diagnosis.which.evidence._conformal import credible_set, widen
from rapi_jax import DataError


def outcome(truth, probability, *, size=10.0, widening=None):
    ranked = sorted(probability.items(), key=lambda pair: -pair[1])
    kind = "null" if not truth else "listed"
    answer = {"name": "world-1", "kind": kind, "size": size if truth else 0.0}
    answer |= {"base_misfit": False, "truth": truth}
    report = {
        "verdict": {"name": ranked[0][0], "set": credible_set(ranked), "effects": []},
        "hypotheses": [{"name": name, "probability": p} for name, p in ranked],
        "calibration": {} if widening is None else {"widening": widening},
    }
    return Outcome.of(answer, {"diagnosis": report})


def sure_and_wrong(count, wrong, said=0.97):
    """Of `count` single effects named with probability `said`, `wrong` were the other one."""
    named = {"creep": said, "delay": 1.0 - said}
    right = [outcome(["creep"], named) for _ in range(count - wrong)]
    return right + [outcome(["delay"], named) for _ in range(wrong)]


def test_sets_that_hold_too_few_answers_are_widened_and_no_others():
    nulls = [outcome([], {"none": 0.98, "unlisted": 0.02}) for _ in range(40)]
    found, told = fit_widening([*nulls, *sure_and_wrong(40, 8)], load_calibration(), "by hand")
    assert found.widening["none"] == 1.0 and found.widening["single"] > 1.0
    assert found.widening_provenance == "by hand"
    ranked = [("creep", 0.97), ("delay", 0.03)]
    assert credible_set(ranked) == ["creep"]
    assert credible_set(widen(ranked, found.widening)) == ["creep", "delay"]
    assert told["single"] == {"n": 40, "held": 40, "factor": found.widening["single"]}
    assert Calibration.from_dict(json.loads(json.dumps(found.to_dict()))) == found


def test_three_in_a_hundred_are_let_be():
    found, told = fit_widening(sure_and_wrong(100, 3), load_calibration(), "by hand")
    assert found.widening["single"] == 1.0 and told["single"]["held"] == 97


def test_a_type_with_few_devices_takes_the_factor_of_all():
    pairs = [outcome(["creep", "drift"], {"creep+drift": 0.99, "creep": 0.01}) for _ in range(5)]
    found, told = fit_widening([*pairs, *sure_and_wrong(60, 12)], load_calibration(), "by hand")
    assert found.widening["pair"] > 1.0 and told["pair"]["n"] == 5


def test_effects_below_the_noise_do_not_count():
    faint = [outcome(["creep"], {"none": 0.98, "creep": 0.02}, size=0.5) for _ in range(30)]
    found, told = fit_widening([*faint, *sure_and_wrong(40, 0)], load_calibration(), "by hand")
    assert "none" not in told and found.widening["single"] == 1.0


def test_too_few_devices_are_refused():
    with pytest.raises(ValueError, match="holds 18 devices to judge by, too few"):
        fit_widening(sure_and_wrong(18, 0), load_calibration(), "by hand")


def test_probabilities_are_those_before_an_earlier_widening():
    plain = {"creep": 0.97, "delay": 0.02, "none": 0.01}
    ranked = sorted(plain.items(), key=lambda pair: -pair[1])
    widened = outcome(["creep"], dict(widen(ranked, {"single": 3.0})), widening=3.0)
    found = dict(plain_probabilities(widened))
    assert found == pytest.approx(plain)


def test_answers_are_right_as_often_as_the_curve_says():
    found, _ = fit_widening(sure_and_wrong(200, 20), load_calibration(), "by hand")
    assert sum(part["n"] for part in found.reliability) == 200
    right = sum(part["n"] * part["right"] for part in found.reliability) / 200
    assert right == pytest.approx(0.9)
    said = [part["confidence"] for part in found.reliability]
    assert np.all(np.array(said) < 0.97)


def test_a_sealed_bank_is_for_judging_alone(tmp_path):
    folder = BankFolder(tmp_path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BankFolder, "sealed", property(lambda self: True))
        with pytest.raises(DataError, match="judging alone. Widen sets by one of tier `open`"):
            widen_to_bank(folder)
