"""Counts and tables of verdicts, beside counts by hand."""

import json

import numpy as np
import pytest
from blind_entries import FAILED, answer, prediction
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from fitting.blind.protocol._verdict_names import correct_verdict
from fitting.blind.scoring._outcome import Outcome
from fitting.blind.scoring._scores import score
from fitting.blind.scoring._wilson import proportion, wilson_interval

BANK = [
    # nulls: one alarm, with base misfit
    (answer("n1", "null", size=0.0), prediction("none", random="creep", aic="none")),
    (
        answer("n2", "null", size=0.0, misfit=True),
        prediction("creep", "creep", "none", sure=0.6, random="none", aic="drift"),
    ),
    # listed: right, right but too small to count, not separable, a pair for one, missed
    (
        answer("a", "listed", "creep", size=5.0),
        prediction("creep", survival=0.3, closed=0.95, random="creep", aic="creep+drift"),
    ),
    (answer("b", "listed", "drift", size=3.0), prediction("drift", survival=0.6, closed=0.85)),
    (
        answer("c", "listed", "delay", size=6.0),
        {
            **prediction("none", "none", "delay", sure=0.7, other="delay"),
        },
    ),
    (answer("d", "listed", "etalon", size=9.0), prediction("drift+etalon", "drift+etalon")),
    (answer("e", "listed", "pickup", size=2.5), prediction("none")),
    (answer("f", "form", "creep", size=30.0), prediction("unlisted")),
    (answer("g", "pair", "pickup", "delay", size=7.0), prediction("delay+pickup", closed=0.99)),
    (answer("h", "pair", "creep", "etalon", size=7.0), prediction("creep")),
    (answer("i", "unlisted", "unlisted:ripple", size=5.0), prediction("unlisted")),
    (answer("j", "unlisted", "unlisted:notch", size=5.0), prediction("delay", "delay", "unlisted")),
    (answer("k", "unlisted", "unlisted:notch", size=5.0), FAILED),
    (answer("l", "listed", "creep", size=8.0), prediction("unlisted", withheld="creep")),
    (answer("m", "listed", "creep", size=8.0), prediction("drift", withheld="creep")),
]
BANK[4][1]["diagnosis"]["hypotheses"][1]["survival"] = 0.01  # "c" is not separable


@pytest.fixture(scope="module")
def scores():
    return score([(a, p, None) for a, p in BANK])


def k_of_n(record):
    return record["k"], record["n"]


def test_strict_json(scores):
    assert json.loads(json.dumps(scores, allow_nan=False)) == scores
    assert scores["worlds"] == 15
    assert scores["errors"] == [{"name": "k", "error": "Odd: x"}]


def test_detection_and_false_alarms(scores):
    # 11 worlds of 2 sigma or more with all candidates; c, e and the error k are not detected
    assert k_of_n(scores["detection"]) == (8, 11)
    assert scores["detection"]["met"] is False
    alarms = scores["false_alarms"]
    assert [k_of_n(alarms[k]) for k in ("all", "with_base_misfit", "without")] == [
        (1, 2), (1, 1), (0, 1),
    ]  # fmt: skip
    assert (alarms["all"]["met"], alarms["without"]["met"]) == (False, True)


def test_first_in_the_list(scores):
    assert k_of_n(scores["top_1"]) == (1, 2)  # a of a and d: b, e too small, c not separable
    kinds = {kind: k_of_n(record) for kind, record in scores["by_kind"].items()}
    assert kinds == {"listed": (1, 2), "form": (0, 1), "pair": (1, 2), "pair_either": (2, 2)}
    assert {k: k_of_n(v) for k, v in scores["by_effect"].items()} == {
        "creep": (1, 2), "delay": (0, 1), "etalon": (0, 1),
    }  # fmt: skip


def test_a_pair_counts_where_each_of_the_two_can_be_detected():
    def judged(*alone):
        pair = answer("p", "pair", "creep", "etalon", size=9.0) | {"alone": list(alone)}
        found = score([(pair, prediction("unlisted"), None)])
        counted = [
            found["by_kind"]["pair"],
            found["unlisted"]["listed_called_unlisted"],
            found["sets"]["can_be_seen"]["coverage"],
            found["detection"],
        ]
        return [record["n"] for record in counted], found["failures"][0]["against"]

    assert judged(8.0, 2.0) == ([1, 1, 1, 1], ["pair", "listed called unlisted", "set"])
    assert judged(9.0, 0.0) == ([0, 0, 0, 1], [])  # one amplitude shows no law of amplitude


def test_tables_by_size_and_survival(scores):
    sizes = {row["from"]: k_of_n(row["all"]) for row in scores["by_size"]}
    assert sizes == {0.5: (0, 0), 1.0: (0, 0), 2.0: (1, 2), 4.0: (3, 7), 8.0: (0, 1), 20.0: (0, 1)}
    rows = {row["from"]: k_of_n(row) for row in scores["by_survival"] if row["n"]}
    assert rows == {0.0: (0, 1), 0.2: (1, 1), None: (0, 2)}


def test_sets(scores):
    # right within the set: n1 n2 a b c g i j; not: d e f h k
    for which in ("can_be_seen", "all"):
        assert k_of_n(scores["sets"][which]["coverage"]) == (8, 13)
        mean = scores["sets"][which]["mean_size"]  # the error has no set
        assert (mean["n"], mean["value"], mean["met"]) == (12, 15 / 12, True)


