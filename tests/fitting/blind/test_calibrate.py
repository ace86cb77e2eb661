"""Calibrations on evidence whose right answers are known by construction."""

import dataclasses

import numpy as np
import pytest

from fitting.blind.protocol._folder import BankFolder
from fitting.blind.scoring._calibrate import Case, calibrate_to_bank, fit_calibration, log_loss
from fitting.diagnosis.which.evidence._calibration import Calibration, load_calibration
from fitting.diagnosis.which.evidence._conformal import credible_set
from fitting.diagnosis.which.evidence._evidence import Evidence, HypothesisEvidence
from fitting.diagnosis.which.evidence._probability import hypothesis_probabilities
from rapi_jax import DataError

LINES, LOOSE = 2000, 8000

BY_HAND = Calibration(
    temperature=4.0, form=1e-3, parameter=1.0, chance=20.0, none_level=0.5, none_slope=6.0,
    named_level=0.0, named_excess=1.5, named_left=3.0, named_open=2.0, nonsynchronous=6.0,
    left_unknown=0.5,
    left_unknown_width=0.08, misfit_unknown=1.5, misfit_unknown_width=0.2, provenance="by hand",
)  # fmt: skip


def evidence(none, **effects):
    """`none` and each effect with the chi-square a locked line that it leaves."""
    found = [HypothesisEvidence((), 0, none * LINES, float(LOOSE), 0.0)]
    for name, left in effects.items():
        found.append(
            HypothesisEvidence(tuple(name.split("_and_")), 2, left * LINES, float(LOOSE), 0.0)
        )
    return Evidence(LINES, LOOSE, True, tuple(found))


def test_probabilities_add_up_and_name_what_leaves_nothing():
    found = hypothesis_probabilities(
        evidence(40.0, creep=1.0, drift=20.0), {"creep": 0.999}, BY_HAND
    )
    assert sum(p for _, p in found) == pytest.approx(1.0)
    assert found[0][0] == "creep" and found[0][1] > 0.95 and credible_set(found) == ["creep"]


@pytest.mark.parametrize(
    "case, right",
    [
        (evidence(1.0, creep=0.995), "none"),
        (evidence(1.15, creep=1.14), "none"),  # a base that is not quite the device's
        (evidence(40.0, creep=35.0), "unlisted"),
        (evidence(40.0), "unlisted"),
        (evidence(40.0, creep=1.0, delay=1.0005), None),  # a tie
    ],
)
def test_what_is_said(case, right):
    found = hypothesis_probabilities(case, {}, BY_HAND)
    if right is None:
        assert {"creep", "delay"} <= set(credible_set(found))
    else:
        assert found[0][0] == right


def test_more_left_is_more_unlisted_and_so_is_less_on_data_held_out():
    def unlisted(left, closed):
        return dict(hypothesis_probabilities(evidence(40.0, creep=left), {"creep": closed}))[
            "unlisted"
        ]

    lefts = [unlisted(left, 0.95) for left in (1.0, 1.3, 2.0, 4.0, 9.0)]
    opens = [unlisted(2.0, closed) for closed in (0.999, 0.97, 0.9, 0.5, -3.0)]
    assert np.all(np.diff(lefts) > 0) and np.all(np.diff(opens) > 0)


def test_an_effect_that_changes_the_law_of_thresholds_pays_for_it():
    """Its odds to another that explains as much: the price over the temperature."""
    case = evidence(40.0, creep=1.0, rate=1.0)
    none, creep, rate = case.hypotheses
    case = dataclasses.replace(case, hypotheses=(none, creep, dataclasses.replace(rate, laws=1)))
    costly = dataclasses.replace(BY_HAND, law=12.0, form=0.0)
    found = dict(hypothesis_probabilities(case, {}, costly))
    assert np.log(found["creep"] / found["rate"]) == pytest.approx(12.0 / BY_HAND.temperature)


def test_numbers_that_are_held_stay():
    rng = np.random.default_rng(0)
    start = dataclasses.replace(BY_HAND, temperature=1.0)
    found = fit_calibration(
        overconfident(rng, 5), start, "test", steps=60, held=("chance", "second")
    )
    assert (found.chance, found.second) == (start.chance, start.second)
    assert found.temperature != start.temperature


def test_a_second_effect_must_do_more_than_mend_the_first_ones_equation():
    """Of 78 000 that creep explains, drift takes 200 up: a quarter of a hundredth."""
    case = evidence(40.0, creep=1.1, creep_and_drift=1.0)
    closed = {"creep": 0.99, "creep+drift": 0.99}
    known = dataclasses.replace(BY_HAND, second=0.01)
    plain = dict(hypothesis_probabilities(case, closed, BY_HAND))
    found = dict(hypothesis_probabilities(case, closed, known))
    assert plain["creep+drift"] > 0.9 and found["creep"] > 0.9
    apart = evidence(40.0, creep=20.0, creep_and_drift=1.0)  # what no equation is wrong by
    assert hypothesis_probabilities(apart, closed, known)[0][0] == "creep+drift"


def test_an_effect_must_do_more_than_a_hysteresis_of_another_kind_would():
    """A density explains 40 of chi-square a line beside it; an amplitude law 0.1 of the rest."""
    plain = evidence(1.1, amplitude_law=1.0)
    operator = [
        dataclasses.replace(h, identified=h.synchronous + h.nonsynchronous + 40.0 * LINES)
        for h in plain.hypotheses
    ]
    misfits = dataclasses.replace(plain, hypotheses=tuple(operator))
    known = dataclasses.replace(BY_HAND, hysteresis=0.01)
    for case, right in ((plain, "amplitude_law"), (misfits, "none")):
        assert hypothesis_probabilities(case, {}, known)[0][0] == right
    assert hypothesis_probabilities(misfits, {}, BY_HAND)[0][0] == "amplitude_law"


@pytest.mark.parametrize(("left", "named"), [(1.0, True), (1.06, True), (1.6, False)])
def test_an_effect_that_leaves_noise_alone_has_removed_no_other_hysteresis(left, named):
    """A density explains 640 of chi-square a line; of 1.2 a line more the effect leaves a part.

    A hundredth of what the density explains would be 6.4 a line, whatever is left.
    """
    case = evidence(left + 1.2, creep=left)
    operator = [
        dataclasses.replace(h, identified=h.synchronous + h.nonsynchronous + 640.0 * LINES)
        for h in case.hypotheses
    ]
    misfits = dataclasses.replace(case, hypotheses=tuple(operator))
    known = dataclasses.replace(BY_HAND, hysteresis=0.01)
    found = dict(hypothesis_probabilities(misfits, {"creep": 0.99}, known))
    assert (found["creep"] > 0.9) is named and (found["creep"] < 1e-3) is not named


def test_unlisted_is_no_surer_than_two_effects_are_found():
    most = dataclasses.replace(BY_HAND, most_unlisted=0.9)
    for left, limit in ((20.0, 0.9), (1.0, 0.1)):
        found = dict(hypothesis_probabilities(evidence(40.0, creep=left), {}, most))
        assert found["unlisted"] <= limit
    alone = dict(hypothesis_probabilities(evidence(40.0, creep=40.0), {}, most))
    assert alone["unlisted"] > 0.99  # nothing is named that a second effect would complete


def overconfident(rng, count):
    """Two effects whose chi-squares differ by 40 whichever is right, and nulls and unlisted."""
    out = []
    for _ in range(count):
        right = rng.random() < 0.7
        case = evidence(40.0, creep=1.0, delay=1.02)
        out.append(Case(case, {"creep": 0.99, "delay": 0.99}, "creep" if right else "delay"))
        out.append(Case(evidence(1.0 + 0.1 * rng.random(), creep=1.0), {}, "none"))
        out.append(Case(evidence(40.0, creep=12.0), {"creep": 0.6}, "unlisted"))
    return out


@pytest.mark.slow
def test_a_calibration_learns_how_often_the_likelier_is_right():
    """70 % of the time, with more than 99 % at first."""
    rng = np.random.default_rng(0)
    cases, others = overconfident(rng, 60), overconfident(rng, 60)
    start = dataclasses.replace(BY_HAND, temperature=1.0, form=1e-6)
    found = fit_calibration(cases, start, "test", steps=800)
    assert dict(hypothesis_probabilities(cases[0].evidence, cases[0].closed, start))["creep"] > 0.99
    share = dict(hypothesis_probabilities(cases[0].evidence, cases[0].closed, found))["creep"]
    assert share == pytest.approx(0.7, abs=0.12)
    assert log_loss(others, found) < log_loss(others, start) - 0.1
    assert found.provenance == "test"


def test_few_cases_move_little():
    case = Case(evidence(40.0, creep=1.0), {"creep": 0.999}, "creep")
    found = fit_calibration([case], BY_HAND, "one", steps=300)
    for name, value in dataclasses.asdict(found).items():
        if isinstance(value, float):
            assert value == pytest.approx(getattr(BY_HAND, name), rel=0.5, abs=0.5)


@pytest.mark.parametrize(
    "truth, size, alone, counts",
    [
        ([], 0.0, [], True),
        (["creep"], 5.0, [5.0], True),
        (["rate_law"], 0.3, [0.3], False),  # one rate
        (["delay", "rate_law"], 8.0, [8.0, 0.3], False),
        (["delay", "rate_law"], 8.0, [6.0, 4.0], True),
    ],
)
def test_what_cannot_be_seen_calibrates_nothing(truth, size, alone, counts):
    answer = {"truth": truth, "size": size, "alone": alone, "kind": "listed" if truth else "null"}
    report = {"hypotheses": [], "evidence": evidence(40.0, creep=1.0).to_dict()}
    case = Case.of(answer, {"diagnosis": report})
    assert (case is not None) == counts
    assert Case.of(answer, {}) is None


def test_no_cases_are_refused():
    with pytest.raises(ValueError, match="at least one"):
        fit_calibration([], BY_HAND, "none")


def test_evidence_and_calibrations_survive_their_files():
    one = evidence(40.0, creep=1.0)
    assert Evidence.from_dict(one.to_dict()) == one
    assert Calibration.from_dict(load_calibration().to_dict()) == load_calibration()
    with pytest.raises(ValueError, match="schema"):
        Calibration.from_dict({"schema": "rapi.calibration/0"})


def test_a_sealed_bank_calibrates_nothing(tmp_path):
    from fitting.blind.protocol._sealed import commit_to_secret

    folder = BankFolder(tmp_path / "bank")
    commit_to_secret(folder)
    from fitting.blind.protocol._make import make_bank

    make_bank(folder, "sealed", count=1, seed=None)
    with pytest.raises(DataError, match="for judging alone"):
        calibrate_to_bank(folder)