def test_unlisted(scores):
    unlisted = scores["unlisted"]
    assert k_of_n(unlisted["flagged"]) == (1, 3)
    assert k_of_n(unlisted["in_set"]) == (2, 3)
    assert k_of_n(unlisted["listed_called_unlisted"]) == (1, 6)  # f of a c d f g h


def test_left_out(scores):
    assert k_of_n(scores["left_out"]["all"]) == (1, 2)
    assert k_of_n(scores["left_out"]["by_effect"]["creep"]) == (1, 2)


def test_closed(scores):
    closed = scores["closed"]  # a, b, g are rightly named
    assert (*k_of_n(closed), closed["median"], closed["met"]) == (2, 3, 0.95, True)


def test_an_error_is_wrong_everywhere():
    bank = [(answer("x", kind, *truth, size=9.0), FAILED, None) for kind, truth in [
        ("null", ()), ("listed", ("creep",)), ("unlisted", ("unlisted:notch",)),
    ]]  # fmt: skip
    found = score(bank)
    assert k_of_n(found["detection"]) == (0, 2)
    assert k_of_n(found["false_alarms"]["all"]) == (1, 1)
    assert k_of_n(found["top_1"]) == (0, 1)
    assert k_of_n(found["unlisted"]["listed_called_unlisted"]) == (1, 1)
    assert k_of_n(found["sets"]["all"]["coverage"]) == (0, 3)
    assert found["honesty"]["ece_equal_mass"]["value"] == 1.0
    assert found["honesty"]["brier"]["value"] == 2.0


def test_a_missing_prediction_is_an_error():
    entry = Outcome.of(answer("x", "null"), None)
    assert entry.verdict == "error"
    assert "no prediction" in str(entry.error)
    assert Outcome.of(answer("x", "null"), {"diagnosis": {}}).verdict == "error"


def test_nothing_to_count_is_no_target_met():
    found = score([])
    assert found["detection"]["met"] is None
    assert found["detection"]["share"] is None
    assert found["honesty"]["brier"]["met"] is None
    json.dumps(found, allow_nan=False)


def test_baselines_are_counted_on_the_worlds_they_judged(scores):
    found = scores["baselines"]
    assert list(found) == ["diagnosis", "random", "aic"]
    assert k_of_n(found["aic"]["false_alarms"]) == (1, 2)
    assert k_of_n(found["random"]["false_alarms"]) == (1, 2)
    assert (k_of_n(found["random"]["top_1"]), k_of_n(found["aic"]["top_1"])) == ((1, 1), (0, 1))
    assert found["diagnosis"]["top_1"] == scores["top_1"]


def test_confusion_holds_every_world_with_all_candidates(scores):
    matrix = scores["confusion"]
    assert sum(sum(row.values()) for row in matrix.values()) == 13
    assert list(matrix)[0] == "none"
    assert matrix["none"] == {"creep": 1, "none": 1}
    assert matrix["creep (form)"] == {"unlisted": 1}
    assert matrix["unlisted:notch"] == {"delay": 1, "error": 1}
    assert matrix["delay+pickup"] == {"delay+pickup": 1}


def test_every_failure_by_name(scores):
    failed = {f["name"]: f["against"] for f in scores["failures"]}
    assert failed == {
        "f": ["form", "listed called unlisted", "set"],
        "d": ["top-1", "set"],
        "m": ["leave one out", "set"],
        "h": ["pair", "set"],
        "c": ["detection"],
        "j": ["unlisted"],
        "k": ["detection", "unlisted", "set"],
        "e": ["detection", "set"],
        "n2": ["false alarm"],
    }
    assert [f["size"] for f in scores["failures"]] == sorted(
        (f["size"] for f in scores["failures"]), reverse=True
    )


def test_names_of_truths():
    assert correct_verdict([]) == "none"
    assert correct_verdict(["pickup", "delay"]) == "delay+pickup"
    assert correct_verdict(("unlisted:ripple",)) == "unlisted"


@pytest.mark.parametrize(
    ("k", "n", "low", "high"),
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_as_published(k, n, low, high):
    """Newcombe, Statistics in Medicine 17 (1998) 857, Table I, method 3."""
    assert wilson_interval(k, n) == (pytest.approx(low, abs=5e-5), pytest.approx(high, abs=5e-5))


@given(st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_by_its_definition(pair):
    """The ends of all p with |k/n - p| <= z sqrt(p (1 - p)/n), as roots of a quadratic in p."""
    (k, n), z = pair, norm.ppf(0.975)
    roots = np.roots([1 + z * z / n, -(2 * k + z * z) / n, (k / n) ** 2])
    np.testing.assert_allclose(wilson_interval(k, n), np.sort(roots.real), atol=1e-9)
    low, high = wilson_interval(k, n)
    assert 0 <= low <= k / n <= high <= 1


def test_wilson_refuses_more_than_all():
    with pytest.raises(ValueError, match="between 0 and `n`"):
        wilson_interval(3, 2)


def test_targets():
    assert proportion(98, 100, least=0.98)["met"] is True
    assert proportion(97, 100, least=0.98)["met"] is False
    assert proportion(3, 100, most=0.03)["met"] is True
    assert proportion(4, 100, most=0.03)["met"] is False
    assert proportion(4, 100)["met"] is None
    assert proportion(0, 0, least=0.9)["met"] is None
